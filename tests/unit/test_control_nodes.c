/* SPDX-License-Identifier: MIT */
/** @file Control nodes against docs/semantics.md: which children are ticked and halted, in order, and what comes out. */
#include "scripted_leaves.h"

static bench_t bench;
static const int32_t none[] = {0};

void setUp(void)
{
}

void tearDown(void)
{
}

static void start_three_actions(canopy_node_type_t type)
{
    static canopy_node_t nodes[] = {INNER(SEQUENCE, 0, 4, 0, 0), ACTION(0, 1, 0), ACTION(0, 2, 1), ACTION(0, 3, 2)};

    nodes[0].type = (uint8_t)type;
    START(nodes, none);
}

static void sequence_resumes_at_the_running_child(void)
{
    start_three_actions(CANOPY_NODE_SEQUENCE);
    EXPECT("SRS", CANOPY_RUNNING, "ab");
    EXPECT("FRS", CANOPY_RUNNING, "b'");
    EXPECT("FSR", CANOPY_RUNNING, "b'c");
    EXPECT("FFS", CANOPY_SUCCESS, "c'");
    EXPECT("SSS", CANOPY_SUCCESS, "abc");
    EXPECT("SFS", CANOPY_FAILURE, "ab");
    EXPECT("SRS", CANOPY_RUNNING, "ab");
    EXPECT("SFS", CANOPY_FAILURE, "b'");
    EXPECT("FSS", CANOPY_FAILURE, "a");
}

static void fallback_is_its_mirror_image(void)
{
    start_three_actions(CANOPY_NODE_FALLBACK);
    EXPECT("FRS", CANOPY_RUNNING, "ab");
    EXPECT("SRS", CANOPY_RUNNING, "b'");
    EXPECT("SFR", CANOPY_RUNNING, "b'c");
    EXPECT("SSF", CANOPY_FAILURE, "c'");
    EXPECT("FSS", CANOPY_SUCCESS, "ab");
    EXPECT("FFF", CANOPY_FAILURE, "abc");
}

static void skipped_children_are_as_if_not_there(void)
{
    start_three_actions(CANOPY_NODE_SEQUENCE);
    EXPECT("KSS", CANOPY_SUCCESS, "abc");
    EXPECT("SSK", CANOPY_SUCCESS, "abc");
    EXPECT("KKK", CANOPY_SKIPPED, "abc");
    start_three_actions(CANOPY_NODE_FALLBACK);
    EXPECT("KFK", CANOPY_FAILURE, "abc");
    EXPECT("KKK", CANOPY_SKIPPED, "abc");
    start_three_actions(CANOPY_NODE_REACTIVE_SEQUENCE);
    EXPECT("KRS", CANOPY_RUNNING, "ab");
    EXPECT("KSK", CANOPY_SUCCESS, "ab'c");
    EXPECT("KKK", CANOPY_SKIPPED, "abc");
    start_three_actions(CANOPY_NODE_REACTIVE_FALLBACK);
    EXPECT("KKF", CANOPY_FAILURE, "abc");
    EXPECT("KKK", CANOPY_SKIPPED, "abc");
}

static void reactive_sequence_starts_at_the_first_child(void)
{
    start_three_actions(CANOPY_NODE_REACTIVE_SEQUENCE);
    EXPECT("SSR", CANOPY_RUNNING, "abc");
    EXPECT("SSR", CANOPY_RUNNING, "abc'");
    EXPECT("SRR", CANOPY_RUNNING, "abc!");
    EXPECT("SSR", CANOPY_RUNNING, "ab'c");
    EXPECT("FSR", CANOPY_FAILURE, "ac!");
    EXPECT("SSS", CANOPY_SUCCESS, "abc");
}

static void reactive_fallback_starts_at_the_first_child(void)
{
    start_three_actions(CANOPY_NODE_REACTIVE_FALLBACK);
    EXPECT("FFR", CANOPY_RUNNING, "abc");
    EXPECT("FRR", CANOPY_RUNNING, "abc!");
    EXPECT("SRR", CANOPY_SUCCESS, "ab!");
    EXPECT("FFF", CANOPY_FAILURE, "abc");
}

