/* SPDX-License-Identifier: MIT */
/** @file The controller runs another tree from a tick on: a receiver with the old one's names stops before it shows a node. */
#include <string.h>

#include "judge.h"
#include "unity.h"

enum { RUNS = 300, BEFORE = 30, AFTER = 10 };

static controller_t controller;
static controller_t next; /* its tree is the other one */
static decoder_t decoder;
static decoder_cell_t nodes[NODES_MAX];
static decoder_cell_t slots[SLOTS_MAX];
static unsigned shown;

void setUp(void)
{
    shown = 0;
}

void tearDown(void)
{
}

static void count_shown(void *context, const decoder_t *self)
{
    (void)context;
    (void)self;
    shown++;
}

/** The tree, and the answers of its leaves, of `next`; all else goes on. */
static void exchange(void)
{
    controller.ref = next.ref;
    memcpy(controller.nodes, next.nodes, sizeof next.nodes);
    controller.tree = next.tree;
    controller.tree.nodes = controller.nodes;
    controller.tree.parameters = controller.parameters;
    ref_start(&controller.ref);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_init(&controller.instance, &controller.tree, controller.status,
                                                  controller.words, &controller));
    canopy_trace_follow_exchange(&controller.state);
}

static void take_all(void)
{
    for (unsigned i = 0; i < controller.out_count; i++) {
        decoder_take(&decoder, &controller.out[i]);
    }
}

static void test_no_node_of_another_tree_is_shown(void)
{
    const controller_mood_t mood = {.leaf_flips = 200, .value_flips = 20};
    unsigned expected = 0;

    for (uint64_t run = 0; run < RUNS; run++) {
        decoder_model_t model = {.base = CONTROLLER_ID};

        controller_make(&controller, run, &mood, 0);
        controller_make(&next, run + RUNS, &mood, 0);
        next.tree.hash ^= UINT32_C(0x80000000); /* also where both have as many nodes */
        model.hash = controller.tree.hash;
        model.node_count = controller.tree.node_count;
        model.slot_count = controller.config.value_count;
        model.changes_max = controller.config.changes_max;
        controller_start(&controller, 0);
        decoder_init(&decoder, &model, nodes, slots, count_shown, NULL);
        for (unsigned tick = 0; tick < BEFORE; tick++) {
            controller_tick(&controller);
            take_all();
        }
        expected += BEFORE;
        TEST_ASSERT_EQUAL_UINT(expected, shown);
        exchange();
        for (unsigned tick = 0; tick < AFTER; tick++) {
            controller_tick(&controller);
            take_all();
        }
        TEST_ASSERT_EQUAL(DECODER_OTHER_TREE, decoder.stop);
        TEST_ASSERT_EQUAL_UINT(expected, shown);
    }
}

/** Who has the new tree's names as well may join then: as after a loss, all is known again in time. */
static void test_who_knows_the_other_tree_follows_it(void)
{
    const controller_mood_t mood = {.leaf_flips = 200};
    static const channel_t nothing_lost = {.name = "0 %"};
    static judge_t judge;
    static tally_t tally;

    for (uint64_t run = 0; run < RUNS; run++) {
        controller_make(&controller, run, &mood, 0);
        controller_make(&next, run + RUNS, &mood, 0);
        controller_start(&controller, 0);
        for (unsigned tick = 0; tick < BEFORE; tick++) {
            controller_tick(&controller);
        }
        exchange();
        judge_start(&judge, &controller, &nothing_lost, run, &tally, NULL);
        for (unsigned tick = 0; tick < judge_known_within(&controller) + AFTER; tick++) {
            controller_tick(&controller);
            judge_tick(&judge);
        }
        TEST_ASSERT_FALSE(judge.is_disturbed);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_no_node_of_another_tree_is_shown);
    RUN_TEST(test_who_knows_the_other_tree_follows_it);
    return UNITY_END();
}
