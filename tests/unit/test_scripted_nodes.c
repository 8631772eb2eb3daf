/* SPDX-License-Identifier: MIT */
/** @file Nodes that ask scripts, and control nodes of the user's own. */
#include "canopy/node.h"
#include "scripted_leaves.h"

static bench_t bench;

/* Scripts 0..7 give what the test says, and write down that they were asked: 'A' + number. */
static int32_t answers[8];

static int32_t ask(void *application, uint16_t number)
{
    script_log(application, (uint16_t)('A' - 'a' + number), "");
    return answers[number];
}

#define SCRIPT(number)                                \
    static int32_t script_##number(void *application) \
    {                                                 \
        return ask(application, number);              \
    }
SCRIPT(0)
SCRIPT(1)
SCRIPT(2)
SCRIPT(3)
SCRIPT(4)
SCRIPT(5)
SCRIPT(6)
SCRIPT(7)
static const canopy_script_t scripts[] = {script_0, script_1, script_2, script_3,
                                          script_4, script_5, script_6, script_7};

/* A control node of the user's own, as in "round robin": one child a tick, the next one in the next tick. */
static uint16_t turn;

static canopy_step_t round_robin_enter(canopy_tree_instance_t *self, uint16_t node)
{
    if (turn == 0u || turn == self->tree->nodes[node].end) {
        turn = (uint16_t)(node + 1u);
    }
    return turn;
}

static canopy_step_t round_robin_child(canopy_tree_instance_t *self, uint16_t node, uint16_t child,
                                       canopy_status_t status)
{
    if (status != CANOPY_RUNNING) {
        turn = self->tree->nodes[child].end;
        (void)canopy_reset_children(self, node, (uint16_t)(node + 1u));
    }
    return canopy_done(status);
}

static void round_robin_halt(canopy_tree_instance_t *self, uint16_t node)
{
    (void)self;
    (void)node;
    turn = 0;
}

/* One that answers what the test says, to see that the engine does not trust it. */
static canopy_step_t wrong_enter_answer;
static canopy_step_t wrong_child_answer;

static canopy_step_t wrong_enter(canopy_tree_instance_t *self, uint16_t node)
{
    (void)self;
    (void)node;
    return wrong_enter_answer;
}

static canopy_step_t wrong_child(canopy_tree_instance_t *self, uint16_t node, uint16_t child, canopy_status_t status)
{
    (void)self;
    (void)node;
    (void)child;
    (void)status;
    return wrong_child_answer;
}

static const canopy_control_t controls[] = {
    {.enter = round_robin_enter, .child = round_robin_child, .halt = round_robin_halt},
    {.enter = wrong_enter, .child = wrong_child},
};

void setUp(void)
{
    memset(answers, 0, sizeof answers);
    turn = 0;
}

void tearDown(void)
{
}

static void start(const canopy_node_t *nodes, uint16_t count, const int32_t *parameters, uint16_t parameter_count)
{
    static const canopy_node_t leaf[] = {ACTION(0, 0, 0)};

    bench_start(&bench, leaf, 1, parameters, parameter_count);
    bench.tree.nodes = nodes;
    bench.tree.node_count = count;
    bench.tree.scripts = scripts;
    bench.tree.script_count = 8;
    bench.tree.controls = controls;
    bench.tree.control_count = 2;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_validate(&bench.tree, NULL));
}

static void start_decorator(canopy_node_type_t type, const int32_t *parameters, uint16_t count)
{
    static canopy_node_t nodes[] = {INNER(ATTRIBUTES, 0, 2, 0, 0), ACTION(0, 1, 0)};

    nodes[0].type = (uint8_t)type;
    start(nodes, 2, parameters, count);
}

static const int32_t all_scripts[] = {0, 1, 2, 3, 4, 5, 6, 7};

static void attributes_are_asked_in_order_and_only_before_the_start(void)
{
    start_decorator(CANOPY_NODE_ATTRIBUTES, all_scripts, 8);
    answers[3] = 1;
    EXPECT("R", CANOPY_RUNNING, "ABCDa");
    EXPECT("R", CANOPY_RUNNING, "Da'");
    EXPECT("S", CANOPY_SUCCESS, "Da'EG");
    EXPECT("F", CANOPY_FAILURE, "ABCDaFG");
    EXPECT("K", CANOPY_SKIPPED, "ABCDa");
    answers[0] = 1;
    EXPECT("S", CANOPY_FAILURE, "AFG");
    answers[0] = 0;
    answers[1] = 1;
    EXPECT("S", CANOPY_SUCCESS, "ABEG");
    answers[1] = 0;
    answers[2] = 1;
    EXPECT("S", CANOPY_SKIPPED, "ABC");
    answers[2] = 0;
    answers[3] = 0;
    EXPECT("S", CANOPY_SKIPPED, "ABCD");
}