static void a_halted_child_is_started_anew(void)
{
    start_three_actions(CANOPY_NODE_REACTIVE_SEQUENCE);
    EXPECT("SRS", CANOPY_RUNNING, "ab");
    EXPECT("FRS", CANOPY_FAILURE, "ab!");
    EXPECT("SRS", CANOPY_RUNNING, "ab");
}

static void start_parallel(const int32_t *success_count)
{
    static const canopy_node_t nodes[] = {INNER(REACTIVE_PARALLEL, 0, 4, 0, 0), ACTION(0, 1, 0), ACTION(0, 2, 1),
                                          ACTION(0, 3, 2)};

    bench_start(&bench, nodes, 4, success_count, 1);
}

static void reactive_parallel_counts_all_children_every_tick(void)
{
    static const int32_t two = 2;

    start_parallel(&two);
    EXPECT("RRR", CANOPY_RUNNING, "abc");
    EXPECT("SRR", CANOPY_RUNNING, "a'b'c'");
    EXPECT("RSF", CANOPY_RUNNING, "ab'c'");
    EXPECT("SSR", CANOPY_SUCCESS, "a'bcc!");
    EXPECT("FFR", CANOPY_FAILURE, "abcc!");
    EXPECT("FRR", CANOPY_RUNNING, "abc");
    EXPECT("KSR", CANOPY_RUNNING, "ab'c'");
    EXPECT("KSF", CANOPY_FAILURE, "abc'");
    EXPECT("KKK", CANOPY_SKIPPED, "abc");
}

static void reactive_parallel_minus_one_means_all(void)
{
    static const int32_t all = -1;

    start_parallel(&all);
    EXPECT("SSR", CANOPY_RUNNING, "abc");
    EXPECT("SSS", CANOPY_SUCCESS, "abc'");
    EXPECT("SSF", CANOPY_FAILURE, "abc");
    EXPECT("SSK", CANOPY_SUCCESS, "abc");
}

static void reactive_parallel_needs_at_least_one_success(void)
{
    static const int32_t all_but_one = -2;

    start_parallel(&all_but_one);
    EXPECT("SSF", CANOPY_SUCCESS, "abc");
    EXPECT("KKF", CANOPY_FAILURE, "abc");
    EXPECT("KKS", CANOPY_SUCCESS, "abc");
}

static void sequence_with_memory_goes_on_where_it_failed_or_was_halted(void)
{
    start_three_actions(CANOPY_NODE_SEQUENCE_WITH_MEMORY);
    EXPECT("SFS", CANOPY_FAILURE, "ab");
    EXPECT("SFS", CANOPY_FAILURE, "b");
    EXPECT("SRS", CANOPY_RUNNING, "b");
    bench.script.log[0] = '\0';
    canopy_tree_halt(&bench.instance);
    TEST_ASSERT_EQUAL_STRING("b!", bench.script.log);
    EXPECT("SSS", CANOPY_SUCCESS, "bc");
    EXPECT("KKK", CANOPY_SKIPPED, "abc");
    EXPECT("SRS", CANOPY_RUNNING, "ab");
    canopy_tree_reset(&bench.instance);
    EXPECT("SSS", CANOPY_SUCCESS, "abc");
}

static void async_sequence_ends_the_tick_after_a_child_that_completed_at_once(void)
{
    start_three_actions(CANOPY_NODE_ASYNC_SEQUENCE);
    EXPECT("SRS", CANOPY_RUNNING, "a");
    EXPECT("SRS", CANOPY_RUNNING, "b");
    EXPECT("SSR", CANOPY_RUNNING, "b'c");
    EXPECT("SSS", CANOPY_SUCCESS, "c'");
    EXPECT("KSS", CANOPY_RUNNING, "ab");
    EXPECT("KSS", CANOPY_SUCCESS, "c");
    EXPECT("KKK", CANOPY_SKIPPED, "abc");
    EXPECT("FSS", CANOPY_FAILURE, "a");
}

