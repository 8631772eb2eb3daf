/* SPDX-License-Identifier: MIT */
/** @file The application "language": subtrees, blackboard entries, scripts, signals as names, nodes of the user's own. */
#include <string.h>

#include "fake_loop.h"
#include "language_app.h"
#include "unity.h"

enum { CLIMATE_ID = 0x18FECA15 };

void setUp(void)
{
    fake_loop_start(&language_app);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_validate(language_app.tree, NULL));
}

void tearDown(void)
{
}

/** One cycle without a frame. */
static void cycle(void)
{
    (void)fake_loop_cycle(0);
}

/** One cycle with a Climate frame: this raw temperature (0.5 degC, offset 10), this door. */
static void cycle_with(int16_t raw, uint8_t door)
{
    canopy_can_frame_t *frame = &fake.rx[0];

    *frame = (canopy_can_frame_t){.id = CLIMATE_ID, .flags = CANOPY_CAN_EXTENDED, .length = 8};
    frame->data[0] = (uint8_t)((uint16_t)raw >> 8);
    frame->data[1] = (uint8_t)((uint16_t)raw & 0xFFu);
    frame->data[2] = (uint8_t)(door | (0x1Du << 3)); /* Temperature2: -3 in 5 bits, that is 2 * -3 + 1 = -5 */
    (void)fake_loop_cycle(1);
}

static void subtrees_have_entries_of_their_own(void)
{
    cycle_with(0, 0);
    /* goal: 5, then + 3 by FindGoal's inout port. */
    TEST_ASSERT_EQUAL_INT32(8, language_entries->goal);
    /* own = level + 1, Dock adds 1000 to the same entry ({=}); above limit: doubled. */
    TEST_ASSERT_EQUAL_INT32(1009, language_entries->first_own);
    TEST_ASSERT_EQUAL_INT32(2018, language_entries->first_result);
    TEST_ASSERT_EQUAL_INT32(2018, language_entries->second_result);
    TEST_ASSERT_EQUAL_INT32(1010, language_entries->recharge_2_own);
    TEST_ASSERT_EQUAL_INT32(2020, language_entries->total);
}

static void autoremap_shares_names_but_private_ones_and_at_names_the_root(void)
{
    cycle_with(0, 0);
    TEST_ASSERT_EQUAL_INT32(9, language_entries->mapped);
    TEST_ASSERT_EQUAL_INT32(3, language_entries->mapped_private);
    TEST_ASSERT_EQUAL_INT32(3, language_entries->rooted);
}

static void the_programs_own_entries_begin_with_their_defaults(void)
{
    TEST_ASSERT_EQUAL_INT32(2, language_entries->attempts);
    TEST_ASSERT_EQUAL_INT8(1, language_entries->mode);
    TEST_ASSERT_TRUE(language_entries->every_second);
    language_entries->attempts = 9;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &fake_loop_config));
    TEST_ASSERT_EQUAL_INT32(2, language_entries->attempts);
}

static void parameters_of_built_in_nodes_may_be_entries(void)
{
    language_entries->attempts = 3;
    for (unsigned tick = 0; tick < 3; tick++) {
        cycle_with(0, 0);
    }
    TEST_ASSERT_EQUAL_UINT16(3, language_entries->failures);
    cycle_with(0, 0);
    /* Retry has failed; ParallelAll does not tick it again. */
    TEST_ASSERT_EQUAL_UINT16(3, language_entries->failures);
}

static void signals_are_compared_in_physical_units(void)
{
    /* 10.25 lies between two raw values: 0 is 10.0, below; then the fan stays at its safe values. */
    cycle_with(0, 0);
    TEST_ASSERT_EQUAL_UINT16(100, language_output->fan.speed);
    /* 10.5 is not, and the door is shut: the sequence writes. */
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &fake_loop_config));
    cycle_with(1, 0);
    TEST_ASSERT_EQUAL_UINT16(123, language_output->fan.speed);
    TEST_ASSERT_EQUAL_UINT8(LANGUAGE_FAN_MODE_LOW_NOISE, language_output->fan.mode);
    TEST_ASSERT_FALSE(language_output->fan.turbo);
    TEST_ASSERT_EQUAL_INT8(-100, language_output->fan.trim);
    /* 20.0 with the door open. */
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &fake_loop_config));
    cycle_with(20, 2);
    TEST_ASSERT_EQUAL_UINT16(100, language_output->fan.speed);
}

