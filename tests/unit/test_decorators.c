/* SPDX-License-Identifier: MIT */
/** @file Decorators and leaves' faults against docs/semantics.md. */
#include "scripted_leaves.h"

static bench_t bench;

void setUp(void)
{
}

void tearDown(void)
{
}

static void start_decorator(canopy_node_type_t type, const int32_t *parameter)
{
    static canopy_node_t nodes[] = {INNER(INVERTER, 0, 2, 4, 0), ACTION(0, 1, 0)};

    nodes[0].type = (uint8_t)type;
    bench_start(&bench, nodes, 2, parameter, 1);
}

static const int32_t three = 3;
static const int32_t zero = 0;
static const int32_t for_ever = -1;

static void inverter_swaps_success_and_failure(void)
{
    start_decorator(CANOPY_NODE_INVERTER, &zero);
    EXPECT("S", CANOPY_FAILURE, "a");
    EXPECT("F", CANOPY_SUCCESS, "a");
    EXPECT("R", CANOPY_RUNNING, "a");
    EXPECT("S", CANOPY_FAILURE, "a'");
    EXPECT("K", CANOPY_SKIPPED, "a");
}

static void retry_makes_one_attempt_a_tick(void)
{
    start_decorator(CANOPY_NODE_RETRY_UNTIL_SUCCESSFUL, &three);
    EXPECT("F", CANOPY_RUNNING, "a");
    EXPECT("R", CANOPY_RUNNING, "a");
    EXPECT("F", CANOPY_RUNNING, "a'");
    EXPECT("F", CANOPY_FAILURE, "a");
    EXPECT("F", CANOPY_RUNNING, "a");
    EXPECT("S", CANOPY_SUCCESS, "a");
}

static void retry_counts_anew_after_success_and_halt_but_not_after_skipped(void)
{
    start_decorator(CANOPY_NODE_RETRY_UNTIL_SUCCESSFUL, &three);
    EXPECT("F", CANOPY_RUNNING, "a");
    EXPECT("F", CANOPY_RUNNING, "a");
    EXPECT("S", CANOPY_SUCCESS, "a");
    EXPECT("F", CANOPY_RUNNING, "a");
    EXPECT("F", CANOPY_RUNNING, "a");
    canopy_tree_halt(&bench.instance);
    EXPECT("F", CANOPY_RUNNING, "a");
    EXPECT("F", CANOPY_RUNNING, "a");
    EXPECT("K", CANOPY_SKIPPED, "a");
    EXPECT("F", CANOPY_FAILURE, "a");
}

static void retry_never_or_for_ever(void)
{
    start_decorator(CANOPY_NODE_RETRY_UNTIL_SUCCESSFUL, &zero);
    EXPECT("S", CANOPY_FAILURE, "");
    start_decorator(CANOPY_NODE_RETRY_UNTIL_SUCCESSFUL, &for_ever);
    for (unsigned attempt = 0; attempt < 100u; attempt++) {
        EXPECT("F", CANOPY_RUNNING, "a");
    }
    EXPECT("S", CANOPY_SUCCESS, "a");
}

static void retry_counts_beyond_16_bits(void)
{
    static const int32_t many = 70000;

    start_decorator(CANOPY_NODE_RETRY_UNTIL_SUCCESSFUL, &many);
    for (int32_t attempt = 1; attempt < many; attempt++) {
        EXPECT("F", CANOPY_RUNNING, "a");
    }
    EXPECT("F", CANOPY_FAILURE, "a");
}

static void timeout_asks_the_clock_before_each_further_tick(void)
{
    start_decorator(CANOPY_NODE_TIMEOUT, &three);
    EXPECT_AT(1000, "R", CANOPY_RUNNING, "a");
    EXPECT_AT(3999, "R", CANOPY_RUNNING, "a'");
    EXPECT_AT(4000, "R", CANOPY_FAILURE, "a!");
    EXPECT_AT(4001, "R", CANOPY_RUNNING, "a");
    EXPECT_AT(5000, "S", CANOPY_SUCCESS, "a'");
    EXPECT_AT(9000, "S", CANOPY_SUCCESS, "a");
}

