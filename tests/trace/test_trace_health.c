/* SPDX-License-Identifier: MIT */
/** @file CanopyHealth and CanopyModel of a whole loop, read by the second decoder: every counter, small and at its end. */
#include <stdatomic.h>

#include "decoder.h"
#include "fake_loop.h"
#include "random.h"
#include "small_app.h"
#include "unity.h"

enum { ROUNDS = 2000, U8 = 0xFF, U16 = 0xFFFF, U24 = 0xFFFFFF };

static small_memory_t memory;
static canopy_app_t app;
static random_t chance;
static decoder_model_t model = {.base = TRACE_ID, .node_count = 1, .changes_max = 1};
static decoder_t decoder;
static decoder_cell_t cell;

void setUp(void)
{
    memory = (small_memory_t){0};
    app = small_app(&memory);
    app.trace = &trace;
    chance = random_seed(20261130);
    decoder_init(&decoder, &model, &cell, NULL, NULL, NULL);
    fake_loop_start(&app);
}

void tearDown(void)
{
}

/** Of any size, with 0 and the largest one now and then. */
static uint32_t any_count(void)
{
    return random_chance(&chance, 50) ? UINT32_MAX : random_bits(&chance) >> random_below(&chance, 32u) >> 1;
}

static uint32_t limited(uint64_t value, uint32_t most)
{
    return value < most ? (uint32_t)value : most;
}

/** Fewer than 4^n, and at least 4^(n-1). */
static uint8_t power_of_four(uint32_t value)
{
    uint8_t n = 0;

    for (uint64_t power = 1; value >= power && n < 15u; power *= 4u) {
        n++;
    }
    return n;
}

static void set_counters(void)
{
    canopy_bus_counters_t *bus = &memory.bus_state.counters;

    bus->wrong_form = any_count();
    bus->wrong_crc = any_count() / 4u;
    bus->wrong_sequence = any_count() / 4u;
    bus->out_of_range = any_count() / 4u;
    bus->unknown_id = any_count();
    bus->timeouts = any_count();
    fake.rx_dropped = any_count();
    loop.rx_lost = fake.rx_dropped; /* none since the last cycle */
    loop.rx_backlogs = any_count();
    loop.rx_errors = any_count();
    loop.overruns = any_count();
    loop.slips = any_count();
    loop.longest_cycle = any_count();
    loop.most_late = any_count();
    for (unsigned i = 0; i < DECODER_BINS; i++) {
        loop.lateness[i] = any_count();
    }
    memory.instance.faults = any_count();
    loop.can_manager.restarts = any_count();
    atomic_store(&memory.tx.replaced, any_count());
    atomic_store(&memory.tx.expired, any_count());
    atomic_store(&memory.tx.trace_late, any_count() / 2u);
}

static void cycle_and_decode(void)
{
    (void)fake_loop_cycle(0);
    for (unsigned i = 0; i < fake.tx_count; i++) {
        decoder_take(&decoder, &fake.tx[i]);
    }
}

static void expect_receive_and_transmit(const decoder_health_t *health)
{
    const canopy_bus_counters_t *bus = &memory.bus_state.counters;
    canopy_tx_counters_t tx_counters;

    canopy_tx_count(&memory.tx, &tx_counters);
    TEST_ASSERT_EQUAL_UINT(
        limited((uint64_t)bus->wrong_form + bus->wrong_crc + bus->wrong_sequence + bus->out_of_range, U16),
        health->rx_rejected);
    TEST_ASSERT_EQUAL_UINT(limited(bus->unknown_id, U16), health->rx_unknown);
    TEST_ASSERT_EQUAL_UINT(limited(loop.rx_lost, U16), health->rx_lost);
    TEST_ASSERT_EQUAL_UINT(limited(loop.rx_backlogs, U8), health->rx_backlogs);
    TEST_ASSERT_EQUAL_UINT(limited(tx_counters.replaced, U16), health->tx_replaced);
    TEST_ASSERT_EQUAL_UINT(limited(tx_counters.expired, U16), health->tx_expired);
    TEST_ASSERT_EQUAL_UINT(limited(tx_counters.trace_dropped, U16), health->trace_dropped);
    TEST_ASSERT_EQUAL_UINT(limited(loop.can_manager.restarts, U8), health->restarts);
}