static void async_fallback_is_its_mirror_image(void)
{
    start_three_actions(CANOPY_NODE_ASYNC_FALLBACK);
    EXPECT("FRS", CANOPY_RUNNING, "a");
    EXPECT("FRS", CANOPY_RUNNING, "b");
    EXPECT("FFF", CANOPY_FAILURE, "b'c");
    EXPECT("SFF", CANOPY_SUCCESS, "a");
}

static void start_thresholds(canopy_node_type_t type, const int32_t *parameters)
{
    static canopy_node_t nodes[] = {INNER(PARALLEL, 0, 4, 0, 0), ACTION(0, 1, 0), ACTION(0, 2, 1), ACTION(0, 3, 2)};

    nodes[0].type = (uint8_t)type;
    bench_start(&bench, nodes, 4, parameters, 2);
}

static void parallel_remembers_what_has_completed(void)
{
    static const int32_t two_and_two[] = {2, 2};

    start_thresholds(CANOPY_NODE_PARALLEL, two_and_two);
    EXPECT("RSR", CANOPY_RUNNING, "abc");
    EXPECT("RRF", CANOPY_RUNNING, "a'c'");
    EXPECT("SRR", CANOPY_SUCCESS, "a'");
    EXPECT("FFR", CANOPY_FAILURE, "ab");
    EXPECT("FRK", CANOPY_RUNNING, "abc");
    EXPECT("RSS", CANOPY_SUCCESS, "b'c");
    EXPECT("KKK", CANOPY_SKIPPED, "abc");
    EXPECT("RRR", CANOPY_RUNNING, "abc");
    EXPECT("SSR", CANOPY_SUCCESS, "a'b'c!");
}

static void parallel_with_a_negative_threshold_counts_skipped_as_success(void)
{
    static const int32_t all_and_one[] = {-1, 1};

    start_thresholds(CANOPY_NODE_PARALLEL, all_and_one);
    EXPECT("SKS", CANOPY_SUCCESS, "abc");
    EXPECT("SKR", CANOPY_RUNNING, "abc");
    EXPECT("RKS", CANOPY_SUCCESS, "bc'");
    EXPECT("RFR", CANOPY_FAILURE, "aba!");
}

static void parallel_all_waits_for_every_child(void)
{
    static const int32_t one[] = {1, 0};
    static const int32_t two[] = {2, 0};

    start_thresholds(CANOPY_NODE_PARALLEL_ALL, one);
    EXPECT("FRS", CANOPY_RUNNING, "abc");
    EXPECT("SRR", CANOPY_RUNNING, "b'");
    EXPECT("SSR", CANOPY_FAILURE, "b'");
    EXPECT("KKK", CANOPY_SKIPPED, "abc");
    EXPECT("SKS", CANOPY_SUCCESS, "abc");
    start_thresholds(CANOPY_NODE_PARALLEL_ALL, two);
    EXPECT("FSS", CANOPY_SUCCESS, "abc");
    EXPECT("FSF", CANOPY_FAILURE, "abc");
}

static void if_then_else_asks_once(void)
{
    start_three_actions(CANOPY_NODE_IF_THEN_ELSE);
    EXPECT("SRS", CANOPY_RUNNING, "ab");
    EXPECT("FRS", CANOPY_RUNNING, "b'");
    EXPECT("FSS", CANOPY_SUCCESS, "b'");
    EXPECT("FSR", CANOPY_RUNNING, "ac");
    EXPECT("SSF", CANOPY_FAILURE, "c'");
    EXPECT("RSS", CANOPY_RUNNING, "a");
    EXPECT("SKS", CANOPY_SKIPPED, "a'b");
    EXPECT("KSS", CANOPY_SKIPPED, "a");
}

