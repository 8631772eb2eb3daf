/* SPDX-License-Identifier: MIT */
/** @file Several instances of one table: each has its own place in the tree, counts, timers and leaves' application. */
#include "scripted_leaves.h"

enum { INSTANCES = 3, NODES = 5, WORDS = 7, MS = 1000 };

/* A Sequence that goes on where it was, of an action and of a RetryUntilSuccessful over a Timeout over an action. */
static const canopy_node_t nodes[NODES] = {
    {.type = CANOPY_NODE_SEQUENCE, .parent = 0, .end = 5, .state = 0},
    {.type = CANOPY_NODE_STATEFUL_ACTION, .parent = 0, .end = 2, .parameter = 0},
    {.type = CANOPY_NODE_RETRY_UNTIL_SUCCESSFUL, .parent = 0, .end = 5, .state = 1, .parameter = 0},
    {.type = CANOPY_NODE_TIMEOUT, .parent = 2, .end = 5, .state = 3, .parameter = 1},
    {.type = CANOPY_NODE_STATEFUL_ACTION, .parent = 3, .end = 5, .parameter = 1},
};
static const int32_t parameters[] = {2, 50};
static const canopy_tree_t tree = {.nodes = nodes,
                                   .leaves = &script_leaf,
                                   .parameters = parameters,
                                   .node_count = NODES,
                                   .leaf_count = 1,
                                   .parameter_count = 2,
                                   .word_count = WORDS};

static canopy_tree_instance_t instances[INSTANCES];
static uint8_t status[INSTANCES][NODES];
static uint16_t words[INSTANCES][WORDS];
static script_t scripts[INSTANCES];

void setUp(void)
{
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_validate(&tree, NULL));
    for (unsigned i = 0; i < (unsigned)INSTANCES; i++) {
        scripts[i] = (script_t){0};
        TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_init(&instances[i], &tree, status[i], words[i], &scripts[i]));
    }
}

void tearDown(void)
{
}

/** Ticks an instance at a time of its own, with these results of its two leaves, and expects status and calls. */
static void expect(unsigned i, unsigned now_ms, canopy_status_t first, canopy_status_t second, canopy_status_t root,
                   const char *calls)
{
    scripts[i].returns[0] = first;
    scripts[i].returns[1] = second;
    scripts[i].log[0] = '\0';
    TEST_ASSERT_EQUAL(root, canopy_tree_tick(&instances[i], (canopy_time_t)now_ms * MS));
    TEST_ASSERT_EQUAL_STRING(calls, scripts[i].log);
}

static void each_is_at_its_own_place_with_its_own_counts_and_timers(void)
{
    /* 0 is ticked every 20 ms, 1 every 40 ms, and 2 comes later; they mix. */
    expect(0, 0, CANOPY_SUCCESS, CANOPY_RUNNING, CANOPY_RUNNING, "ab");
    expect(1, 0, CANOPY_RUNNING, CANOPY_RUNNING, CANOPY_RUNNING, "a");
    expect(0, 20, CANOPY_SUCCESS, CANOPY_RUNNING, CANOPY_RUNNING, "b'");
    expect(0, 40, CANOPY_SUCCESS, CANOPY_RUNNING, CANOPY_RUNNING, "b'");
    expect(1, 40, CANOPY_SUCCESS, CANOPY_RUNNING, CANOPY_RUNNING, "a'b");
    expect(2, 50, CANOPY_SUCCESS, CANOPY_SUCCESS, CANOPY_SUCCESS, "ab");
    /* The first one's timer is over, its first attempt used up; the second one's timer has run for 20 ms only. */
    expect(0, 60, CANOPY_SUCCESS, CANOPY_RUNNING, CANOPY_RUNNING, "b!");
    expect(1, 60, CANOPY_SUCCESS, CANOPY_RUNNING, CANOPY_RUNNING, "b'");
    expect(0, 80, CANOPY_SUCCESS, CANOPY_FAILURE, CANOPY_FAILURE, "b");
    expect(1, 80, CANOPY_SUCCESS, CANOPY_FAILURE, CANOPY_RUNNING, "b'");
    expect(1, 120, CANOPY_SUCCESS, CANOPY_SUCCESS, CANOPY_SUCCESS, "b");
    expect(0, 100, CANOPY_SUCCESS, CANOPY_RUNNING, CANOPY_RUNNING, "ab");
}

static void halting_one_does_not_disturb_the_others(void)
{
    for (unsigned i = 0; i < (unsigned)INSTANCES; i++) {
        expect(i, 0, CANOPY_SUCCESS, CANOPY_RUNNING, CANOPY_RUNNING, "ab");
    }
    canopy_tree_halt(&instances[1]);
    TEST_ASSERT_EQUAL_STRING("abb!", scripts[1].log);
    TEST_ASSERT_EQUAL(CANOPY_IDLE, canopy_tree_status(&instances[1], 0));
    expect(0, 20, CANOPY_SUCCESS, CANOPY_RUNNING, CANOPY_RUNNING, "b'");
    expect(1, 20, CANOPY_RUNNING, CANOPY_RUNNING, CANOPY_RUNNING, "a");
    expect(2, 20, CANOPY_SUCCESS, CANOPY_SUCCESS, CANOPY_SUCCESS, "b'");
}

static void faults_are_counted_for_the_instance_in_which_they_happen(void)
{
    expect(1, 0, (canopy_status_t)9, CANOPY_SUCCESS, CANOPY_FAILURE, "a");
    expect(0, 0, CANOPY_SUCCESS, CANOPY_SUCCESS, CANOPY_SUCCESS, "ab");
    TEST_ASSERT_EQUAL_UINT32(0, instances[0].faults);
    TEST_ASSERT_EQUAL_UINT32(1, instances[1].faults);
    TEST_ASSERT_EQUAL_UINT16(1, instances[1].fault_node);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(each_is_at_its_own_place_with_its_own_counts_and_timers);
    RUN_TEST(halting_one_does_not_disturb_the_others);
    RUN_TEST(faults_are_counted_for_the_instance_in_which_they_happen);
    return UNITY_END();
}
