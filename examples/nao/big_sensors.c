/* SPDX-License-Identifier: MIT */
/** @file The whole robot's sensors as messages of big.dbc, each at its cycle time. */
#include "big_codec.h"
#include "big_parts_of_world.h"

enum { UM_PER_MM = 1000, MDEG_PER_DEG = 1000, LONGEST = 8 };

static void encode_battery(const canopy_sim_robot_t *robot, uint8_t *data)
{
    big_battery_t battery = {.charging = robot->nao.power.charging,
                             .plugged = canopy_sim_robot_is_plugged(robot),
                             .level = (uint16_t)robot->nao.power.battery,
                             .charger_distance = canopy_sim_power_distance_mm(&robot->nao.power)};

    (void)big_battery_encode(&battery, data, LONGEST);
}

static void encode_cells(const canopy_sim_robot_t *robot, uint8_t *data)
{
    big_cells_t cells = {.current = (int16_t)robot->current_ma,
                         .temperature = (int8_t)(robot->battery_mdeg / MDEG_PER_DEG)};

    (void)big_cells_encode(&cells, data, LONGEST);
}

static void encode_posture(const canopy_sim_robot_t *robot, uint8_t *data)
{
    big_posture_t posture = {.head_x = (int16_t)robot->nao.posture.head_x_mm,
                             .head_height = (uint16_t)robot->nao.posture.head_height_mm,
                             .name = (uint8_t)robot->pose};

    (void)big_posture_encode(&posture, data, LONGEST);
}

static void encode_touch(const canopy_sim_robot_t *robot, uint8_t *data)
{
    big_touch_t touch = {.toe_left_outer = (robot->toes & 1u) != 0u,
                         .toe_left_inner = (robot->toes & 2u) != 0u,
                         .toe_right_inner = (robot->toes & 4u) != 0u,
                         .toe_right_outer = (robot->toes & 8u) != 0u,
                         .chest_button = robot->chest_button,
                         .odometer = (uint16_t)((uint64_t)(robot->odometer_um / UM_PER_MM) & UINT16_MAX)};

    (void)big_touch_encode(&touch, data, LONGEST);
}

static void encode_voice(const canopy_sim_robot_t *robot, uint8_t *data)
{
    big_voice_t voice = {.count = robot->wishes, .suggestion = (uint8_t)robot->wish};

    (void)big_voice_encode(&voice, data, LONGEST);
}

static void encode_ball(const canopy_sim_robot_t *robot, uint8_t *data)
{
    big_ball_t ball = {
        .tracked = robot->tracked, .hand = (uint8_t)robot->hand, .distance = (uint16_t)(robot->ball_um / UM_PER_MM)};

    (void)big_ball_encode(&ball, data, LONGEST);
}

static void encode_acts(const canopy_sim_robot_t *robot, uint8_t *data)
{
    big_acts_t acts = {.speech_state = (uint8_t)robot->speech.state,
                       .arms_state = (uint8_t)robot->arms.state,
                       .said = (uint8_t)robot->speech.what,
                       .say_number = robot->speech.number,
                       .arms = (uint8_t)robot->arms.what,
                       .arms_number = robot->arms.number};

    (void)big_acts_encode(&acts, data, LONGEST);
}

static void encode_joints(const canopy_sim_robot_t *robot, uint8_t *data)
{
    const int32_t *mdeg = robot->joint_mdeg;
    big_joints_t joints = {.head = (int8_t)(mdeg[CANOPY_SIM_JOINT_HEAD] / MDEG_PER_DEG),
                           .left_arm = (int8_t)(mdeg[CANOPY_SIM_JOINT_LEFT_ARM] / MDEG_PER_DEG),
                           .right_arm = (int8_t)(mdeg[CANOPY_SIM_JOINT_RIGHT_ARM] / MDEG_PER_DEG),
                           .left_leg = (int8_t)(mdeg[CANOPY_SIM_JOINT_LEFT_LEG] / MDEG_PER_DEG),
                           .right_leg = (int8_t)(mdeg[CANOPY_SIM_JOINT_RIGHT_LEG] / MDEG_PER_DEG)};

    (void)big_joints_encode(&joints, data, LONGEST);
}

static const struct {
    uint32_t id;
    uint32_t cycle_ms;
    void (*encode)(const canopy_sim_robot_t *robot, uint8_t *data);
} sensors[BIG_SENSORS] = {
    {BIG_BATTERY_ID, BIG_BATTERY_CYCLE_MS, encode_battery}, {BIG_CELLS_ID, BIG_CELLS_CYCLE_MS, encode_cells},
    {BIG_POSTURE_ID, BIG_POSTURE_CYCLE_MS, encode_posture}, {BIG_TOUCH_ID, BIG_TOUCH_CYCLE_MS, encode_touch},
    {BIG_VOICE_ID, BIG_VOICE_CYCLE_MS, encode_voice},       {BIG_BALL_ID, BIG_BALL_CYCLE_MS, encode_ball},
    {BIG_ACTS_ID, BIG_ACTS_CYCLE_MS, encode_acts},          {BIG_JOINTS_ID, BIG_JOINTS_CYCLE_MS, encode_joints},
};

void big_sense(big_world_t *self, canopy_in_process_t *host)
{
    uint32_t step_ms = self->robot.figures->step_ms;

    for (unsigned index = 0; index < (unsigned)BIG_SENSORS; index++) {
        uint8_t data[LONGEST];

        if (!self->is_known) {
            self->places[index] = canopy_in_process_find(host, sensors[index].id, false);
        }
        if (self->robot.time_ms % sensors[index].cycle_ms < step_ms &&
            self->places[index] != (uint16_t)CANOPY_IN_PROCESS_NONE) {
            sensors[index].encode(&self->robot, data);
            canopy_in_process_put(host, self->places[index], data, 0);
        }
    }
    self->is_known = true;
}
