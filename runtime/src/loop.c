/* SPDX-License-Identifier: MIT */
/** @file The fixed-period loop. */
#include "canopy/loop.h"

#include <stddef.h>

enum { RX_MAX_DEFAULT = 64, LATENESS_FIRST_US = 16 };

static void report(const canopy_loop_t *self, canopy_fault_t fault, uint32_t detail)
{
    if (self->config->on_fault != NULL) {
        self->config->on_fault(self->config->context, fault, detail);
    }
}

static bool is_complete(const canopy_loop_config_t *config)
{
    const canopy_app_t *app = config->app;

    return app != NULL && config->can != NULL && config->clock != NULL && app->period > 0u && app->bus != NULL &&
           app->trace != NULL && app->bus_state != NULL && app->input != NULL && app->output != NULL &&
           (app->rx != NULL || app->bus->rx_count == 0u) && (app->tx_counters != NULL || app->bus->tx_count == 0u) &&
           app->trace_state != NULL && app->sent != NULL;
}

static void start_bus(const canopy_app_t *app)
{
    *app->bus_state = (canopy_bus_state_t){
        .bus = app->bus, .input = app->input, .output = app->output, .rx = app->rx, .tx_counters = app->tx_counters};
    for (uint16_t index = 0; index < app->bus->rx_count; index++) {
        app->rx[index] = (canopy_rx_state_t){0};
    }
    for (uint16_t index = 0; index < app->bus->tx_count; index++) {
        app->tx_counters[index] = 0;
    }
}

static void start_trace(const canopy_app_t *app)
{
    *app->trace_state = (canopy_trace_state_t){.sent = app->sent};
    for (uint16_t node = 0; node < app->tree->node_count; node++) {
        app->sent[node] = (uint8_t)CANOPY_IDLE;
    }
}

canopy_error_t canopy_loop_init(canopy_loop_t *self, const canopy_loop_config_t *config)
{
    const canopy_app_t *app;
    canopy_error_t error;

    if (self == NULL || config == NULL || !is_complete(config)) {
        return CANOPY_ERROR_ARGUMENT;
    }
    app = config->app;
    error = canopy_tree_init(app->tree_instance, app->tree, app->status, app->words, app->memory);
    if (error != CANOPY_OK) {
        return error;
    }
    start_bus(app);
    start_trace(app);
    if (app->start != NULL) {
        app->start(app->memory);
    }
    *self = (canopy_loop_t){.config = config, .deadline = config->clock->now(config->clock->context)};
    return CANOPY_OK;
}

/** Takes what has arrived, at most rx_max frames. */
static void drain(canopy_loop_t *self, canopy_time_t now)
{
    const canopy_can_t *can = self->config->can;
    uint16_t most = self->config->rx_max != 0u ? self->config->rx_max : (uint16_t)RX_MAX_DEFAULT;
    canopy_can_frame_t frame;

    for (uint16_t taken = 0; taken < most; taken++) {
        int result = can->receive(can->context, &frame);

        if (result < 0) {
            canopy_count(&self->rx_errors);
            report(self, CANOPY_FAULT_CAN_RECEIVE, (uint32_t)-result);
        }
        if (result <= 0) {
            return;
        }
        canopy_bus_receive(self->config->app->bus_state, &frame, now);
    }
    canopy_count(&self->rx_backlogs);
}

canopy_status_t canopy_loop_cycle(canopy_loop_t *self, canopy_time_t now)
{
    const canopy_app_t *app = self->config->app;
    uint32_t faults = app->tree_instance->faults;
    canopy_status_t root;

    drain(self, now);
    canopy_bus_begin_tick(app->bus_state, now);
    root = canopy_tree_tick(app->tree_instance, now);
    canopy_bus_commit(app->bus_state, self->config->can, self->ticks);
    canopy_trace_send(app->trace, app->trace_state, app->tree_instance, self->config->can,
                      &(canopy_trace_tick_t){.tick = self->ticks,
                                             .root = root,
                                             .overruns = self->overruns,
                                             .now = now,
                                             .taken = app->bus_state->taken,
                                             .check = app->bus_state->check},
                      &app->bus_state->counters);
    self->ticks++;
    if (app->tree_instance->faults != faults) {
        report(self, CANOPY_FAULT_LEAF_STATUS, app->tree_instance->fault_node);
    }
    return root;
}

static void account_for_start(canopy_loop_t *self, canopy_time_t started)
{
    canopy_time_t late = started - self->deadline;
    canopy_time_t limit = LATENESS_FIRST_US;
    unsigned bucket = 0;

    while (bucket + 1u < CANOPY_LATENESS_BUCKETS && late >= limit) {
        bucket++;
        limit *= 2u;
    }
    canopy_count(&self->lateness[bucket]);
    if (late > self->most_late) {
        self->most_late = late;
    }
}

/** Sets the next deadline; after an overrun, the next one that is not past. @return true when the cycle was in time. O(1). */
static bool account_for_end(canopy_loop_t *self, canopy_time_t started, canopy_time_t finished)
{
    canopy_time_t period = self->config->app->period;
    canopy_time_t length = finished - started;
    canopy_time_t missed;

    if (length > self->longest_cycle) {
        self->longest_cycle = length;
    }
    self->deadline += period;
    if (!canopy_time_reached(finished, self->deadline) || finished == self->deadline) {
        return true;
    }
    canopy_count(&self->overruns);
    report(self, CANOPY_FAULT_OVERRUN, length < UINT32_MAX ? (uint32_t)length : UINT32_MAX);
    /* Those that are past; one that is due just now is not. A division: a sleep of hours must not be gone through in
     * periods. */
    missed = (finished - self->deadline - 1u) / period + 1u;
    self->slips = canopy_sum(self->slips, missed < UINT32_MAX ? (uint32_t)missed : UINT32_MAX);
    self->deadline += missed * period;
    return false;
}

void canopy_loop_stop(canopy_loop_t *self, canopy_time_t now)
{
    const canopy_app_t *app = self->config->app;

    canopy_bus_begin_tick(app->bus_state, now);
    canopy_tree_halt(app->tree_instance);
    canopy_bus_commit(app->bus_state, self->config->can, 0);
}

bool canopy_loop_step(canopy_loop_t *self)
{
    const canopy_loop_config_t *config = self->config;
    const canopy_clock_t *clock = config->clock;
    canopy_time_t started = clock->now(clock->context);
    canopy_status_t root;

    account_for_start(self, started);
    root = canopy_loop_cycle(self, started);
    if (account_for_end(self, started, clock->now(clock->context)) && config->kick_watchdog != NULL) {
        config->kick_watchdog(config->context);
    }
    return config->after_cycle == NULL || config->after_cycle(config->context, root);
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

void canopy_loop_run_all(canopy_loop_t *const *loops, uint16_t count)
{
    const canopy_clock_t *clock = loops[0]->config->clock;
    canopy_loop_t *next;

    do {
        next = next_of(loops, count);
    } while (clock->wait_until(clock->context, next->deadline) && canopy_loop_step(next));
    for (uint16_t index = 0; index < count; index++) {
        canopy_loop_stop(loops[index], clock->now(clock->context));
    }
}

void canopy_loop_run(canopy_loop_t *self)
{
    canopy_loop_run_all(&self, 1);
}
