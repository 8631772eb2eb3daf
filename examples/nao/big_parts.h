/* SPDX-License-Identifier: MIT */
/** @file What the leaves of the Big BT share. */
#ifndef NAO_BIG_PARTS_H
#define NAO_BIG_PARTS_H

#include "nao_big_leaves.h"

/** From this height of the head on the robot stands (Example 5). */
#define BIG_STANDING NAO_BIG_POSTURE_HEAD_HEIGHT(0.48)

/** A new order to the arms: its number is the one after the robot's last. */
canopy_status_t big_begin_arms(const nao_big_input_t *in, nao_big_output_t *out, big_order_t *self,
                               nao_big_upper_command_arms_t arms);

/** Goes on giving an order to the arms. @return SUCCESS when the robot has carried it out, else RUNNING. */
canopy_status_t big_go_on_with_arms(const nao_big_input_t *in, nao_big_output_t *out, const big_order_t *self,
                                    nao_big_upper_command_arms_t arms);

#endif