static void timeout_stops_its_clock_when_the_child_is_skipped(void)
{
    start_decorator(CANOPY_NODE_TIMEOUT, &three);
    EXPECT_AT(0, "R", CANOPY_RUNNING, "a");
    EXPECT_AT(1000, "K", CANOPY_SKIPPED, "a'");
    EXPECT_AT(3500, "R", CANOPY_RUNNING, "a");
    EXPECT_AT(6499, "R", CANOPY_RUNNING, "a'");
    EXPECT_AT(6500, "R", CANOPY_FAILURE, "a!");
}

static void timeout_is_right_across_the_wrap_of_time(void)
{
    const canopy_time_t late = UINT64_MAX - 1000u;

    start_decorator(CANOPY_NODE_TIMEOUT, &three);
    EXPECT_AT(late, "R", CANOPY_RUNNING, "a");
    EXPECT_AT(late + 2999u, "R", CANOPY_RUNNING, "a'");
    EXPECT_AT(late + 3000u, "R", CANOPY_FAILURE, "a!");
}

static void timeout_works_while_time_stands_still(void)
{
    start_decorator(CANOPY_NODE_TIMEOUT, &zero);
    EXPECT_AT(7, "S", CANOPY_SUCCESS, "a");
    EXPECT_AT(7, "R", CANOPY_RUNNING, "a");
    EXPECT_AT(7, "R", CANOPY_FAILURE, "a!");
}

static void repeat_makes_one_cycle_a_tick(void)
{
    start_decorator(CANOPY_NODE_REPEAT, &three);
    EXPECT("S", CANOPY_RUNNING, "a");
    TEST_ASSERT_EQUAL(CANOPY_IDLE, canopy_tree_status(&bench.instance, 1)); /* ready for the next cycle */
    EXPECT("R", CANOPY_RUNNING, "a");
    EXPECT("S", CANOPY_RUNNING, "a'");
    EXPECT("K", CANOPY_SKIPPED, "a");
    EXPECT("S", CANOPY_SUCCESS, "a");
    EXPECT("S", CANOPY_RUNNING, "a");
    EXPECT("F", CANOPY_FAILURE, "a");
    EXPECT("S", CANOPY_RUNNING, "a");
    canopy_tree_halt(&bench.instance);
    EXPECT("S", CANOPY_RUNNING, "a");
    EXPECT("S", CANOPY_RUNNING, "a");
    EXPECT("S", CANOPY_SUCCESS, "a");
    start_decorator(CANOPY_NODE_REPEAT, &zero);
    EXPECT("F", CANOPY_SUCCESS, "");
}

static void forced_results(void)
{
    start_decorator(CANOPY_NODE_FORCE_SUCCESS, &zero);
    EXPECT("F", CANOPY_SUCCESS, "a");
    EXPECT("R", CANOPY_RUNNING, "a");
    EXPECT("K", CANOPY_SKIPPED, "a'");
    start_decorator(CANOPY_NODE_FORCE_FAILURE, &zero);
    EXPECT("S", CANOPY_FAILURE, "a");
    EXPECT("R", CANOPY_RUNNING, "a");
    EXPECT("F", CANOPY_FAILURE, "a'");
    start_decorator(CANOPY_NODE_KEEP_RUNNING_UNTIL_FAILURE, &zero);
    EXPECT("S", CANOPY_RUNNING, "a");
    EXPECT("R", CANOPY_RUNNING, "a");
    EXPECT("K", CANOPY_SKIPPED, "a'");
    EXPECT("F", CANOPY_FAILURE, "a");
}

static void delay_waits_once_before_each_completion(void)
{
    start_decorator(CANOPY_NODE_DELAY, &three);
    EXPECT_AT(0, "R", CANOPY_RUNNING, "");
    EXPECT_AT(2999, "R", CANOPY_RUNNING, "");
    EXPECT_AT(3000, "R", CANOPY_RUNNING, "a");
    EXPECT_AT(3001, "K", CANOPY_SKIPPED, "a'");
    EXPECT_AT(3002, "S", CANOPY_SUCCESS, "a");
    EXPECT_AT(3003, "S", CANOPY_RUNNING, "");
    canopy_tree_halt(&bench.instance);
    EXPECT_AT(4000, "S", CANOPY_RUNNING, "");
    EXPECT_AT(6500, "S", CANOPY_RUNNING, "");
    EXPECT_AT(7000, "S", CANOPY_SUCCESS, "a");
}

