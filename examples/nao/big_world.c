/* SPDX-License-Identifier: MIT */
/** @file The whole robot as a world: its commands, its step, and the people around it. */
#include "big_world.h"

#include "big_codec.h"
#include "big_parts_of_world.h"

enum { DRAINED = 210, TOES = 0xF, ANY_WISH = CANOPY_SIM_WISHES - 1 };

static uint32_t chance(big_world_t *self, uint32_t below)
{
    uint32_t value = self->random;

    value ^= value << 13;
    value ^= value >> 17;
    value ^= value << 5;
    self->random = value;
    return (uint32_t)(((uint64_t)value * below) >> 32);
}

void big_let_people_act(big_world_t *self)
{
    canopy_sim_robot_t *robot = &self->robot;
    uint32_t deed;

    if (self->people == 0u || (self->people_every > 1u && chance(self, self->people_every) != 0u)) {
        return;
    }
    deed = 1u << chance(self, 6);
    if ((self->people & deed) == 0u) {
        return;
    }
    self->deeds++;
    if (deed == (unsigned)BIG_PEOPLE_SAY) {
        (void)canopy_sim_robot_say(robot, (canopy_sim_wish_t)(1u + chance(self, (uint32_t)ANY_WISH)));
    } else if (deed == (unsigned)BIG_PEOPLE_TOES) {
        canopy_sim_robot_press_toes(robot, (uint8_t)(1u + chance(self, (uint32_t)TOES)), 0);
    } else if (deed == (unsigned)BIG_PEOPLE_PUSH) {
        canopy_sim_robot_push_over(robot);
    } else if (deed == (unsigned)BIG_PEOPLE_DROP) {
        canopy_sim_robot_drop_ball(robot);
    } else if (deed == (unsigned)BIG_PEOPLE_DRAIN) {
        (void)canopy_sim_robot_drain(robot, DRAINED);
    } else {
        canopy_sim_robot_plug(robot, robot->unplugged);
    }
}

static void sense(void *context, canopy_in_process_t *host)
{
    big_world_t *self = context;

    self->next = (canopy_sim_command_t){0};
    big_sense(self, host);
}

static void take(void *context, const canopy_can_frame_t *frame)
{
    big_world_t *self = context;
    big_power_command_t power;
    big_posture_command_t posture;
    big_upper_command_t upper;

    if (frame->id == BIG_POWER_COMMAND_ID &&
        big_power_command_decode(&power, frame->data, frame->length) == CANOPY_CODEC_OK) {
        self->next.power = (canopy_sim_power_mode_t)power.mode;
    } else if (frame->id == BIG_POSTURE_COMMAND_ID &&
               big_posture_command_decode(&posture, frame->data, frame->length) == CANOPY_CODEC_OK) {
        self->next.legs = (canopy_sim_legs_t)posture.mode;
    } else if (frame->id == BIG_UPPER_COMMAND_ID &&
               big_upper_command_decode(&upper, frame->data, frame->length) == CANOPY_CODEC_OK) {
        self->next.arms = (canopy_sim_arms_t)upper.arms;
        self->next.arms_number = upper.arms_number;
        self->next.say = (canopy_sim_say_t)upper.say;
        self->next.say_number = upper.say_number;
        self->next.track_ball = upper.track_ball;
    }
}

static bool step(void *context)
{
    big_world_t *self = context;

    self->command = self->next;
    canopy_sim_robot_step(&self->robot, &self->command);
    if (self->robot.nao.power.battery < self->least_battery) {
        self->least_battery = self->robot.nao.power.battery;
    }
    big_let_people_act(self);
    return true;
}

const canopy_world_t *big_world_init(big_world_t *self, canopy_sim_profile_t profile, uint32_t seed)
{
    *self = (big_world_t){.world = {.context = self, .sense = sense, .take = take, .step = step}};
    canopy_sim_robot_init(&self->robot, profile, seed);
    self->random = self->robot.random ^ UINT32_C(0x9E3779B9);
    self->random = self->random != 0u ? self->random : 1u;
    self->least_battery = self->robot.nao.power.battery;
    return &self->world;
}
