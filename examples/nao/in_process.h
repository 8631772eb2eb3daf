/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A controller and the robot in one program, on a loopback bus: for runs of millions of ticks, and on a target that has
 * no CAN. The controller is the same application as everywhere; the robot side here is what canopy-sim is on a desk.
 */
#ifndef NAO_IN_PROCESS_H
#define NAO_IN_PROCESS_H

#include "canopy/can/loopback.h"
#include "canopy/loop.h"
#include "canopy_sim/nao.h"

enum { NAO_IN_PROCESS_QUEUE = 16 };

/** Everything a run needs. Set up by nao_in_process_init(); `robot` may be set to any state before a tick. */
typedef struct {
    canopy_sim_nao_t robot;
    canopy_sim_power_mode_t power_mode;     /**< Of the last tick. */
    canopy_sim_posture_mode_t posture_mode; /**< Of the last tick. */
    canopy_loopback_t bus;
    canopy_loopback_endpoint_t controller_end;
    canopy_loopback_endpoint_t robot_end;
    canopy_can_frame_t controller_queue[NAO_IN_PROCESS_QUEUE];
    canopy_can_frame_t robot_queue[NAO_IN_PROCESS_QUEUE];
    canopy_clock_t clock;
    canopy_loop_config_t config;
    canopy_loop_t loop;
    canopy_time_t now;
    canopy_time_t age; /**< Of the sensors' frames when the controller takes them [us]. */
    uint8_t counter;   /* E2E, of both sensor messages */
} nao_in_process_t;

/** Joins the application and a robot in the state in which the paper's examples begin (canopy_sim_nao_init()). */
canopy_error_t nao_in_process_init(nao_in_process_t *self, const canopy_app_t *app);

/** Sensors out, one cycle of the controller, commands in, one step of the plant. @return status of the tree's root. */
canopy_status_t nao_in_process_tick(nao_in_process_t *self);

#endif
