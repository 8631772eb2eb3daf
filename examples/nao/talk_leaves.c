/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Leaves of the Big BT that speak and wave: orders to a part of the robot that takes its time, and tells when it is done.
 *
 * An order has a number, the one after the robot's last, and holds while it is sent. So a robot that still shows the end of
 * an earlier order of the same kind is not taken for done.
 */
#include "big_parts.h"

static canopy_status_t order_words(nao_big_output_t *out, const big_order_t *self, nao_big_upper_command_say_t words)
{
    nao_big_set_upper_command_say(out, words);
    nao_big_set_upper_command_say_number(out, self->number);
    return CANOPY_RUNNING;
}

static canopy_status_t begin_words(const nao_big_input_t *in, nao_big_output_t *out, big_order_t *self,
                                   nao_big_upper_command_say_t words)
{
    self->number = (uint8_t)(in->acts.say_number + 1u);
    return order_words(out, self, words);
}

/* S = {the robot has said it}. */
static canopy_status_t go_on_with_words(const nao_big_input_t *in, nao_big_output_t *out, const big_order_t *self,
                                        nao_big_upper_command_say_t words)
{
    if (in->acts.speech_state == NAO_BIG_ACTS_SPEECH_STATE_DONE && in->acts.say_number == self->number &&
        (unsigned)in->acts.said == (unsigned)words) {
        return CANOPY_SUCCESS;
    }
    return order_words(out, self, words);
}

static void stop_words(nao_big_output_t *out)
{
    nao_big_set_upper_command_say(out, NAO_BIG_UPPER_COMMAND_SAY_NOTHING);
}

#define SAYS(leaf, words)                                                                                  \
    canopy_status_t leaf##_on_start(const nao_big_input_t *in, nao_big_output_t *out, big_order_t *self)   \
    {                                                                                                      \
        return begin_words(in, out, self, words);                                                          \
    }                                                                                                      \
    canopy_status_t leaf##_on_running(const nao_big_input_t *in, nao_big_output_t *out, big_order_t *self) \
    {                                                                                                      \
        return go_on_with_words(in, out, self, words);                                                     \
    }                                                                                                      \
    void leaf##_on_halted(const nao_big_input_t *in, nao_big_output_t *out, big_order_t *self)             \
    {                                                                                                      \
        (void)in;                                                                                          \
        (void)self;                                                                                        \
        stop_words(out);                                                                                   \
    }

SAYS(say_ouch, NAO_BIG_UPPER_COMMAND_SAY_OUCH)
SAYS(ask_what_to_do, NAO_BIG_UPPER_COMMAND_SAY_WHAT_TO_DO)
SAYS(say_goodbye, NAO_BIG_UPPER_COMMAND_SAY_GOODBYE)

/* --- Arms ------------------------------------------------------------------------------------------------------------ */

static canopy_status_t order_arms(nao_big_output_t *out, const big_order_t *self, nao_big_upper_command_arms_t arms)
{
    nao_big_set_upper_command_arms(out, arms);
    nao_big_set_upper_command_arms_number(out, self->number);
    return CANOPY_RUNNING;
}

canopy_status_t big_begin_arms(const nao_big_input_t *in, nao_big_output_t *out, big_order_t *self,
                               nao_big_upper_command_arms_t arms)
{
    self->number = (uint8_t)(in->acts.arms_number + 1u);
    return order_arms(out, self, arms);
}

canopy_status_t big_go_on_with_arms(const nao_big_input_t *in, nao_big_output_t *out, const big_order_t *self,
                                    nao_big_upper_command_arms_t arms)
{
    if (in->acts.arms_state == NAO_BIG_ACTS_ARMS_STATE_DONE && in->acts.arms_number == self->number &&
        (unsigned)in->acts.arms == (unsigned)arms) {
        return CANOPY_SUCCESS;
    }
    return order_arms(out, self, arms);
}

/* Wave: S = {the robot has waved}. */
canopy_status_t wave_on_start(const nao_big_input_t *in, nao_big_output_t *out, big_order_t *self)
{
    return big_begin_arms(in, out, self, NAO_BIG_UPPER_COMMAND_ARMS_WAVE);
}

canopy_status_t wave_on_running(const nao_big_input_t *in, nao_big_output_t *out, big_order_t *self)
{
    return big_go_on_with_arms(in, out, self, NAO_BIG_UPPER_COMMAND_ARMS_WAVE);
}

void wave_on_halted(const nao_big_input_t *in, nao_big_output_t *out, big_order_t *self)
{
    (void)in;
    (void)self;
    nao_big_set_upper_command_arms(out, NAO_BIG_UPPER_COMMAND_ARMS_STOP);
}
