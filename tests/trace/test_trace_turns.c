/* SPDX-License-Identifier: MIT */
/** @file Nodes that change take turns: however many change in every tick, each is told soon, or is shown as not certain. */
#include "judge.h"
#include "unity.h"

enum { NODES = 200, WATCHED = 150 };

static controller_t controller;
static judge_t judge;
static tally_t tally;
static const channel_t nothing_lost = {.name = "0 %"};

void setUp(void)
{
}

void tearDown(void)
{
}

/** RUNNING and SKIPPED: a ParallelAll ticks both again. */
static void flip(uint16_t node)
{
    canopy_status_t *answer = &controller.ref.nodes[node].answer;

    *answer = *answer == CANOPY_RUNNING ? CANOPY_SKIPPED : CANOPY_RUNNING;
}

/**
 * Nodes 1 to `flipping` change in every tick, node 150 once, in tick `at`. Returns how many ticks later it is certain. The
 * judge ends the test when its old code is shown as certain.
 */
static unsigned ticks_until_told(uint8_t changes_max, uint16_t flipping, unsigned at)
{
    const controller_mood_t mood = {0};
    const decoder_cell_t *watched = &judge.nodes[WATCHED];

    controller_make(&controller, 1, &mood, NODES);
    controller.config.changes_max = changes_max;
    controller.config.snapshot_every = UINT16_MAX; /* which would help */
    controller_start(&controller, 0);
    judge_start(&judge, &controller, &nothing_lost, 1, &tally, NULL);
    for (unsigned tick = 0; tick < at + NODES; tick++) {
        for (uint16_t node = 1; node <= flipping; node++) {
            flip(node);
        }
        if (tick == at) {
            flip(WATCHED);
        }
        controller_tick(&controller);
        judge_tick(&judge);
        TEST_ASSERT_EQUAL_UINT(tick, judge.decoder.tick.number);
        if (tick >= at && watched->is_certain) {
            TEST_ASSERT_EQUAL_UINT(CANOPY_SKIPPED, watched->shown);
            return tick - at;
        }
    }
    return UINT32_MAX;
}

static unsigned most_ticks_until_told(uint8_t changes_max, uint16_t flipping)
{
    unsigned most = 0;

    for (unsigned at = 100; at < 120; at++) {
        unsigned ticks = ticks_until_told(changes_max, flipping, at);

        most = ticks > most ? ticks : most;
    }
    return most;
}

static void test_sixteen_that_change_in_every_tick_do_not_hide_another(void)
{
    for (uint8_t changes_max = 1; changes_max <= 8u; changes_max++) {
        unsigned most = most_ticks_until_told(changes_max, 16);

        printf("16 of 200 nodes change in every tick, %u CanopyChange: node 150 is told after %u ticks at most\n",
               (unsigned)changes_max, most);
        TEST_ASSERT_LESS_OR_EQUAL_UINT((WATCHED + 15u) / 16u, most);
    }
}

static void test_all_before_it_do_not_hide_another(void)
{
    for (uint8_t changes_max = 1; changes_max <= 8u; changes_max++) {
        unsigned most = most_ticks_until_told(changes_max, WATCHED - 1u);

        printf("149 of 200 nodes change in every tick, %u CanopyChange: node 150 is told after %u ticks at most\n",
               (unsigned)changes_max, most);
        TEST_ASSERT_LESS_OR_EQUAL_UINT((WATCHED + 5u * changes_max - 1u) / (5u * changes_max), most);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_sixteen_that_change_in_every_tick_do_not_hide_another);
    RUN_TEST(test_all_before_it_do_not_hide_another);
    return UNITY_END();
}