static void a_false_while_halts_and_so_does_a_halt_from_above(void)
{
    start_decorator(CANOPY_NODE_ATTRIBUTES, all_scripts, 8);
    answers[3] = 1;
    EXPECT("R", CANOPY_RUNNING, "ABCDa");
    answers[3] = 0;
    EXPECT("R", CANOPY_SKIPPED, "Da!H");
    answers[3] = 1;
    EXPECT("R", CANOPY_RUNNING, "ABCDa");
    bench.script.log[0] = '\0';
    canopy_tree_halt(&bench.instance);
    TEST_ASSERT_EQUAL_STRING("a!H", bench.script.log);
}

static void attributes_that_are_not_given_cost_nothing(void)
{
    static const int32_t none[] = {-1, -1, -1, -1, -1, -1, -1, -1};

    start_decorator(CANOPY_NODE_ATTRIBUTES, none, 8);
    EXPECT("R", CANOPY_RUNNING, "a");
    EXPECT("S", CANOPY_SUCCESS, "a'");
}

static void precondition_asks_while_its_child_is_not_running(void)
{
    static const int32_t parameters[] = {0, CANOPY_RUNNING};

    start_decorator(CANOPY_NODE_PRECONDITION, parameters, 2);
    EXPECT("S", CANOPY_RUNNING, "A");
    answers[0] = 1;
    EXPECT("R", CANOPY_RUNNING, "Aa");
    answers[0] = 0;
    EXPECT("S", CANOPY_SUCCESS, "a'");
    EXPECT("S", CANOPY_RUNNING, "A");
}

static void entries_are_new_once(void)
{
    static const int32_t entry[] = {2};

    start_decorator(CANOPY_NODE_SKIP_UNLESS_UPDATED, entry, 1);
    EXPECT("S", CANOPY_SKIPPED, "C");
    answers[2] = 1;
    EXPECT("R", CANOPY_RUNNING, "Ca");
    EXPECT("R", CANOPY_RUNNING, "a'");
    EXPECT("S", CANOPY_SUCCESS, "a'");
    EXPECT("S", CANOPY_SKIPPED, "C");
    start_decorator(CANOPY_NODE_WAIT_VALUE_UPDATE, entry, 1);
    answers[2] = 0;
    EXPECT("S", CANOPY_RUNNING, "C");
    answers[2] = 0x12345;
    EXPECT("S", CANOPY_SUCCESS, "Ca");
    EXPECT("S", CANOPY_RUNNING, "C");
}

static void was_entry_updated_is_a_leaf(void)
{
    static const canopy_node_t nodes[] = {INNER(WAS_ENTRY_UPDATED, 0, 1, 0, 0)};
    static const int32_t entry[] = {5};

    start(nodes, 1, entry, 1);
    EXPECT("", CANOPY_FAILURE, "F");
    answers[5] = 9;
    EXPECT("", CANOPY_SUCCESS, "F");
    EXPECT("", CANOPY_FAILURE, "F");
}

static void a_test_node_waits_then_runs_its_scripts(void)
{
    static const canopy_node_t nodes[] = {INNER(TEST_NODE, 0, 1, 0, 0)};
    static const int32_t succeeds[] = {CANOPY_SUCCESS, 2, 0, 1, 2};
    static const int32_t fails[] = {CANOPY_FAILURE, 0, 0, 1, 2};
    static const int32_t is_skipped[] = {CANOPY_SKIPPED, 0, 0, 1, -1};

    start(nodes, 1, succeeds, 5);
    EXPECT_AT(1000, "", CANOPY_RUNNING, "");
    EXPECT_AT(2999, "", CANOPY_RUNNING, "");
    EXPECT_AT(3000, "", CANOPY_SUCCESS, "AC");
    /* A halt stops the clock. */
    EXPECT_AT(4000, "", CANOPY_RUNNING, "");
    canopy_tree_halt(&bench.instance);
    EXPECT_AT(6000, "", CANOPY_RUNNING, "");
    EXPECT_AT(8000, "", CANOPY_SUCCESS, "AC");
    start(nodes, 1, fails, 5);
    EXPECT("", CANOPY_FAILURE, "BC");
    start(nodes, 1, is_skipped, 5);
    EXPECT("", CANOPY_SKIPPED, "");
}