static void fixed_point_is_counted_in_steps(void)
{
    /* 10.5 degC: Scale sees its literal in quarters, the signal in tenths, and hands on the gain, -1.25 + 0.25. */
    cycle_with(1, 2);
    TEST_ASSERT_EQUAL_INT16(-100, language_entries->scaled);
    TEST_ASSERT_EQUAL_INT16(-100, language_entries->scaled_copy);
    TEST_ASSERT_EQUAL_INT8(-101, language_entries->trimmed);
    TEST_ASSERT_EQUAL_INT16(50, language_entries->gain);
    TEST_ASSERT_EQUAL_INT32(50, language_entries->whole);
    TEST_ASSERT_EQUAL_UINT16(50, language_output->fan.ticks);
    TEST_ASSERT_EQUAL_UINT32(0, language_entries->script_faults);
    /* What does not fit is limited, and counted: 10 * 327.67 - 0.1 in steps of 0.1 is above 12.7. */
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &fake_loop_config));
    language_entries->gain = INT16_MAX;
    cycle();
    TEST_ASSERT_EQUAL_INT16(INT16_MAX, language_entries->gain);
    TEST_ASSERT_EQUAL_INT8(INT8_MAX, language_entries->trimmed);
    TEST_ASSERT_EQUAL_UINT32(2, language_entries->script_faults);
}

static void scripts_that_read_stale_signals_are_false(void)
{
    cycle();
    TEST_ASSERT_EQUAL_UINT16(100, language_output->fan.speed);
    /* UseGoal's port reads the bus: it is not called. Before it, everything ran. */
    TEST_ASSERT_EQUAL_INT32(9, language_entries->mapped);
}

static void a_switch_takes_the_case_that_matches(void)
{
    static const int8_t modes[] = {1, 2, -3, 4};
    static const int32_t chosen[] = {1, 2, 3, 4};

    for (unsigned which = 0; which < 4; which++) {
        TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &fake_loop_config));
        language_entries->mode = modes[which];
        cycle();
        TEST_ASSERT_EQUAL_INT32(chosen[which], language_entries->chosen);
    }
}

static void a_switch_over_a_stale_signal_takes_the_default(void)
{
    cycle();
    TEST_ASSERT_EQUAL_INT32(3, language_entries->seen_door);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &fake_loop_config));
    cycle_with(0, 0);
    TEST_ASSERT_EQUAL_INT32(1, language_entries->seen_door);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &fake_loop_config));
    cycle_with(0, 2);
    TEST_ASSERT_EQUAL_INT32(2, language_entries->seen_door);
}

static void texts_are_places_in_a_table(void)
{
    cycle_with(0, 0);
    TEST_ASSERT_EQUAL_STRING("green", language_texts[language_entries->text]);
}

static void leaves_write_texts_and_queues_of_texts(void)
{
    static const char *const said[] = {"light green", "red"};

    cycle();
    TEST_ASSERT_EQUAL_STRING("light green", language_texts[language_entries->colour]);
    TEST_ASSERT_EQUAL_STRING("red", language_texts[language_entries->text_before]);
    for (unsigned tick = 0; tick < 2u; tick++) {
        TEST_ASSERT_EQUAL_STRING(said[tick], language_texts[language_entries->next_colour]);
        TEST_ASSERT_EQUAL_UINT16(1u - tick, language_entries->colours.count);
        cycle();
    }
}

static void a_loop_takes_one_item_a_tick(void)
{
    static const int32_t sums[] = {10, 20, -30};

    for (unsigned tick = 0; tick < 3; tick++) {
        cycle();
        TEST_ASSERT_EQUAL_INT32(sums[tick], language_entries->sum);
    }
}