static void while_do_else_asks_every_tick_and_halts_the_other_branch(void)
{
    start_three_actions(CANOPY_NODE_WHILE_DO_ELSE);
    EXPECT("SRR", CANOPY_RUNNING, "ab");
    EXPECT("SRR", CANOPY_RUNNING, "ab'");
    EXPECT("FRR", CANOPY_RUNNING, "ab!c");
    EXPECT("RRR", CANOPY_RUNNING, "a");
    EXPECT("SSR", CANOPY_SUCCESS, "a'c!b");
    EXPECT("SRR", CANOPY_RUNNING, "ab");
    EXPECT("KRR", CANOPY_SKIPPED, "ab!");
}

static void the_else_branch_may_be_missing(void)
{
    static canopy_node_t nodes[] = {INNER(WHILE_DO_ELSE, 0, 3, 0, 0), ACTION(0, 1, 0), ACTION(0, 2, 1)};

    nodes[0].type = CANOPY_NODE_WHILE_DO_ELSE;
    START(nodes, none);
    EXPECT("SR", CANOPY_RUNNING, "ab");
    EXPECT("FR", CANOPY_FAILURE, "ab!");
    nodes[0].type = CANOPY_NODE_IF_THEN_ELSE;
    START(nodes, none);
    EXPECT("FR", CANOPY_FAILURE, "a");
    EXPECT("SR", CANOPY_RUNNING, "ab");
}

static void children_are_idle(void)
{
    for (uint16_t node = 1; node < bench.tree.node_count; node++) {
        TEST_ASSERT_EQUAL(CANOPY_IDLE, canopy_tree_status(&bench.instance, node));
    }
}

static void a_sequence_that_completes_later_leaves_its_children_idle(void)
{
    start_three_actions(CANOPY_NODE_SEQUENCE);
    EXPECT("SRS", CANOPY_RUNNING, "ab");
    EXPECT("SSS", CANOPY_SUCCESS, "b'c");
    children_are_idle();
    EXPECT("SRS", CANOPY_RUNNING, "ab");
    EXPECT("SFS", CANOPY_FAILURE, "b'");
    children_are_idle();
}

static void try_catch_fails_after_its_handler(void)
{
    start_three_actions(CANOPY_NODE_TRY_CATCH);
    EXPECT("SSS", CANOPY_SUCCESS, "ab");
    children_are_idle();
    EXPECT("SRS", CANOPY_RUNNING, "ab");
    EXPECT("SFR", CANOPY_RUNNING, "b'c");
    EXPECT("SSS", CANOPY_FAILURE, "c'");
    children_are_idle();
    EXPECT("FSR", CANOPY_RUNNING, "ac");
    TEST_ASSERT_EQUAL(CANOPY_IDLE, canopy_tree_status(&bench.instance, 1));
    EXPECT("SSF", CANOPY_FAILURE, "c'");
    EXPECT("FSF", CANOPY_FAILURE, "ac");
    EXPECT("KSS", CANOPY_SUCCESS, "ab");
    EXPECT("KKS", CANOPY_SKIPPED, "ab");
}

static void try_catch_may_tick_its_handler_when_it_is_halted(void)
{
    static const int32_t yes[] = {1};
    static const canopy_node_t nodes[] = {INNER(REACTIVE_FALLBACK, 0, 5, 0, 0), CONDITION(0, 1, 0),
                                          INNER(TRY_CATCH, 0, 5, 0, 0), ACTION(2, 3, 1), SYNC(2, 4, 2)};

    START(nodes, yes);
    EXPECT("FR", CANOPY_RUNNING, "ab");
    EXPECT("SRS", CANOPY_SUCCESS, "ab!c");
    TEST_ASSERT_EQUAL(CANOPY_CODE_RESET + CANOPY_SUCCESS, canopy_tree_status_code(&bench.instance, 4));
    TEST_ASSERT_EQUAL(CANOPY_IDLE, canopy_tree_status(&bench.instance, 2));
    EXPECT("SRS", CANOPY_SUCCESS, "a");
    /* A SyncAction that is RUNNING counts as FAILURE, here too. */
    EXPECT("FR", CANOPY_RUNNING, "ab");
    EXPECT("SRR", CANOPY_SUCCESS, "ab!c");
    TEST_ASSERT_EQUAL_UINT32(1, bench.instance.faults);
    TEST_ASSERT_EQUAL(CANOPY_CODE_RESET + CANOPY_FAILURE, canopy_tree_status_code(&bench.instance, 4));
}

