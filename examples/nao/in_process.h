/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A controller of nao.dbc and the robot in one program (canopy/in_process.h): for runs of millions of ticks, and on a
 * target that has no CAN. The controller is the same application as everywhere; the robot's side here is what canopy-sim is
 * on a desk, without its checks.
 */
#ifndef NAO_IN_PROCESS_H
#define NAO_IN_PROCESS_H

#include "canopy/in_process.h"
#include "canopy_sim/nao.h"

/** Messages that a controller of nao.dbc receives. */
enum { NAO_IN_PROCESS_SENSORS = 2 };

/** The robot as a world: its plant, and what it was told last. `robot` may be set to any state before a tick. */
typedef struct {
    canopy_sim_nao_t robot;
    canopy_sim_power_mode_t power_mode;     /**< Of the last tick. */
    canopy_sim_posture_mode_t posture_mode; /**< Of the last tick. */
    canopy_time_t age;                      /**< Of the sensors' frames when the controller takes them [us]. */
    int32_t least_battery;                  /**< Since it was last set [0.1 %]. */
    canopy_world_t world;
    uint16_t battery; /* places of the sensors' messages */
    uint16_t posture;
    bool is_known;
    canopy_sim_power_mode_t next_power; /* of the tick under way */
    canopy_sim_posture_mode_t next_posture;
} nao_world_t;

/** Everything that a run needs. */
typedef struct {
    nao_world_t nao;
    canopy_in_process_t host;
    canopy_in_process_sensor_t sensors[NAO_IN_PROCESS_SENSORS];
} nao_in_process_t;

/** The robot in the state in which the paper's examples begin (canopy_sim_nao_init()). @return for canopy_in_process_init() */
const canopy_world_t *nao_world_init(nao_world_t *self);

/** Joins the application and a robot. */
canopy_error_t nao_in_process_init(nao_in_process_t *self, const canopy_app_t *app);

/** Sensors out, one cycle of the controller, commands in, one step of the plant. @return status of the tree's root. */
canopy_status_t nao_in_process_tick(nao_in_process_t *self);

#endif