static void loop_takes_one_item_a_tick(void)
{
    static const int32_t parameters[] = {0, CANOPY_SUCCESS};

    start_decorator(CANOPY_NODE_LOOP, parameters, 2);
    answers[0] = 1;
    EXPECT("S", CANOPY_RUNNING, "Aa");
    EXPECT("R", CANOPY_RUNNING, "Aa");
    EXPECT("S", CANOPY_RUNNING, "a'");
    answers[0] = 0;
    EXPECT("S", CANOPY_SUCCESS, "A");
    answers[0] = 1;
    EXPECT("F", CANOPY_FAILURE, "Aa");
}

static void switch_ticks_the_matching_case_and_halts_the_old_one(void)
{
    static const canopy_node_t nodes[] = {INNER(SWITCH, 0, 4, 0, 0), ACTION(0, 1, 0), ACTION(0, 2, 1), ACTION(0, 3, 2)};
    static const int32_t script[] = {0};

    start(nodes, 4, script, 1);
    answers[0] = 1;
    EXPECT("SRS", CANOPY_RUNNING, "Ab");
    EXPECT("SRS", CANOPY_RUNNING, "Ab'");
    answers[0] = 0;
    EXPECT("RRS", CANOPY_RUNNING, "Ab!a");
    answers[0] = 7;
    EXPECT("RRK", CANOPY_SKIPPED, "Aa!c");
    answers[0] = -1;
    EXPECT("RRF", CANOPY_FAILURE, "Ac");
}

static void a_control_node_of_the_users_own(void)
{
    static const canopy_node_t nodes[] = {INNER(USER_CONTROL, 0, 4, 0, 0), ACTION(0, 1, 0), ACTION(0, 2, 1),
                                          ACTION(0, 3, 2)};

    start(nodes, 4, all_scripts, 1);
    EXPECT("SRF", CANOPY_SUCCESS, "a");
    EXPECT("SRF", CANOPY_RUNNING, "b");
    EXPECT("SSF", CANOPY_SUCCESS, "b'");
    EXPECT("SSF", CANOPY_FAILURE, "c");
    EXPECT("RSF", CANOPY_RUNNING, "a");
    canopy_tree_halt(&bench.instance);
    TEST_ASSERT_EQUAL_UINT16(0, turn);
}

static void wrong_answers_of_a_users_node_are_faults(void)
{
    static const canopy_node_t nodes[] = {{.type = CANOPY_NODE_USER_CONTROL, .end = 5, .leaf = 1},
                                          ACTION(0, 1, 0),
                                          INNER(INVERTER, 0, 4, 0, 0),
                                          ACTION(2, 3, 1),
                                          ACTION(0, 4, 2)};
    static const canopy_step_t wrong[] = {0, 3, 5, 77, CANOPY_STEP_DONE, CANOPY_STEP_DONE + 5u, UINT32_MAX};

    start(nodes, 5, all_scripts, 1);
    for (unsigned which = 0; which < sizeof wrong / sizeof wrong[0]; which++) {
        wrong_enter_answer = wrong[which];
        EXPECT("SSS", CANOPY_FAILURE, "");
        TEST_ASSERT_EQUAL_UINT32(which + 1u, bench.instance.faults);
    }
    /* A child again, or an earlier one, would break rule 3. */
    wrong_enter_answer = 2;
    wrong_child_answer = 2;
    EXPECT("SSS", CANOPY_FAILURE, "b");
    wrong_child_answer = 1;
    EXPECT("SSS", CANOPY_FAILURE, "b");
    wrong_child_answer = canopy_done(CANOPY_SUCCESS);
    EXPECT("SSS", CANOPY_SUCCESS, "b");
    TEST_ASSERT_EQUAL(CANOPY_IDLE, canopy_tree_status(&bench.instance, 2));
}

static void a_parameter_may_be_a_script(void)
{
    static const canopy_node_t nodes[] = {{.type = CANOPY_NODE_REPEAT, .end = 2, .asks = 1}, ACTION(0, 1, 0)};
    static canopy_node_t wrong[] = {{.type = CANOPY_NODE_REPEAT, .end = 2, .asks = 2}, ACTION(0, 1, 0)};
    static const int32_t script[] = {3};
    static const int32_t no_script[] = {8};

    answers[3] = 2;
    start(nodes, 2, script, 1);
    EXPECT("S", CANOPY_RUNNING, "DaD");
    EXPECT("S", CANOPY_SUCCESS, "DaD");
    bench.tree.parameters = no_script;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_TREE, canopy_tree_validate(&bench.tree, NULL));
    bench.tree.parameters = script;
    bench.tree.nodes = wrong;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_TREE, canopy_tree_validate(&bench.tree, NULL));
}

