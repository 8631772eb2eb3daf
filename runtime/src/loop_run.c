/* SPDX-License-Identifier: MIT */
/** @file The fixed-period loop: cycles in a row, what is sent between them, and the end. One cycle is in loop.c. */
#include <stddef.h>

#include "canopy/loop.h"

enum { STOP_WAIT_US = 1000, STOP_POLLS_MAX = 100000 };

/**
 * Serves the transmit side until everything is out, the trace behind the commands too, or the time is over. What is left of
 * the trace then is dropped.
 * @return true: every command is out.
 */
static bool flush(canopy_loop_t *self, canopy_time_t until)
{
    const canopy_loop_config_t *config = self->config;
    const canopy_can_t *can = config->can;
    canopy_tx_t *tx = config->app->tx;
    canopy_time_t last = config->clock->now(config->clock->context);
    canopy_time_t now = last;
    uint32_t standing = 0; /* polls in a row at which the clock did not move: some only move between cycles */

    canopy_tx_kick(tx, now);
    while ((!canopy_tx_is_out(tx) || canopy_tx_is_busy(tx)) && !canopy_time_reached(now, until) &&
           standing < (uint32_t)STOP_POLLS_MAX) {
        if (can->wait != NULL) {
            (void)can->wait(can->context, STOP_WAIT_US);
        }
        now = config->clock->now(config->clock->context);
        standing = now == last ? standing + 1u : 0u;
        last = now;
        canopy_tx_kick(tx, now);
    }
    canopy_tx_stop_trace(tx);
    canopy_tx_kick(tx, now);
    return canopy_tx_is_out(tx);
}

canopy_error_t canopy_loop_stop(canopy_loop_t *self, canopy_time_t now)
{
    const canopy_app_t *app = self->config->app;
    canopy_time_t stop_us = self->config->stop_us != 0u ? self->config->stop_us : CANOPY_LOOP_STOP_US;
    canopy_cycle_t cycle = {.now = now, .can_state = self->can_manager.state};

    canopy_bus_begin_tick(app->bus_state, &cycle);
    canopy_tree_halt(app->tree_instance);
    canopy_bus_commit_all(app->bus_state, app->tx, now + stop_us);
    return flush(self, now + stop_us) ? CANOPY_OK : CANOPY_ERROR_BUS_DOWN;
}

static canopy_loop_t *next_of(canopy_loop_t *const *loops, uint16_t count)
{
    canopy_loop_t *next = loops[0];

    for (uint16_t index = 1; index < count; index++) {
        if (!canopy_time_reached(loops[index]->deadline, next->deadline)) {
            next = loops[index];
        }
    }
    return next;
}

/** Has it frames that wait for the bus, and no interrupt that sends them? */
static bool must_be_served(const canopy_loop_t *loop)
{
    return loop->config->can->request == NULL && canopy_tx_is_busy(loop->config->app->tx);
}

/** How long to wait before those are served that must be: the shortest frame; 0: none must be. */
static canopy_time_t pause_of(canopy_loop_t *const *loops, uint16_t count)
{
    canopy_time_t pause = 0;

    for (uint16_t index = 0; index < count; index++) {
        canopy_time_t frame_us = loops[index]->config->app->frame_us;

        if (must_be_served(loops[index]) && (pause == 0u || frame_us < pause)) {
            pause = frame_us;
        }
    }
    return pause;
}

static void serve(canopy_loop_t *const *loops, uint16_t count, canopy_time_t now)
{
    for (uint16_t index = 0; index < count; index++) {
        if (must_be_served(loops[index])) {
            canopy_tx_service(loops[index]->config->app->tx, now);
        }
    }
}

/** Waits for a deadline, and sends meanwhile. @return as the clock's wait_until(). */
static bool wait_until(canopy_loop_t *const *loops, uint16_t count, canopy_time_t deadline)
{
    const canopy_clock_t *clock = loops[0]->config->clock;
    canopy_time_t pause;

    while ((pause = pause_of(loops, count)) != 0u) {
        canopy_time_t next = clock->now(clock->context) + pause;

        if (canopy_time_reached(next, deadline)) {
            break;
        }
        if (!clock->wait_until(clock->context, next)) {
            return false;
        }
        serve(loops, count, clock->now(clock->context));
    }
    return clock->wait_until(clock->context, deadline);
}

canopy_error_t canopy_loop_run_all(canopy_loop_t *const *loops, uint16_t count)
{
    const canopy_clock_t *clock = loops[0]->config->clock;
    canopy_error_t result = CANOPY_OK;
    canopy_loop_t *next;

    do {
        next = next_of(loops, count);
    } while (wait_until(loops, count, next->deadline) && canopy_loop_step(next));
    for (uint16_t index = 0; index < count; index++) {
        canopy_error_t error = canopy_loop_stop(loops[index], clock->now(clock->context));

        result = result != CANOPY_OK ? result : error;
    }
    return result;
}

canopy_error_t canopy_loop_run(canopy_loop_t *self)
{
    return canopy_loop_run_all(&self, 1);
}
