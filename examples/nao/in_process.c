/* SPDX-License-Identifier: MIT */
/** @file The robot's side of nao.dbc, in one program with the controller. */
#include "in_process.h"

#include "nao_codec.h"

/* Messages of nao.dbc: bytes 0 and 1 are the E2E header. */
enum { BATTERY_DATA_ID = 256, POSTURE_DATA_ID = 272, CHARGING_BIT = 0x10 };

static canopy_time_t virtual_now(void *context)
{
    return ((const nao_in_process_t *)context)->now;
}

static bool never_wait(void *context, canopy_time_t deadline)
{
    (void)context;
    (void)deadline;
    return false;
}

canopy_error_t nao_in_process_init(nao_in_process_t *self, const canopy_app_t *app)
{
    canopy_error_t error;

    *self = (nao_in_process_t){0};
    canopy_sim_nao_init(&self->robot);
    error = canopy_loopback_join(&self->bus, &self->controller_end, self->controller_queue, NAO_IN_PROCESS_QUEUE,
                                 app->acceptance);
    if (error != CANOPY_OK) {
        return error;
    }
    error = canopy_loopback_join(&self->bus, &self->robot_end, self->robot_queue, NAO_IN_PROCESS_QUEUE,
                                 CANOPY_CAN_ACCEPT_EVERYTHING);
    if (error != CANOPY_OK) {
        return error;
    }
    self->clock = (canopy_clock_t){.context = self, .now = virtual_now, .wait_until = never_wait};
    self->config = (canopy_loop_config_t){.app = app, .can = &self->controller_end.can, .clock = &self->clock};
    return canopy_loop_init(&self->loop, &self->config);
}

static void put(uint8_t *data, unsigned bytes, int32_t value)
{
    for (unsigned byte = 0; byte < bytes; byte++) {
        data[byte] = (uint8_t)(((uint32_t)value >> (8u * byte)) & 0xFFu);
    }
}

static void send_sensors(nao_in_process_t *self)
{
    canopy_can_frame_t battery = {.id = NAO_BATTERY_ID, .length = NAO_BATTERY_LENGTH, .time = self->now - self->age};
    canopy_can_frame_t posture = {.id = NAO_POSTURE_ID, .length = NAO_POSTURE_LENGTH, .time = self->now - self->age};
    const canopy_can_t *can = &self->robot_end.can;

    battery.data[1] = self->robot.power.charging ? CHARGING_BIT : 0;
    put(&battery.data[2], 2, self->robot.power.battery);
    put(&battery.data[4], 3, canopy_sim_power_distance_mm(&self->robot.power));
    canopy_e2e_protect(BATTERY_DATA_ID, self->counter, battery.data, battery.length);
    put(&posture.data[2], 2, self->robot.posture.head_x_mm);
    put(&posture.data[4], 2, self->robot.posture.head_height_mm);
    canopy_e2e_protect(POSTURE_DATA_ID, self->counter, posture.data, posture.length);
    self->counter = (uint8_t)((self->counter + 1u) % CANOPY_E2E_COUNTERS);
    (void)can->send(can->context, 0, &battery);
    (void)can->send(can->context, 0, &posture);
}

static void take_commands(nao_in_process_t *self)
{
    const canopy_can_t *can = &self->robot_end.can;
    canopy_can_frame_t frame;

    self->power_mode = CANOPY_SIM_POWER_STOP;
    self->posture_mode = CANOPY_SIM_POSTURE_STOP;
    while (can->receive(can->context, &frame) == 1) {
        if (frame.id == NAO_POWER_COMMAND_ID) {
            self->power_mode = (canopy_sim_power_mode_t)frame.data[2];
        } else if (frame.id == NAO_POSTURE_COMMAND_ID) {
            self->posture_mode = (canopy_sim_posture_mode_t)frame.data[2];
        }
    }
}

canopy_status_t nao_in_process_tick(nao_in_process_t *self)
{
    canopy_status_t root;

    send_sensors(self);
    root = canopy_loop_cycle(&self->loop, self->now);
    self->now += self->config.app->period;
    take_commands(self);
    canopy_sim_nao_step(&self->robot, self->power_mode, self->posture_mode);
    return root;
}
