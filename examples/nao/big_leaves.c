/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Leaves of the Big BT (Colledanchise & Oegren, Fig. 34): battery, toes, wishes, postures. Those of the ball game are in
 * ball_leaves.c. Each reads like a definition: where it succeeds, where it fails, what it commands meanwhile.
 *
 * What Examples 4 and 5 define is as there (power_leaves.c, home_leaves.c): x1 is the distance to the charger, x2 the charge;
 * the head's height tells the posture.
 */
#include "big_parts.h"

#define AT_CHARGER NAO_BIG_BATTERY_CHARGER_DISTANCE(0.1)
#define FULL NAO_BIG_BATTERY_LEVEL(100.0)
#define LOW NAO_BIG_BATTERY_LEVEL(20.0)
#define BACK_OFF NAO_BIG_TOUCH_ODOMETER(0.2)
#define SITTING NAO_BIG_POSTURE_HEAD_HEIGHT(0.30)
#define LYING NAO_BIG_POSTURE_HEAD_HEIGHT(0.05)

/* Most leaves have no memory: their first tick is like any other, and what a halt must end is the command's safe value. */
#define LIKE_ANY_OTHER(leaf)                                                            \
    canopy_status_t leaf##_on_start(const nao_big_input_t *in, nao_big_output_t *out)   \
    {                                                                                   \
        return leaf(in, out);                                                           \
    }                                                                                   \
    canopy_status_t leaf##_on_running(const nao_big_input_t *in, nao_big_output_t *out) \
    {                                                                                   \
        return leaf(in, out);                                                           \
    }                                                                                   \
    void leaf##_on_halted(const nao_big_input_t *in, nao_big_output_t *out)             \
    {                                                                                   \
        (void)in;                                                                       \
        nao_big_set_posture_command_mode(out, NAO_BIG_POSTURE_COMMAND_MODE_STOP);       \
    }

/* --- Battery (Example 4) --------------------------------------------------------------------------------------------- */

/*
 * Guarantee Power Supply: S1 = {x2 >= 100, or x1 >= 0.1 and x2 > 20}; else it drives to the charger, or charges there. With
 * needs_standing: F1 = {it must drive, and does not stand}; the paper's robot drives in any posture.
 */
static canopy_status_t guarantee_power_supply(const nao_big_input_t *in, nao_big_output_t *out,
                                              const guarantee_power_supply_ports_t *ports)
{
    bool at_charger = in->battery.charger_distance < AT_CHARGER;

    if (in->battery.level >= FULL || (!at_charger && in->battery.level > LOW)) {
        return CANOPY_SUCCESS;
    }
    if (ports->needs_standing && !at_charger && in->posture.head_height < BIG_STANDING) {
        return CANOPY_FAILURE;
    }
    nao_big_set_power_command_mode(out, at_charger ? NAO_BIG_POWER_COMMAND_MODE_CHARGE
                                                   : NAO_BIG_POWER_COMMAND_MODE_DRIVE_TO_CHARGER);
    return CANOPY_RUNNING;
}

canopy_status_t guarantee_power_supply_on_start(const nao_big_input_t *in, nao_big_output_t *out,
                                                const guarantee_power_supply_ports_t *ports)
{
    return guarantee_power_supply(in, out, ports);
}

canopy_status_t guarantee_power_supply_on_running(const nao_big_input_t *in, nao_big_output_t *out,
                                                  const guarantee_power_supply_ports_t *ports)
{
    return guarantee_power_supply(in, out, ports);
}

void guarantee_power_supply_on_halted(const nao_big_input_t *in, nao_big_output_t *out,
                                      const guarantee_power_supply_ports_t *ports)
{
    (void)in;
    (void)ports;
    nao_big_set_power_command_mode(out, NAO_BIG_POWER_COMMAND_MODE_STOP);
}

canopy_status_t battery_above_tick(const nao_big_input_t *in, const battery_above_ports_t *ports)
{
    return in->battery.level > ports->percent ? CANOPY_SUCCESS : CANOPY_FAILURE; /* both in 0.1 % */
}

/* --- Toes ------------------------------------------------------------------------------------------------------------ */

canopy_status_t toe_bumpers_pressed_tick(const nao_big_input_t *in)
{
    bool is_pressed =
        in->touch.toe_left_outer || in->touch.toe_left_inner || in->touch.toe_right_inner || in->touch.toe_right_outer;

    return is_pressed ? CANOPY_SUCCESS : CANOPY_FAILURE;
}

/* Back off 0.2m: S = {walked 0.2 m since it began}, F = {does not stand}. */
static canopy_status_t back_off(const nao_big_input_t *in, nao_big_output_t *out, const big_walk_t *self)
{
    uint16_t walked = (uint16_t)(in->touch.odometer - self->start);

    if (walked >= (uint16_t)BACK_OFF) {
        return CANOPY_SUCCESS;
    }
    if (in->posture.head_height < BIG_STANDING) {
        return CANOPY_FAILURE;
    }
    nao_big_set_posture_command_mode(out, NAO_BIG_POSTURE_COMMAND_MODE_BACK_OFF);
    return CANOPY_RUNNING;
}

canopy_status_t back_off_on_start(const nao_big_input_t *in, nao_big_output_t *out, big_walk_t *self)
{
    self->start = in->touch.odometer;
    return back_off(in, out, self);
}

canopy_status_t back_off_on_running(const nao_big_input_t *in, nao_big_output_t *out, big_walk_t *self)
{
    return back_off(in, out, self);
}

