/* SPDX-License-Identifier: MIT */
/** @file Raw values, and whose write to an output stands (rule 5 of docs/semantics.md). */
#include "canopy/signal.h"
#include "canopy/tree.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static void signed_values_are_extended(void)
{
    TEST_ASSERT_EQUAL_INT32(-1, canopy_sign_extend32(0xFFFFFFu, 24));
    TEST_ASSERT_EQUAL_INT32(-8388608, canopy_sign_extend32(0x800000u, 24));
    TEST_ASSERT_EQUAL_INT32(8388607, canopy_sign_extend32(0x7FFFFFu, 24));
    TEST_ASSERT_EQUAL_INT32(-1, canopy_sign_extend32(1, 1));
    TEST_ASSERT_TRUE(canopy_sign_extend64(UINT64_C(0x8000000000), 40) == -INT64_C(0x8000000000));
}

static void a_ticked_write_wins_over_a_halt_handlers_whichever_came_first(void)
{
    uint32_t written[2] = {0};

    TEST_ASSERT_TRUE(canopy_output_claim(written, 33, true));
    TEST_ASSERT_TRUE(canopy_output_claim(written, 33, false));
    TEST_ASSERT_FALSE(canopy_output_claim(written, 33, true));
    TEST_ASSERT_TRUE(canopy_output_claim(written, 33, false));
    TEST_ASSERT_TRUE(canopy_output_claim(written, 1, true));
}

/* One output and its setter, as the compiler makes them: 100 while driving, 5 by the halt handler, 0 is safe. */
static struct {
    uint32_t written[1];
    bool halting;
    int speed;
} motor;

static canopy_status_t arrived_says;

static void set_speed(int speed)
{
    if (canopy_output_claim(motor.written, 0, motor.halting)) {
        motor.speed = speed;
    }
}

static canopy_status_t drive(void *application, uint16_t parameter)
{
    (void)application;
    (void)parameter;
    set_speed(100);
    return CANOPY_RUNNING;
}

static void drive_halted(void *application, uint16_t parameter)
{
    (void)application;
    (void)parameter;
    motor.halting = true;
    set_speed(5);
    motor.halting = false;
}

static canopy_status_t arrived(void *application, uint16_t parameter)
{
    (void)application;
    (void)parameter;
    return arrived_says;
}

static canopy_tree_instance_t driving;

/** RunOnce, and below it a parallel node of two children, so that it runs to its end and is not started again. */
static void start_driving(canopy_node_type_t parallel, canopy_node_type_t first, canopy_node_type_t second)
{
    static const int32_t parameters[] = {1, 1};
    static const canopy_leaf_t leaves[] = {{.tick = arrived},
                                           {.tick = drive, .running = drive, .halted = drive_halted}};
    static canopy_node_t nodes[4];
    static canopy_tree_t tree = {.nodes = nodes,
                                 .leaves = leaves,
                                 .parameters = parameters,
                                 .node_count = 4,
                                 .leaf_count = 2,
                                 .parameter_count = 2,
                                 .word_count = 5};
    static uint8_t status[4];
    static uint16_t words[5];

    nodes[0] = (canopy_node_t){.type = CANOPY_NODE_RUN_ONCE, .end = 4};
    nodes[1] = (canopy_node_t){.type = (uint8_t)parallel, .end = 4, .state = 1};
    nodes[2] =
        (canopy_node_t){.type = (uint8_t)first, .parent = 1, .end = 3, .leaf = first == CANOPY_NODE_STATEFUL_ACTION};
    nodes[3] =
        (canopy_node_t){.type = (uint8_t)second, .parent = 1, .end = 4, .leaf = second == CANOPY_NODE_STATEFUL_ACTION};
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_validate(&tree, NULL));
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_init(&driving, &tree, status, words, NULL));
}

static int speed_after_tick(canopy_status_t arrived_status)
{
    motor.written[0] = 0;
    motor.speed = 0;
    arrived_says = arrived_status;
    (void)canopy_tree_tick(&driving, 0);
    return motor.speed;
}

/* Rule 5: ticked and halted in one tick, the child keeps what it wrote; in the next tick it is safe. */
static void a_child_of_a_parallel_ticked_and_halted_in_one_tick_keeps_what_it_wrote(void)
{
    start_driving(CANOPY_NODE_REACTIVE_PARALLEL, CANOPY_NODE_STATEFUL_ACTION, CANOPY_NODE_CONDITION);
    TEST_ASSERT_EQUAL_INT(100, speed_after_tick(CANOPY_FAILURE));
    TEST_ASSERT_EQUAL_INT(100, speed_after_tick(CANOPY_SUCCESS));
    TEST_ASSERT_EQUAL(CANOPY_IDLE, canopy_tree_status(&driving, 2));
    TEST_ASSERT_EQUAL_INT(0, speed_after_tick(CANOPY_SUCCESS));
}