static void a_halt_goes_deepest_first_and_once(void)
{
    /* ReactiveFallback(a, Sequence(b, Parallel(c, Inverter(d), e))): a aborts everything below the sequence. */
    static const int32_t two[] = {2};
    static const canopy_node_t nodes[] = {
        INNER(REACTIVE_FALLBACK, 0, 8, 0, 0), CONDITION(0, 1, 0), INNER(SEQUENCE, 0, 8, 0, 0), ACTION(2, 3, 1),
        INNER(REACTIVE_PARALLEL, 2, 8, 0, 0), ACTION(4, 5, 2),    INNER(INVERTER, 4, 8, 0, 0), ACTION(6, 7, 3)};

    START(nodes, two);
    EXPECT("FSRR", CANOPY_RUNNING, "abcd");
    EXPECT("FSSR", CANOPY_RUNNING, "ac'd'");
    EXPECT("FSRR", CANOPY_RUNNING, "acd'");
    EXPECT("SSRR", CANOPY_SUCCESS, "ac!d!");
    EXPECT("SSRR", CANOPY_SUCCESS, "a");
}

static void halting_the_tree_follows_the_same_rule(void)
{
    start_three_actions(CANOPY_NODE_SEQUENCE);
    EXPECT("SRS", CANOPY_RUNNING, "ab");
    bench.script.log[0] = '\0';
    canopy_tree_halt(&bench.instance);
    canopy_tree_halt(&bench.instance);
    TEST_ASSERT_EQUAL_STRING("b!", bench.script.log);
    TEST_ASSERT_EQUAL(CANOPY_IDLE, canopy_tree_status(&bench.instance, 0));
    EXPECT("SSS", CANOPY_SUCCESS, "abc");
}

static void statuses_are_kept_for_monitors(void)
{
    start_three_actions(CANOPY_NODE_REACTIVE_FALLBACK);
    EXPECT("FRS", CANOPY_RUNNING, "ab");
    TEST_ASSERT_EQUAL(CANOPY_FAILURE, canopy_tree_status(&bench.instance, 1));
    TEST_ASSERT_EQUAL(CANOPY_RUNNING, canopy_tree_status(&bench.instance, 2));
    TEST_ASSERT_EQUAL(CANOPY_IDLE, canopy_tree_status(&bench.instance, 3));
    EXPECT("SRS", CANOPY_SUCCESS, "ab!");
    TEST_ASSERT_EQUAL(CANOPY_IDLE, canopy_tree_status(&bench.instance, 1));
    TEST_ASSERT_EQUAL(CANOPY_CODE_RESET + CANOPY_SUCCESS, canopy_tree_status_code(&bench.instance, 1));
    TEST_ASSERT_EQUAL(CANOPY_CODE_RESET + CANOPY_RUNNING, canopy_tree_status_code(&bench.instance, 2));
}

static void a_single_leaf_is_a_tree(void)
{
    static const canopy_node_t nodes[] = {ACTION(0, 0, 0)};

    START(nodes, none);
    EXPECT("R", CANOPY_RUNNING, "a");
    EXPECT("R", CANOPY_RUNNING, "a'");
    EXPECT("S", CANOPY_SUCCESS, "a'");
    EXPECT("F", CANOPY_FAILURE, "a");
}

static void expect_statuses(const char *expected, unsigned line)
{
    static const char letters[] = "IRSFK";
    char seen[NODES_MAX] = "";

    for (uint16_t node = 0; node < bench.tree.node_count; node++) {
        seen[node] = letters[canopy_tree_status(&bench.instance, node)];
    }
    UNITY_TEST_ASSERT_EQUAL_STRING(expected, seen, line, "statuses of the nodes");
}