static void run_once_remembers_until_the_tree_is_reset(void)
{
    static const int32_t yes = 1;

    start_decorator(CANOPY_NODE_RUN_ONCE, &yes);
    EXPECT("K", CANOPY_SKIPPED, "a");
    EXPECT("R", CANOPY_RUNNING, "a");
    canopy_tree_halt(&bench.instance);
    EXPECT("F", CANOPY_FAILURE, "a");
    EXPECT("S", CANOPY_SKIPPED, "");
    canopy_tree_halt(&bench.instance);
    EXPECT("S", CANOPY_SKIPPED, "");
    canopy_tree_reset(&bench.instance);
    EXPECT("S", CANOPY_SUCCESS, "a");
    start_decorator(CANOPY_NODE_RUN_ONCE, &zero);
    EXPECT("F", CANOPY_FAILURE, "a");
    EXPECT("S", CANOPY_FAILURE, "");
}

static void built_in_leaves(void)
{
    static canopy_node_t nodes[] = {INNER(ALWAYS_SUCCESS, 0, 1, 0, 0)};

    nodes[0].type = CANOPY_NODE_ALWAYS_SUCCESS;
    bench_start(&bench, nodes, 1, &three, 1);
    EXPECT("", CANOPY_SUCCESS, "");
    nodes[0].type = CANOPY_NODE_ALWAYS_FAILURE;
    EXPECT("", CANOPY_FAILURE, "");
    nodes[0].type = CANOPY_NODE_SLEEP;
    bench_start(&bench, nodes, 1, &three, 1);
    EXPECT_AT(10, "", CANOPY_RUNNING, "");
    EXPECT_AT(3009, "", CANOPY_RUNNING, "");
    EXPECT_AT(3010, "", CANOPY_SUCCESS, "");
    EXPECT_AT(3011, "", CANOPY_RUNNING, "");
    canopy_tree_halt(&bench.instance);
    EXPECT_AT(6010, "", CANOPY_RUNNING, "");
}

static void a_wrong_status_of_a_leaf_is_a_failure_and_counted(void)
{
    static const canopy_node_t nodes[] = {INNER(FALLBACK, 0, 4, 0, 0), CONDITION(0, 1, 0), SYNC(0, 2, 1),
                                          ACTION(0, 3, 2)};

    bench_start(&bench, nodes, 4, &zero, 1);
    EXPECT("RRI", CANOPY_FAILURE, "abc");
    TEST_ASSERT_EQUAL_UINT32(3, bench.instance.faults);
    TEST_ASSERT_EQUAL_UINT16(3, bench.instance.fault_node);
    bench.script.returns[0] = (canopy_status_t)77;
    bench.script.returns[1] = CANOPY_SUCCESS;
    TEST_ASSERT_EQUAL(CANOPY_SUCCESS, canopy_tree_tick(&bench.instance, 0));
    TEST_ASSERT_EQUAL_UINT32(4, bench.instance.faults);
    TEST_ASSERT_EQUAL_UINT16(1, bench.instance.fault_node);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(inverter_swaps_success_and_failure);
    RUN_TEST(retry_makes_one_attempt_a_tick);
    RUN_TEST(retry_counts_anew_after_success_and_halt_but_not_after_skipped);
    RUN_TEST(retry_never_or_for_ever);
    RUN_TEST(retry_counts_beyond_16_bits);
    RUN_TEST(timeout_asks_the_clock_before_each_further_tick);
    RUN_TEST(timeout_stops_its_clock_when_the_child_is_skipped);
    RUN_TEST(timeout_is_right_across_the_wrap_of_time);
    RUN_TEST(timeout_works_while_time_stands_still);
    RUN_TEST(repeat_makes_one_cycle_a_tick);
    RUN_TEST(forced_results);
    RUN_TEST(delay_waits_once_before_each_completion);
    RUN_TEST(run_once_remembers_until_the_tree_is_reset);
    RUN_TEST(built_in_leaves);
    RUN_TEST(a_wrong_status_of_a_leaf_is_a_failure_and_counted);
    return UNITY_END();
}