static void a_number_of_cycles_that_becomes_0_halts_the_child(void)
{
    static const canopy_node_t nodes[] = {{.type = CANOPY_NODE_REPEAT, .end = 2, .asks = 1}, ACTION(0, 1, 0)};
    static const int32_t script[] = {3};

    answers[3] = 2;
    start(nodes, 2, script, 1);
    EXPECT("R", CANOPY_RUNNING, "DaD");
    answers[3] = 0;
    EXPECT("R", CANOPY_SUCCESS, "Da!");
    TEST_ASSERT_EQUAL(CANOPY_IDLE, canopy_tree_status(&bench.instance, 1));
    EXPECT("R", CANOPY_SUCCESS, "D");
}

static void refuses(const int32_t *parameters, canopy_node_type_t type)
{
    static canopy_node_t nodes[] = {INNER(ATTRIBUTES, 0, 2, 0, 0), ACTION(0, 1, 0)};

    nodes[0].type = (uint8_t)type;
    bench.tree.nodes = nodes;
    bench.tree.node_count = 2;
    bench.tree.parameters = parameters;
    bench.tree.parameter_count = 8;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_TREE, canopy_tree_validate(&bench.tree, NULL));
}

static void the_validator_refuses_scripts_and_statuses_that_are_none(void)
{
    static const int32_t beyond[] = {8, CANOPY_SUCCESS, 0, 0, 0, 0, 0, 0};
    static const int32_t below[] = {-1, CANOPY_SUCCESS, 0, 0, 0, 0, 0, 0};
    static const int32_t last_below[] = {0, 0, 0, 0, 0, 0, 0, -2};
    static const int32_t idle[] = {0, CANOPY_IDLE, 0, 0, 0, 0, 0, 0};
    static const int32_t no_status[] = {0, 5, 0, 0, 0, 0, 0, 0};
    static const int32_t test_of_none[] = {CANOPY_SUCCESS, 0, 0, 0, 8, 0, 0, 0};
    static const int32_t first_of_none[] = {CANOPY_SUCCESS, 0, 8, 0, 0, 0, 0, 0};
    static const int32_t long_delay[] = {CANOPY_SUCCESS, 5000, 0, 0, 0, 0, 0, 0};
    static const canopy_node_t test_node[] = {INNER(TEST_NODE, 0, 1, 0, 0)};

    start_decorator(CANOPY_NODE_ATTRIBUTES, all_scripts, 8);
    refuses(beyond, CANOPY_NODE_ATTRIBUTES);
    refuses(last_below, CANOPY_NODE_ATTRIBUTES);
    refuses(beyond, CANOPY_NODE_PRECONDITION);
    refuses(below, CANOPY_NODE_LOOP);
    refuses(idle, CANOPY_NODE_PRECONDITION);
    refuses(no_status, CANOPY_NODE_LOOP);
    refuses(below, CANOPY_NODE_SKIP_UNLESS_UPDATED);
    refuses(beyond, CANOPY_NODE_WAIT_VALUE_UPDATE);
    bench.tree.nodes = test_node;
    bench.tree.node_count = 1;
    bench.tree.parameters = idle;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_TREE, canopy_tree_validate(&bench.tree, NULL));
    bench.tree.parameters = test_of_none;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_TREE, canopy_tree_validate(&bench.tree, NULL));
    bench.tree.parameters = first_of_none;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_TREE, canopy_tree_validate(&bench.tree, NULL));
    bench.tree.parameters = long_delay; /* is no script's number */
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_validate(&bench.tree, NULL));
    bench.tree.control_count = 0;
    refuses(all_scripts, CANOPY_NODE_USER_DECORATOR);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(attributes_are_asked_in_order_and_only_before_the_start);
    RUN_TEST(a_false_while_halts_and_so_does_a_halt_from_above);
    RUN_TEST(attributes_that_are_not_given_cost_nothing);
    RUN_TEST(precondition_asks_while_its_child_is_not_running);
    RUN_TEST(entries_are_new_once);
    RUN_TEST(was_entry_updated_is_a_leaf);
    RUN_TEST(a_test_node_waits_then_runs_its_scripts);
    RUN_TEST(loop_takes_one_item_a_tick);
    RUN_TEST(switch_ticks_the_matching_case_and_halts_the_old_one);
    RUN_TEST(a_control_node_of_the_users_own);
    RUN_TEST(wrong_answers_of_a_users_node_are_faults);
    RUN_TEST(a_parameter_may_be_a_script);
    RUN_TEST(a_number_of_cycles_that_becomes_0_halts_the_child);
    RUN_TEST(the_validator_refuses_scripts_and_statuses_that_are_none);
    return UNITY_END();
}
