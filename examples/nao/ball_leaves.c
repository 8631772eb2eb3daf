/* SPDX-License-Identifier: MIT */
/** @file Leaves of the Big BT's ball game: look for the ball, go there, take it, throw it. */
#include "big_parts.h"

#define CLOSE NAO_BIG_BALL_DISTANCE(0.2)

/** In the hand, or just out of it: the ball is with the robot. So throwing can end with success (Lemma 2: it keeps S of
 * what comes before it). */
static bool has_ball(const nao_big_input_t *in)
{
    return in->ball.hand != NAO_BIG_BALL_HAND_EMPTY;
}

static bool is_close(const nao_big_input_t *in)
{
    return has_ball(in) || (in->ball.tracked && in->ball.distance <= CLOSE);
}

static bool stands(const nao_big_input_t *in)
{
    return in->posture.head_height >= BIG_STANDING;
}

/* Ball Tracker: always RUNNING. */
static canopy_status_t ball_tracker(nao_big_output_t *out)
{
    nao_big_set_upper_command_track_ball(out, true);
    return CANOPY_RUNNING;
}

canopy_status_t ball_tracker_on_start(const nao_big_input_t *in, nao_big_output_t *out)
{
    (void)in;
    return ball_tracker(out);
}

canopy_status_t ball_tracker_on_running(const nao_big_input_t *in, nao_big_output_t *out)
{
    (void)in;
    return ball_tracker(out);
}

void ball_tracker_on_halted(const nao_big_input_t *in, nao_big_output_t *out)
{
    (void)in;
    nao_big_set_upper_command_track_ball(out, false);
}

canopy_status_t ball_close_tick(const nao_big_input_t *in)
{
    return is_close(in) ? CANOPY_SUCCESS : CANOPY_FAILURE;
}

canopy_status_t ball_grasped_tick(const nao_big_input_t *in)
{
    return has_ball(in) ? CANOPY_SUCCESS : CANOPY_FAILURE;
}

/* Approach Ball: S = {it is close}, F = {the robot does not stand}; without the ball in sight it waits for the tracker. */
static canopy_status_t approach_ball(const nao_big_input_t *in, nao_big_output_t *out)
{
    if (is_close(in)) {
        return CANOPY_SUCCESS;
    }
    if (!stands(in)) {
        return CANOPY_FAILURE;
    }
    if (in->ball.tracked) {
        nao_big_set_posture_command_mode(out, NAO_BIG_POSTURE_COMMAND_MODE_APPROACH_BALL);
    }
    return CANOPY_RUNNING;
}

canopy_status_t approach_ball_on_start(const nao_big_input_t *in, nao_big_output_t *out)
{
    return approach_ball(in, out);
}

canopy_status_t approach_ball_on_running(const nao_big_input_t *in, nao_big_output_t *out)
{
    return approach_ball(in, out);
}

void approach_ball_on_halted(const nao_big_input_t *in, nao_big_output_t *out)
{
    (void)in;
    nao_big_set_posture_command_mode(out, NAO_BIG_POSTURE_COMMAND_MODE_STOP);
}

/* Grasp Ball: S = {the hand has it}, F = {it is not close, or the robot does not stand}; the robot tries until it has it. */
static canopy_status_t may_grasp(const nao_big_input_t *in)
{
    if (has_ball(in)) {
        return CANOPY_SUCCESS;
    }
    return is_close(in) && stands(in) ? CANOPY_RUNNING : CANOPY_FAILURE;
}

canopy_status_t grasp_ball_on_start(const nao_big_input_t *in, nao_big_output_t *out, big_order_t *self)
{
    canopy_status_t status = may_grasp(in);

    return status == CANOPY_RUNNING ? big_begin_arms(in, out, self, NAO_BIG_UPPER_COMMAND_ARMS_GRASP) : status;
}

canopy_status_t grasp_ball_on_running(const nao_big_input_t *in, nao_big_output_t *out, big_order_t *self)
{
    canopy_status_t status = may_grasp(in);

    if (status == CANOPY_RUNNING) {
        (void)big_go_on_with_arms(in, out, self, NAO_BIG_UPPER_COMMAND_ARMS_GRASP);
    }
    return status;
}

void grasp_ball_on_halted(const nao_big_input_t *in, nao_big_output_t *out, big_order_t *self)
{
    (void)in;
    (void)self;
    nao_big_set_upper_command_arms(out, NAO_BIG_UPPER_COMMAND_ARMS_STOP);
}

/* Throw Ball: S = {the ball is in the air}, F = {the hand is empty, or the robot does not stand}. */
static canopy_status_t may_throw(const nao_big_input_t *in)
{
    if (in->ball.hand == NAO_BIG_BALL_HAND_THREW) {
        return CANOPY_SUCCESS;
    }
    return has_ball(in) && stands(in) ? CANOPY_RUNNING : CANOPY_FAILURE;
}

canopy_status_t throw_ball_on_start(const nao_big_input_t *in, nao_big_output_t *out, big_order_t *self)
{
    canopy_status_t status = may_throw(in);

    return status == CANOPY_RUNNING ? big_begin_arms(in, out, self, NAO_BIG_UPPER_COMMAND_ARMS_THROW) : status;
}

canopy_status_t throw_ball_on_running(const nao_big_input_t *in, nao_big_output_t *out, big_order_t *self)
{
    canopy_status_t status = may_throw(in);

    if (status == CANOPY_RUNNING) {
        (void)big_go_on_with_arms(in, out, self, NAO_BIG_UPPER_COMMAND_ARMS_THROW);
    }
    return status;
}

void throw_ball_on_halted(const nao_big_input_t *in, nao_big_output_t *out, big_order_t *self)
{
    (void)in;
    (void)self;
    nao_big_set_upper_command_arms(out, NAO_BIG_UPPER_COMMAND_ARMS_STOP);
}
