/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A bus that is silent for a while, from every place in a tick to every place in a later one. With four frames that have a
 * Sequence in each tick, 16 ticks are 64: Sequence and Tick then fit again, and only a clock tells (Limits, docs/trace.md).
 */
#include "judge.h"
#include "unity.h"

enum { NODES = 120, BEFORE = 20, AFTER = 4, TICKS_MOST = 36 };

static controller_t controller;
static judge_t judge;
static tally_t tally;
static const channel_t nothing_lost = {.name = "0 %"};

void setUp(void)
{
    tally = (tally_t){0};
}

void tearDown(void)
{
}

/** Every node changes in every tick: three CanopyChange. Silent from frame `from` on, `ticks` later up to frame `to`. */
static void be_silent(bool has_clock, unsigned ticks, unsigned from, unsigned to)
{
    const controller_mood_t mood = {.leaf_flips = 1000};

    controller_make(&controller, 7, &mood, NODES);
    controller.entry_count = 0;
    controller.config = (canopy_trace_config_t){.id = CONTROLLER_ID,
                                                .changes_max = 3,
                                                .data_id = CANOPY_E2E_NONE,
                                                .snapshot_every = UINT16_MAX,
                                                .values_every = UINT16_MAX,
                                                .health_every = UINT16_MAX,
                                                .model_every = UINT16_MAX};
    controller_start(&controller, 0);
    judge_start(&judge, &controller, &nothing_lost, 1, &tally, NULL);
    judge.has_clock = has_clock;
    judge.only_counts = true;
    for (unsigned tick = 0; tick < BEFORE + ticks + AFTER; tick++) {
        controller_tick(&controller);
        judge.silent_from = tick < BEFORE ? OUT_MAX : tick == BEFORE ? from : 0;
        judge.silent_to = tick < BEFORE + ticks ? OUT_MAX : tick == BEFORE + ticks ? to : 0;
        judge_tick(&judge);
    }
}

static void all_silences(bool has_clock)
{
    for (unsigned ticks = 0; ticks <= TICKS_MOST; ticks++) {
        for (unsigned from = 0; from < 6u; from++) {
            for (unsigned to = ticks == 0 ? from : 0; to < 6u; to++) {
                be_silent(has_clock, ticks, from, to);
            }
        }
    }
}

static void test_with_a_clock_nothing_wrong_is_certain(void)
{
    all_silences(true);
    TEST_ASSERT_GREATER_THAN_UINT64(20000, tally.shown);
    TEST_ASSERT_EQUAL_UINT64(0, tally.wrong);
}

static void test_without_a_clock_sixteen_ticks_of_four_frames_deceive(void)
{
    all_silences(false);
    TEST_ASSERT_GREATER_THAN_UINT64(0, tally.wrong);
    for (unsigned from = 0; from < 6u; from++) {
        for (unsigned to = 0; to < 6u; to++) {
            tally.wrong = 0;
            be_silent(false, 15, from, to);
            be_silent(false, 17, from, to);
            TEST_ASSERT_EQUAL_UINT64(0, tally.wrong);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_with_a_clock_nothing_wrong_is_certain);
    RUN_TEST(test_without_a_clock_sixteen_ticks_of_four_frames_deceive);
    return UNITY_END();
}
