/* SPDX-License-Identifier: MIT */
/** @file The fixed-period loop: its start, and one cycle. Cycles in a row, and their end, are in loop_run.c. */
#include "canopy/loop.h"

#include <stddef.h>

#include "trace_parts.h"
#include "tx_parts.h"

enum { LATENESS_FIRST_US = 16 };

static void report(const canopy_loop_t *self, canopy_fault_t fault, uint32_t detail)
{
    if (self->config->on_fault != NULL) {
        self->config->on_fault(self->config->context, fault, detail);
    }
}

static bool has_memory_for_trace(const canopy_app_t *app)
{
    return app->trace == NULL ||
           (app->trace_state != NULL && app->sent != NULL && app->nodes_max >= app->tree->node_count &&
            (app->told != NULL || app->trace->value_count == 0u));
}

static bool is_complete(const canopy_loop_config_t *config)
{
    const canopy_app_t *app = config->app;

    return app != NULL && config->can != NULL && config->clock != NULL && app->period > 0u && app->bus != NULL &&
           app->bus_state != NULL && app->input != NULL && app->output != NULL &&
           (app->rx != NULL || app->bus->rx_count == 0u) && app->tx != NULL && app->rx_max > 0u && app->frame_us > 0u;
}

static void start_bus(const canopy_app_t *app)
{
    *app->bus_state = (canopy_bus_state_t){.bus = app->bus, .input = app->input, .output = app->output, .rx = app->rx};
    for (uint16_t index = 0; index < app->bus->rx_count; index++) {
        app->rx[index] = (canopy_rx_state_t){0};
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
    if (error == CANOPY_OK && !has_memory_for_trace(app)) {
        error = CANOPY_ERROR_ARGUMENT;
    }
    if (error == CANOPY_OK) {
        error = canopy_tx_init(app->tx, app->bus->tx, app->bus->tx_count, &app->tx_memory, config->can);
    }
    if (error != CANOPY_OK) {
        return error;
    }
    start_bus(app);
    if (app->trace != NULL) {
        app->trace_state->sent = app->sent;
        app->trace_state->told = app->told;
        canopy_trace_start(app->trace, app->trace_state, app->nodes_max);
    }
    if (app->start != NULL) {
        app->start(app->memory);
    }
    *self = (canopy_loop_t){.config = config, .deadline = config->clock->now(config->clock->context)};
    return CANOPY_OK;
}

/** Takes what has arrived, at most rx_max frames. @return true: more may be waiting. */
static bool drain(canopy_loop_t *self, canopy_time_t now)
{
    const canopy_can_t *can = self->config->can;
    uint32_t most = self->config->rx_max != 0u ? self->config->rx_max : self->config->app->rx_max;
    canopy_can_frame_t frame;

    for (uint32_t taken = 0; taken < most; taken++) {
        int result = can->receive(can->context, &frame);

        if (result < 0) {
            canopy_count(&self->rx_errors);
            report(self, CANOPY_FAULT_CAN_RECEIVE, (uint32_t)-result);
        }
        if (result <= 0) {
            return false;
        }
        canopy_bus_receive(self->config->app->bus_state, &frame, now);
    }
    return true;
}

/** Has more come than is taken for more than one cycle? Accounts for it. */
static bool backlog_lasts(canopy_loop_t *self, bool backlog)
{
    bool lasts = backlog && self->backlog;

    if (backlog) {
        canopy_count(&self->rx_backlogs);
    }
    if (lasts) {
        report(self, CANOPY_FAULT_RX_BACKLOG, self->rx_backlogs);
    }
    self->backlog = backlog;
    return lasts;
}

/** Has the driver lost received frames since the last cycle? Accounts for them. */
static bool has_lost(canopy_loop_t *self)
{
    const canopy_can_t *can = self->config->can;
    canopy_can_stats_t stats;
    uint32_t lost;

    if (can->stats == NULL) {
        return false;
    }
    can->stats(can->context, &stats);
    lost = stats.rx_dropped - self->rx_lost;
    if (lost == 0u) {
        return false;
    }
    self->rx_lost = stats.rx_dropped;
    report(self, CANOPY_FAULT_RX_LOST, lost);
    return true;
}

/** Reports what a counter has grown by since the last cycle. */
static void account_for(const canopy_loop_t *self, canopy_fault_t fault, uint32_t counter, uint32_t *before)
{
    if (counter != *before) {
        report(self, fault, counter - *before);
        *before = counter;
    }
}

static void account_for_bus(canopy_loop_t *self, canopy_can_state_t before)
{
    const canopy_tx_t *tx = self->config->app->tx;

    if (self->can_manager.state != before) {
        report(self, CANOPY_FAULT_CAN_STATE, (uint32_t)self->can_manager.state);
    }
    account_for(self, CANOPY_FAULT_TX_EXPIRED, canopy_tx_expired(tx), &self->tx_expired);
    account_for(self, CANOPY_FAULT_TX_REPLACED, canopy_tx_replaced(tx), &self->tx_replaced);
}

static bool owes_any(const canopy_app_t *app)
{
    for (uint16_t message = 0; message < app->bus->tx_count; message++) {
        if (canopy_tx_owes(app->tx, message)) {
            return true;
        }
    }
    return false;
}

/**
 * What was decided for a bus that was not there must not be the first thing on it: safe values, until one of each message
 * is out. Not all in one cycle: a slow bus would never be done.
 */
static bool is_returning(const canopy_loop_t *self)
{
    const canopy_app_t *app = self->config->app;

    if (canopy_can_is_unusable(self->can_manager.state)) {
        canopy_tx_owe(app->tx);
        return true;
    }
    return self->returning && owes_any(app);
}

/** In a replay the bus is what it was. */
static void take_recorded_conditions(canopy_loop_t *self, canopy_cycle_t *cycle)
{
    const canopy_can_t *can = self->config->can;
    canopy_can_conditions_t conditions;

    if (can->conditions != NULL) {
        can->conditions(can->context, &conditions);
        cycle->overload = conditions.overload;
        cycle->can_state = (canopy_can_state_t)conditions.can_state;
        self->can_manager.state = cycle->can_state;
        self->returning = conditions.returning;
        if (self->returning) {
            canopy_tx_owe(self->config->app->tx); /* which ones still did, nobody has recorded */
        }
    }
}

/** What this tick works with: frames, time, and the state of the bus. */
static void read_inputs(canopy_loop_t *self, canopy_cycle_t *cycle)
{
    const canopy_app_t *app = self->config->app;
    const canopy_time_t now = cycle->now;
    canopy_can_state_t before = self->can_manager.state;
    bool lasts;
    bool lost;

    if (canopy_tx_is_busy(app->tx)) {
        canopy_tx_kick(app->tx, now); /* what is past its deadline must not leave while this tick is worked out */
    }
    lasts = backlog_lasts(self, drain(self, now));
    lost = has_lost(self);
    cycle->overload = lasts || lost;
    cycle->can_state =
        canopy_can_manager_step(&self->can_manager, self->config->can, canopy_tx_is_blocked(app->tx), now);
    self->returning = is_returning(self);
    take_recorded_conditions(self, cycle);
    account_for_bus(self, before);
}

/** Posts what the tree wants, or while the bus is returning the safe values that are not out yet. */
static void write_outputs(canopy_loop_t *self, canopy_time_t now)
{
    const canopy_app_t *app = self->config->app;

    if (self->returning) {
        app->bus->reset_output(app->output);
        canopy_bus_commit_owed(app->bus_state, app->tx, now + app->period);
    } else {
        canopy_bus_commit(app->bus_state, app->tx, self->ticks, now);
    }
}

static void send_trace(canopy_loop_t *self, const canopy_cycle_t *cycle, canopy_status_t root)
{
    const canopy_app_t *app = self->config->app;
    canopy_time_t until = cycle->now + (CANOPY_TRACE_PERIODS + app->trace_ticks) * app->period;

    canopy_tx_resume_trace(app->tx);
    canopy_trace_send(app->trace, app->trace_state, app->tree_instance, app->tx,
                      &(canopy_trace_tick_t){.tick = self->ticks,
                                             .root = root,
                                             .overruns = self->overruns,
                                             .cycle = cycle,
                                             .bus = app->bus_state,
                                             .returning = self->returning,
                                             .until = until});
    canopy_trace_health(self, until);
}

canopy_status_t canopy_loop_cycle(canopy_loop_t *self, canopy_time_t now)
{
    const canopy_app_t *app = self->config->app;
    uint32_t faults = app->tree_instance->faults;
    canopy_cycle_t cycle = {.now = now};
    canopy_status_t root;

    read_inputs(self, &cycle);
    canopy_bus_begin_tick(app->bus_state, &cycle);
    root = canopy_tree_tick(app->tree_instance, now);
    write_outputs(self, now);
    if (app->trace != NULL) {
        send_trace(self, &cycle, root);
    }
    canopy_tx_kick(app->tx, now);
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
