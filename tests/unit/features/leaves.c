/* SPDX-License-Identifier: MIT */
/** @file Leaves of the application "features". */
#include "features_leaves.h"

enum { COOLED_AFTER = 3, HALTED_SPEED = 50 };

canopy_status_t is_warm_tick(const features_input_t *in, const is_warm_ports_t *ports)
{
    /* Raw to degrees: 0.5 a bit, offset 10. */
    return (in->climate.temperature / 2) + 10 > ports->limit ? CANOPY_SUCCESS : CANOPY_FAILURE;
}

canopy_status_t note_tick_tick(const features_input_t *in, features_output_t *out)
{
    features_set_fan_ticks(out, (int32_t)(in->now / 10000u));
    return CANOPY_SUCCESS;
}

static canopy_status_t cool(features_output_t *out, const cool_down_ports_t *ports, cool_down_state_t *self)
{
    self->ticks++;
    features_set_fan_speed(out, (int32_t)(ports->fan * 100u));
    features_set_fan_turbo(out, ports->quick);
    features_set_fan_mode(out, FEATURES_FAN_MODE_LOW_NOISE);
    return self->ticks < COOLED_AFTER ? CANOPY_RUNNING : CANOPY_SUCCESS;
}

canopy_status_t cool_down_on_start(const features_input_t *in, features_output_t *out, const cool_down_ports_t *ports,
                                   cool_down_state_t *self)
{
    (void)in;
    self->starts++;
    self->ticks = 0;
    return cool(out, ports, self);
}

canopy_status_t cool_down_on_running(const features_input_t *in, features_output_t *out, const cool_down_ports_t *ports,
                                     cool_down_state_t *self)
{
    (void)in;
    return cool(out, ports, self);
}

void cool_down_on_halted(const features_input_t *in, features_output_t *out, const cool_down_ports_t *ports,
                         cool_down_state_t *self)
{
    (void)in;
    (void)ports;
    self->halts++;
    features_set_fan_speed(out, HALTED_SPEED);
}