#define EXPECT_STATUSES(expected) expect_statuses(expected, __LINE__)

/* Conditions, which Sequence and Fallback tick in a loop of their own, and an action between them. */
static void children_keep_their_status_while_the_node_runs_and_are_idle_when_it_is_done(void)
{
    static canopy_node_t nodes[] = {INNER(SEQUENCE, 0, 5, 0, 0), CONDITION(0, 1, 0), CONDITION(0, 2, 1),
                                    ACTION(0, 3, 2), CONDITION(0, 4, 3)};

    nodes[0].type = (uint8_t)CANOPY_NODE_SEQUENCE;
    START(nodes, none);
    EXPECT("SKRS", CANOPY_RUNNING, "abc");
    EXPECT_STATUSES("RSKRI");
    EXPECT("FFRS", CANOPY_RUNNING, "c'");
    EXPECT_STATUSES("RSKRI");
    EXPECT("FFSF", CANOPY_FAILURE, "c'd");
    EXPECT_STATUSES("FIIII");
    EXPECT("SSRS", CANOPY_RUNNING, "abc");
    EXPECT("SSSS", CANOPY_SUCCESS, "c'd");
    EXPECT_STATUSES("SIIII");
    EXPECT("KKRK", CANOPY_RUNNING, "abc");
    EXPECT("KKKK", CANOPY_SKIPPED, "c'd");
    EXPECT_STATUSES("KIIII");

    nodes[0].type = (uint8_t)CANOPY_NODE_REACTIVE_FALLBACK;
    START(nodes, none);
    EXPECT("FKRS", CANOPY_RUNNING, "abc");
    EXPECT_STATUSES("RFKRI");
    EXPECT("KFRS", CANOPY_RUNNING, "abc'");
    EXPECT_STATUSES("RKFRI");
    EXPECT("FSRS", CANOPY_SUCCESS, "abc!");
    EXPECT_STATUSES("SIIII");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(children_keep_their_status_while_the_node_runs_and_are_idle_when_it_is_done);
    RUN_TEST(sequence_resumes_at_the_running_child);
    RUN_TEST(fallback_is_its_mirror_image);
    RUN_TEST(skipped_children_are_as_if_not_there);
    RUN_TEST(reactive_sequence_starts_at_the_first_child);
    RUN_TEST(reactive_fallback_starts_at_the_first_child);
    RUN_TEST(a_halted_child_is_started_anew);
    RUN_TEST(reactive_parallel_counts_all_children_every_tick);
    RUN_TEST(reactive_parallel_minus_one_means_all);
    RUN_TEST(reactive_parallel_needs_at_least_one_success);
    RUN_TEST(sequence_with_memory_goes_on_where_it_failed_or_was_halted);
    RUN_TEST(async_sequence_ends_the_tick_after_a_child_that_completed_at_once);
    RUN_TEST(async_fallback_is_its_mirror_image);
    RUN_TEST(parallel_remembers_what_has_completed);
    RUN_TEST(parallel_with_a_negative_threshold_counts_skipped_as_success);
    RUN_TEST(parallel_all_waits_for_every_child);
    RUN_TEST(if_then_else_asks_once);
    RUN_TEST(while_do_else_asks_every_tick_and_halts_the_other_branch);
    RUN_TEST(the_else_branch_may_be_missing);
    RUN_TEST(a_sequence_that_completes_later_leaves_its_children_idle);
    RUN_TEST(try_catch_fails_after_its_handler);
    RUN_TEST(try_catch_may_tick_its_handler_when_it_is_halted);
    RUN_TEST(a_halt_goes_deepest_first_and_once);
    RUN_TEST(halting_the_tree_follows_the_same_rule);
    RUN_TEST(statuses_are_kept_for_monitors);
    RUN_TEST(a_single_leaf_is_a_tree);
    return UNITY_END();
}
