/* SPDX-License-Identifier: MIT */
/** @file The robot's side of nao.dbc, in one program with the controller. */
#include "in_process.h"

#include "nao_codec.h"

static void sense(void *context, canopy_in_process_t *host)
{
    nao_world_t *self = context;
    nao_battery_t battery = {.charging = self->robot.power.charging,
                             .level = (uint16_t)self->robot.power.battery,
                             .charger_distance = canopy_sim_power_distance_mm(&self->robot.power)};
    nao_posture_t posture = {.head_x = (int16_t)self->robot.posture.head_x_mm,
                             .head_height = (uint16_t)self->robot.posture.head_height_mm};
    uint8_t battery_data[NAO_BATTERY_LENGTH];
    uint8_t posture_data[NAO_POSTURE_LENGTH];

    if (!self->is_known) {
        self->battery = canopy_in_process_find(host, NAO_BATTERY_ID, false);
        self->posture = canopy_in_process_find(host, NAO_POSTURE_ID, false);
        self->is_known = true;
    }
    self->next_power = CANOPY_SIM_POWER_STOP;
    self->next_posture = CANOPY_SIM_POSTURE_STOP;
    (void)nao_battery_encode(&battery, battery_data, sizeof battery_data);
    canopy_in_process_put(host, self->battery, battery_data, self->age);
    (void)nao_posture_encode(&posture, posture_data, sizeof posture_data);
    canopy_in_process_put(host, self->posture, posture_data, self->age);
}

static void take(void *context, const canopy_can_frame_t *frame)
{
    nao_world_t *self = context;
    nao_power_command_t power;
    nao_posture_command_t posture;

    if (frame->id == NAO_POWER_COMMAND_ID &&
        nao_power_command_decode(&power, frame->data, frame->length) == CANOPY_CODEC_OK) {
        self->next_power = (canopy_sim_power_mode_t)power.mode;
    } else if (frame->id == NAO_POSTURE_COMMAND_ID &&
               nao_posture_command_decode(&posture, frame->data, frame->length) == CANOPY_CODEC_OK) {
        self->next_posture = (canopy_sim_posture_mode_t)posture.mode;
    }
}

static bool step(void *context)
{
    nao_world_t *self = context;

    self->power_mode = self->next_power;
    self->posture_mode = self->next_posture;
    canopy_sim_nao_step(&self->robot, self->power_mode, self->posture_mode);
    if (self->robot.power.battery < self->least_battery) {
        self->least_battery = self->robot.power.battery;
    }
    return true;
}

const canopy_world_t *nao_world_init(nao_world_t *self)
{
    *self = (nao_world_t){.world = {.context = self, .sense = sense, .take = take, .step = step}};
    canopy_sim_nao_init(&self->robot);
    self->least_battery = self->robot.power.battery;
    return &self->world;
}

canopy_error_t nao_in_process_init(nao_in_process_t *self, const canopy_app_t *app)
{
    return canopy_in_process_init(&self->host, app, self->sensors, NAO_IN_PROCESS_SENSORS, nao_world_init(&self->nao),
                                  true);
}

canopy_status_t nao_in_process_tick(nao_in_process_t *self)
{
    return canopy_in_process_tick(&self->host);
}