static void expect_time_and_faults(const decoder_health_t *health)
{
    TEST_ASSERT_EQUAL_UINT(limited(loop.overruns, U16), health->overruns);
    TEST_ASSERT_EQUAL_UINT(limited(loop.longest_cycle, U24), health->longest_cycle);
    TEST_ASSERT_EQUAL_UINT(10u * limited((loop.most_late + 9u) / 10u, U16), health->latest_start);
    for (unsigned i = 0; i < DECODER_BINS; i++) {
        TEST_ASSERT_EQUAL_UINT(power_of_four(loop.lateness[i]), health->lateness[i]);
    }
    TEST_ASSERT_EQUAL_UINT(limited(loop.slips, U8), health->slips);
    TEST_ASSERT_EQUAL_UINT(limited(memory.instance.faults, U16), health->leaf_faults);
    TEST_ASSERT_EQUAL_UINT(limited(loop.rx_errors, U16), health->rx_errors);
    TEST_ASSERT_EQUAL_UINT(limited(memory.bus_state.counters.timeouts, U16), health->timeouts);
}

static void test_health_tells_every_counter_up_to_its_largest_value(void)
{
    for (unsigned round = 0; round < ROUNDS; round++) {
        set_counters();
        for (unsigned page = 0; page < DECODER_PAGES; page++) {
            decoder.health.pages = 0;
            cycle_and_decode();
            TEST_ASSERT_EQUAL_UINT(1u << page, decoder.health.pages); /* in turn, 0 first */
        }
        expect_receive_and_transmit(&decoder.health);
        expect_time_and_faults(&decoder.health);
        TEST_ASSERT_FALSE(decoder.health.filtered);
    }
    TEST_ASSERT_EQUAL(DECODER_RUNS, decoder.stop);
}

static void test_the_model_page_has_the_upper_bits_of_the_time_whenever_they_change(void)
{
    for (unsigned i = 0; i < ROUNDS; i++) {
        decoder.has_upper = false;
        time += random_below(&chance, UINT32_MAX); /* up to an hour and more from tick to tick */
        cycle_and_decode();
        if (decoder.has_upper) {
            TEST_ASSERT_EQUAL_UINT(decoder.tick.number & U16, decoder.upper_tick);
        }
        TEST_ASSERT_EQUAL_UINT64(time & UINT64_C(0xFFFFFFFFFFFF),
                                 (uint64_t)decoder.upper_now << 24 | decoder.tick.inputs.now);
    }
}

static void test_another_hash_or_number_of_nodes_stops_the_decoder(void)
{
    cycle_and_decode();
    TEST_ASSERT_EQUAL(DECODER_RUNS, decoder.stop);
    for (unsigned other = 0; other < 2u; other++) {
        decoder_model_t wrong = model;
        decoder_cell_t cells[2];

        wrong.hash = other == 0 ? 1u : 0u;
        wrong.node_count = other == 0 ? 1u : 2u;
        decoder_init(&decoder, &wrong, cells, NULL, NULL, NULL);
        for (unsigned i = 0; i < 1000u && decoder.stop == DECODER_RUNS; i++) { /* model_every */
            cycle_and_decode();
        }
        TEST_ASSERT_EQUAL(DECODER_OTHER_TREE, decoder.stop);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_health_tells_every_counter_up_to_its_largest_value);
    RUN_TEST(test_the_model_page_has_the_upper_bits_of_the_time_whenever_they_change);
    RUN_TEST(test_another_hash_or_number_of_nodes_stops_the_decoder);
    return UNITY_END();
}