/* A Parallel asks its thresholds after each child: one that comes before the action ends it before it is ticked. */
static void a_child_that_is_halted_and_not_ticked_leaves_what_its_handler_wrote(void)
{
    start_driving(CANOPY_NODE_PARALLEL, CANOPY_NODE_CONDITION, CANOPY_NODE_STATEFUL_ACTION);
    TEST_ASSERT_EQUAL_INT(100, speed_after_tick(CANOPY_SKIPPED));
    TEST_ASSERT_EQUAL_INT(5, speed_after_tick(CANOPY_SUCCESS));
    TEST_ASSERT_EQUAL_INT(0, speed_after_tick(CANOPY_SUCCESS));
}

static void constants_round_to_the_nearest_raw_value(void)
{
    const volatile double not_folded = -0.48; /* the same at run time */
    const int32_t raw = CANOPY_RAW(int32_t, not_folded, 0.001, 0.0);

    TEST_ASSERT_EQUAL_INT32(-480, raw);
    TEST_ASSERT_EQUAL_INT32(480, CANOPY_RAW(int32_t, 0.48, 0.001, 0.0));
    TEST_ASSERT_EQUAL_INT32(-480, CANOPY_RAW(int32_t, -0.48, 0.001, 0.0));
    TEST_ASSERT_EQUAL_INT32(29, CANOPY_RAW(int32_t, 0.29, 0.01, 0.0));
    TEST_ASSERT_EQUAL_INT32(140, CANOPY_RAW(int32_t, 100, 1.0, -40.0));
}

static void fixed_point_values_become_the_nearest_raw_one(void)
{
    /* 0.05 a bit, from -1.00 on, in hundredths. */
    TEST_ASSERT_EQUAL_INT64(20, canopy_raw_of_fixed(0, 5, -100, 0, 255));
    TEST_ASSERT_EQUAL_INT64(20, canopy_raw_of_fixed(2, 5, -100, 0, 255));
    TEST_ASSERT_EQUAL_INT64(21, canopy_raw_of_fixed(3, 5, -100, 0, 255));
    TEST_ASSERT_EQUAL_INT64(0, canopy_raw_of_fixed(-100, 5, -100, 0, 255));
    TEST_ASSERT_EQUAL_INT64(0, canopy_raw_of_fixed(INT64_MIN, 5, -100, 0, 255));
    TEST_ASSERT_EQUAL_INT64(255, canopy_raw_of_fixed(INT64_MAX, 5, -100, 0, 255));
    /* Halves go away from 0. */
    TEST_ASSERT_EQUAL_INT64(3, canopy_raw_of_fixed(5, 2, 0, -9, 9));
    TEST_ASSERT_EQUAL_INT64(-3, canopy_raw_of_fixed(-5, 2, 0, -9, 9));
    TEST_ASSERT_EQUAL_INT64(-1, canopy_raw_of_fixed(-4, 3, 0, -9, 9));
    /* A scale below 0 turns the range round. */
    TEST_ASSERT_EQUAL_INT64(-3, canopy_raw_of_fixed(5, -2, 0, -9, 9));
    TEST_ASSERT_EQUAL_INT64(3, canopy_raw_of_fixed(-5, -2, 0, -9, 9));
    TEST_ASSERT_EQUAL_INT64(-9, canopy_raw_of_fixed(INT64_MAX, -2, 0, -9, 9));
    TEST_ASSERT_EQUAL_INT64(9, canopy_raw_of_fixed(INT64_MIN, -2, 0, -9, 9));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(signed_values_are_extended);
    RUN_TEST(a_ticked_write_wins_over_a_halt_handlers_whichever_came_first);
    RUN_TEST(a_child_of_a_parallel_ticked_and_halted_in_one_tick_keeps_what_it_wrote);
    RUN_TEST(a_child_that_is_halted_and_not_ticked_leaves_what_its_handler_wrote);
    RUN_TEST(constants_round_to_the_nearest_raw_value);
    RUN_TEST(fixed_point_values_become_the_nearest_raw_one);
    return UNITY_END();
}
