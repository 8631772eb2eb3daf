/* SPDX-License-Identifier: MIT */
/** @file CanopyHealth: the accounts of the loop, its bus and its transmit side, a page at a time. */
#include "trace_parts.h"

enum { PAGES = 5, FILTERED = 0x10, LATEST_UNIT_US = 10 };
enum { RECEIVE, TRANSMIT, TIMING, LATENESS, FAULTS };

#define MOST24 UINT32_C(0xFFFFFF)

static void put_count16(uint8_t *data, uint64_t count)
{
    canopy_trace_put16(data, count < UINT16_MAX ? (uint32_t)count : UINT16_MAX);
}

static uint8_t count8(uint32_t count)
{
    return count < UINT8_MAX ? (uint8_t)count : UINT8_MAX;
}

/** 0: none; n: fewer than 4^n, at least 4^(n - 1). 4^15 is beyond 2^29: 15 stands for the rest as well. */
static unsigned magnitude(uint32_t count)
{
    unsigned result = 0;

    while (count > 0u && result < 15u) {
        count >>= 2;
        result++;
    }
    return result;
}

static void put_receive(const canopy_loop_t *loop, uint8_t *data)
{
    const canopy_bus_counters_t *counters = &loop->config->app->bus_state->counters;

    if (loop->config->can->is_filtered) {
        data[0] |= (uint8_t)FILTERED;
    }
    put_count16(&data[1], canopy_bus_rejected(counters));
    put_count16(&data[3], counters->unknown_id);
    put_count16(&data[5], loop->rx_lost);
    data[7] = count8(loop->rx_backlogs);
}

static void put_transmit(const canopy_loop_t *loop, uint8_t *data)
{
    canopy_tx_counters_t counters;

    canopy_tx_count(loop->config->app->tx, &counters);
    put_count16(&data[1], counters.replaced);
    put_count16(&data[3], counters.expired);
    put_count16(&data[5], counters.trace_dropped);
    data[7] = count8(loop->can_manager.restarts);
}

static void put_timing(const canopy_loop_t *loop, uint8_t *data)
{
    uint32_t longest = loop->longest_cycle < MOST24 ? (uint32_t)loop->longest_cycle : MOST24;

    put_count16(&data[1], loop->overruns);
    canopy_trace_put16(&data[3], longest);
    data[5] = (uint8_t)(longest >> 16);
    put_count16(&data[6], (loop->most_late + (canopy_time_t)(LATEST_UNIT_US - 1)) / (canopy_time_t)LATEST_UNIT_US);
}

static void put_lateness(const canopy_loop_t *loop, uint8_t *data)
{
    for (unsigned bucket = 0; bucket < CANOPY_LATENESS_BUCKETS; bucket += 2u) {
        data[1u + bucket / 2u] =
            (uint8_t)(magnitude(loop->lateness[bucket]) | (magnitude(loop->lateness[bucket + 1u]) << 4));
    }
    data[7] = count8(loop->slips);
}

static void put_faults(const canopy_loop_t *loop, uint8_t *data)
{
    put_count16(&data[1], loop->config->app->tree_instance->faults);
    put_count16(&data[3], loop->rx_errors);
    put_count16(&data[5], loop->config->app->bus_state->counters.timeouts);
}

void canopy_trace_health(const canopy_loop_t *loop, canopy_time_t until)
{
    static void (*const pages[PAGES])(const canopy_loop_t *loop, uint8_t *data) = {[RECEIVE] = put_receive,
                                                                                   [TRANSMIT] = put_transmit,
                                                                                   [TIMING] = put_timing,
                                                                                   [LATENESS] = put_lateness,
                                                                                   [FAULTS] = put_faults};
    const canopy_app_t *app = loop->config->app;
    canopy_trace_state_t *state = app->trace_state;
    canopy_tx_trace_data_t data = {{0}};

    if (!canopy_trace_is_due(&state->health_in, app->trace->health_every)) {
        return;
    }
    data.byte[0] = state->health_page;
    pages[state->health_page](loop, data.byte);
    state->health_page = state->health_page + 1u < (unsigned)PAGES ? (uint8_t)(state->health_page + 1u) : 0u;
    canopy_tx_trace(app->tx, app->trace->id + (uint32_t)CANOPY_TRACE_HEALTH, app->trace->flags, &data, until);
}