void back_off_on_halted(const nao_big_input_t *in, nao_big_output_t *out, big_walk_t *self)
{
    (void)in;
    (void)self;
    nao_big_set_posture_command_mode(out, NAO_BIG_POSTURE_COMMAND_MODE_STOP);
}

/* --- Wishes ---------------------------------------------------------------------------------------------------------- */

canopy_status_t new_user_suggestion_tick(const nao_big_input_t *in, const new_user_suggestion_ports_t *ports)
{
    return in->voice.count != ports->handled ? CANOPY_SUCCESS : CANOPY_FAILURE;
}

canopy_status_t set_current_activity_tick(const nao_big_input_t *in, const set_current_activity_ports_t *ports)
{
    set_current_activity_set_activity(ports, (uint8_t)in->voice.suggestion);
    set_current_activity_set_handled(ports, in->voice.count);
    return CANOPY_SUCCESS;
}

static canopy_status_t is_activity(uint8_t activity, nao_big_voice_suggestion_t wanted)
{
    return activity == (uint8_t)wanted ? CANOPY_SUCCESS : CANOPY_FAILURE;
}

canopy_status_t know_what_to_do_tick(const nao_big_input_t *in, const know_what_to_do_ports_t *ports)
{
    (void)in;
    return ports->activity != (uint8_t)NAO_BIG_VOICE_SUGGESTION_NOTHING ? CANOPY_SUCCESS : CANOPY_FAILURE;
}

canopy_status_t activity_is_sit_tick(const nao_big_input_t *in, const activity_is_sit_ports_t *ports)
{
    (void)in;
    return is_activity(ports->activity, NAO_BIG_VOICE_SUGGESTION_SIT);
}

canopy_status_t activity_is_stand_up_tick(const nao_big_input_t *in, const activity_is_stand_up_ports_t *ports)
{
    (void)in;
    return is_activity(ports->activity, NAO_BIG_VOICE_SUGGESTION_STAND_UP);
}

canopy_status_t activity_is_sleep_tick(const nao_big_input_t *in, const activity_is_sleep_ports_t *ports)
{
    (void)in;
    return is_activity(ports->activity, NAO_BIG_VOICE_SUGGESTION_SLEEP);
}

canopy_status_t activity_is_say_goodbye_tick(const nao_big_input_t *in, const activity_is_say_goodbye_ports_t *ports)
{
    (void)in;
    return is_activity(ports->activity, NAO_BIG_VOICE_SUGGESTION_SAY_GOODBYE);
}

canopy_status_t activity_is_ball_game_tick(const nao_big_input_t *in, const activity_is_ball_game_ports_t *ports)
{
    (void)in;
    return is_activity(ports->activity, NAO_BIG_VOICE_SUGGESTION_BALL_GAME);
}

/* --- Postures (Example 5, and the way back) -------------------------------------------------------------------------- */

canopy_status_t is_standing_tick(const nao_big_input_t *in)
{
    return in->posture.head_height >= BIG_STANDING ? CANOPY_SUCCESS : CANOPY_FAILURE;
}

/* Sit to Stand: S = {x2 >= 0.48}, F = {x2 < 0.3}. */
static canopy_status_t sit_to_stand(const nao_big_input_t *in, nao_big_output_t *out)
{
    if (in->posture.head_height >= BIG_STANDING) {
        return CANOPY_SUCCESS;
    }
    if (in->posture.head_height < SITTING) {
        return CANOPY_FAILURE;
    }
    nao_big_set_posture_command_mode(out, NAO_BIG_POSTURE_COMMAND_MODE_STAND_UP);
    return CANOPY_RUNNING;
}
LIKE_ANY_OTHER(sit_to_stand)

/* Lie down to Sit up: S = {x2 >= 0.3}; it never fails. */
static canopy_status_t lie_down_to_sit_up(const nao_big_input_t *in, nao_big_output_t *out)
{
    if (in->posture.head_height >= SITTING) {
        return CANOPY_SUCCESS;
    }
    nao_big_set_posture_command_mode(out, NAO_BIG_POSTURE_COMMAND_MODE_SIT_UP);
    return CANOPY_RUNNING;
}
LIKE_ANY_OTHER(lie_down_to_sit_up)

/* Stand to Sit: S = {0.3 <= x2 < 0.48}, F = {x2 < 0.3}. */
static canopy_status_t stand_to_sit(const nao_big_input_t *in, nao_big_output_t *out)
{
    if (in->posture.head_height < SITTING) {
        return CANOPY_FAILURE;
    }
    if (in->posture.head_height < BIG_STANDING) {
        return CANOPY_SUCCESS;
    }
    nao_big_set_posture_command_mode(out, NAO_BIG_POSTURE_COMMAND_MODE_SIT_DOWN);
    return CANOPY_RUNNING;
}
LIKE_ANY_OTHER(stand_to_sit)

/* Sit to Lie Down: S = {x2 <= 0.05}, F = {x2 >= 0.48}. */
static canopy_status_t sit_to_lie_down(const nao_big_input_t *in, nao_big_output_t *out)
{
    if (in->posture.head_height <= LYING) {
        return CANOPY_SUCCESS;
    }
    if (in->posture.head_height >= BIG_STANDING) {
        return CANOPY_FAILURE;
    }
    nao_big_set_posture_command_mode(out, NAO_BIG_POSTURE_COMMAND_MODE_LIE_DOWN);
    return CANOPY_RUNNING;
}
LIKE_ANY_OTHER(sit_to_lie_down)