static void a_loop_takes_the_items_of_an_entry(void)
{
    static const int32_t sums[] = {5, 75, 975, 975};

    for (unsigned tick = 0; tick < 4; tick++) {
        cycle();
        TEST_ASSERT_EQUAL_INT32(sums[tick], language_entries->queue_sum);
        TEST_ASSERT_EQUAL_UINT16(tick < 3u ? 2u - tick : 0u, language_entries->queue.count);
    }
    /* A count beyond the capacity is limited, and counted. */
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &fake_loop_config));
    cycle();
    language_entries->queue.count = 9;
    cycle();
    TEST_ASSERT_EQUAL_UINT16(2, language_entries->queue.count);
    TEST_ASSERT_EQUAL_UINT32(1, language_entries->script_faults);
}

static void updates_are_counted_where_a_node_waits_for_them(void)
{
    cycle();
    TEST_ASSERT_EQUAL_INT32(5 + 3, language_entries->copy);
    TEST_ASSERT_EQUAL_INT32(0, language_entries->seen);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &fake_loop_config));
    language_entries->mode_updates++;
    cycle();
    TEST_ASSERT_EQUAL_INT32(1, language_entries->seen);
}

static void test_nodes_stand_in_for_leaves(void)
{
    cycle();
    cycle();
    TEST_ASSERT_EQUAL_INT32(0, language_entries->stand_in);
    cycle(); /* 20 ms after the first */
    TEST_ASSERT_EQUAL_INT32(2, language_entries->stand_in);
    TEST_ASSERT_EQUAL_INT32(11, language_entries->posts);
}

static void a_script_cleans_up_after_a_try_that_is_halted(void)
{
    cycle(); /* the loop's first item, and Sleep starts */
    TEST_ASSERT_FALSE(language_entries->cleaned_up);
    cycle(); /* the second one makes the condition true: Sleep is halted */
    TEST_ASSERT_TRUE(language_entries->cleaned_up);
}

static void control_nodes_and_decorators_of_the_users_own(void)
{
    language_entries->mode = 2;
    language_entries->every_second = true;
    cycle_with(0, 0);
    /* first="1": the second child, a script. The decorator waits. */
    TEST_ASSERT_TRUE(language_entries->robin);
    TEST_ASSERT_EQUAL_UINT32(1, language_entries->turns);
    TEST_ASSERT_FALSE(language_entries->every);
    cycle_with(0, 0);
    TEST_ASSERT_TRUE(language_entries->every);
    TEST_ASSERT_FALSE(language_entries->every_second);
}

static void nothing_was_limited(void)
{
    cycle_with(0, 0);
    TEST_ASSERT_EQUAL_UINT32(0, language_entries->script_faults);
    TEST_ASSERT_EQUAL_UINT32(0, language_app.tree_instance->faults);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(subtrees_have_entries_of_their_own);
    RUN_TEST(autoremap_shares_names_but_private_ones_and_at_names_the_root);
    RUN_TEST(the_programs_own_entries_begin_with_their_defaults);
    RUN_TEST(parameters_of_built_in_nodes_may_be_entries);
    RUN_TEST(signals_are_compared_in_physical_units);
    RUN_TEST(fixed_point_is_counted_in_steps);
    RUN_TEST(scripts_that_read_stale_signals_are_false);
    RUN_TEST(a_switch_takes_the_case_that_matches);
    RUN_TEST(a_switch_over_a_stale_signal_takes_the_default);
    RUN_TEST(texts_are_places_in_a_table);
    RUN_TEST(leaves_write_texts_and_queues_of_texts);
    RUN_TEST(a_loop_takes_one_item_a_tick);
    RUN_TEST(a_loop_takes_the_items_of_an_entry);
    RUN_TEST(updates_are_counted_where_a_node_waits_for_them);
    RUN_TEST(test_nodes_stand_in_for_leaves);
    RUN_TEST(a_script_cleans_up_after_a_try_that_is_halted);
    RUN_TEST(control_nodes_and_decorators_of_the_users_own);
    RUN_TEST(nothing_was_limited);
    return UNITY_END();
}
