/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The plant of Examples 4 and 5: every branch of both parts, the paper's two runs, and Lemma 10. That the runs equal
 * exact arithmetic tick by tick is shown in tests/integration/test_plant_exact.py.
 */
#include "canopy_sim/nao.h"

#include "unity.h"

#include <stddef.h>

/* A mode that no enumerator names, as a corrupt command could hold one. */
#define NO_MODE 77

static canopy_sim_nao_t nao;

void setUp(void)
{
    canopy_sim_nao_init(&nao);
}

void tearDown(void)
{
}

static void set_power(int64_t distance_nm, int32_t battery)
{
    TEST_ASSERT_TRUE(canopy_sim_power_set(&nao.power, distance_nm, battery));
}

static void set_posture(int32_t head_x_mm, int32_t head_height_mm)
{
    TEST_ASSERT_TRUE(canopy_sim_posture_set(&nao.posture, head_x_mm, head_height_mm));
}

static void expect_power(int64_t distance_nm, int32_t battery)
{
    TEST_ASSERT_EQUAL_INT64(distance_nm, nao.power.distance_nm);
    TEST_ASSERT_EQUAL_INT32(battery, nao.power.battery);
}

static void expect_posture(int32_t head_x_mm, int32_t head_height_mm)
{
    TEST_ASSERT_EQUAL_INT32(head_x_mm, nao.posture.head_x_mm);
    TEST_ASSERT_EQUAL_INT32(head_height_mm, nao.posture.head_height_mm);
}

static void test_begins_where_the_examples_begin(void)
{
    expect_power(80 * CANOPY_SIM_NM_PER_M, 500);
    TEST_ASSERT_FALSE(nao.power.charging);
    expect_posture(500, 0);
}

static void test_power_set_refuses_what_is_out_of_range(void)
{
    TEST_ASSERT_FALSE(canopy_sim_power_set(&nao.power, CANOPY_SIM_DISTANCE_MIN_NM - 1, 500));
    TEST_ASSERT_FALSE(canopy_sim_power_set(&nao.power, CANOPY_SIM_DISTANCE_MAX_NM + 1, 500));
    TEST_ASSERT_FALSE(canopy_sim_power_set(&nao.power, 0, -1));
    TEST_ASSERT_FALSE(canopy_sim_power_set(&nao.power, 0, CANOPY_SIM_BATTERY_MAX + 1));
    expect_power(80 * CANOPY_SIM_NM_PER_M, 500);
    set_power(CANOPY_SIM_DISTANCE_MIN_NM, 0);
    expect_power(CANOPY_SIM_DISTANCE_MIN_NM, 0);
    set_power(CANOPY_SIM_DISTANCE_MAX_NM, CANOPY_SIM_BATTERY_MAX);
    expect_power(CANOPY_SIM_DISTANCE_MAX_NM, CANOPY_SIM_BATTERY_MAX);
}

static void test_stop_and_unknown_modes_change_nothing(void)
{
    canopy_sim_nao_step(&nao, CANOPY_SIM_POWER_STOP, CANOPY_SIM_POSTURE_STOP);
    /* NOLINTNEXTLINE(clang-analyzer-optin.core.EnumCastOutOfRange): a mode out of range is the test's point. */
    canopy_sim_nao_step(&nao, (canopy_sim_power_mode_t)NO_MODE, (canopy_sim_posture_mode_t)NO_MODE);
    expect_power(80 * CANOPY_SIM_NM_PER_M, 500);
    expect_posture(500, 0);
}

static void test_task_goes_a_fiftieth_of_the_way_to_50_m(void)
{
    canopy_sim_power_step(&nao.power, CANOPY_SIM_POWER_DO_TASK);
    expect_power(INT64_C(79400000000), 499);
    set_power(0, 500);
    canopy_sim_power_step(&nao.power, CANOPY_SIM_POWER_DO_TASK);
    expect_power(CANOPY_SIM_NM_PER_M, 499);
    set_power(50 * CANOPY_SIM_NM_PER_M, 500);
    canopy_sim_power_step(&nao.power, CANOPY_SIM_POWER_DO_TASK);
    expect_power(50 * CANOPY_SIM_NM_PER_M, 499);
}

static void test_task_rounds_to_the_nearest_nanometre(void)
{
    static const struct {
        int64_t missing; /* 50 m - x1 [nm] */
        int64_t step;
    } cases[] = {{24, 0}, {25, 1}, {74, 1}, {75, 2}, {-24, 0}, {-25, -1}, {-74, -1}, {-75, -2}};

    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const int64_t start = 50 * CANOPY_SIM_NM_PER_M - cases[i].missing;
        set_power(start, 500);
        canopy_sim_power_step(&nao.power, CANOPY_SIM_POWER_DO_TASK);
        expect_power(start + cases[i].step, 499);
    }
}

static void test_driving_goes_1_m_and_past_the_charger(void)
{
    set_power(CANOPY_SIM_CHARGER_REACH_NM, 500);
    canopy_sim_power_step(&nao.power, CANOPY_SIM_POWER_DRIVE_TO_CHARGER);
    expect_power(INT64_C(-900000000), 499);
    set_power(CANOPY_SIM_DISTANCE_MIN_NM + 1, 500);
    canopy_sim_power_step(&nao.power, CANOPY_SIM_POWER_DRIVE_TO_CHARGER);
    expect_power(CANOPY_SIM_DISTANCE_MIN_NM, 499);
}

static void test_charging_needs_reach_and_ends_at_or_above_full(void)
{
    set_power(CANOPY_SIM_CHARGER_REACH_NM - 1, 999);
    canopy_sim_power_step(&nao.power, CANOPY_SIM_POWER_CHARGE);
    expect_power(CANOPY_SIM_CHARGER_REACH_NM - 1, 1009);
    TEST_ASSERT_TRUE(nao.power.charging);
    canopy_sim_power_step(&nao.power, CANOPY_SIM_POWER_CHARGE);
    expect_power(CANOPY_SIM_CHARGER_REACH_NM - 1, 1009);
    TEST_ASSERT_FALSE(nao.power.charging);

    set_power(0, CANOPY_SIM_BATTERY_FULL);
    canopy_sim_power_step(&nao.power, CANOPY_SIM_POWER_CHARGE);
    expect_power(0, CANOPY_SIM_BATTERY_FULL);

    set_power(CANOPY_SIM_CHARGER_REACH_NM, 500);
    canopy_sim_power_step(&nao.power, CANOPY_SIM_POWER_CHARGE);
    expect_power(CANOPY_SIM_CHARGER_REACH_NM, 500);
    TEST_ASSERT_FALSE(nao.power.charging);
}

static void test_charging_ends_with_the_step(void)
{
    set_power(0, 500);
    canopy_sim_power_step(&nao.power, CANOPY_SIM_POWER_CHARGE);
    TEST_ASSERT_TRUE(nao.power.charging);
    canopy_sim_power_step(&nao.power, CANOPY_SIM_POWER_STOP);
    TEST_ASSERT_FALSE(nao.power.charging);
    expect_power(0, 510);
}

static void test_battery_stops_at_0(void)
{
    set_power(CANOPY_SIM_NM_PER_M, 1);
    canopy_sim_power_step(&nao.power, CANOPY_SIM_POWER_DRIVE_TO_CHARGER);
    expect_power(0, 0);
    canopy_sim_power_step(&nao.power, CANOPY_SIM_POWER_DO_TASK);
    expect_power(CANOPY_SIM_NM_PER_M, 0);
}

static void test_distance_is_shown_rounded_down(void)
{
    static const struct {
        int64_t nm;
        int32_t mm;
    } cases[] = {{0, 0},
                 {1, 0},
                 {CANOPY_SIM_CHARGER_REACH_NM - 1, 99},
                 {CANOPY_SIM_CHARGER_REACH_NM, 100},
                 {-1, -1},
                 {-CANOPY_SIM_NM_PER_MM, -1},
                 {-CANOPY_SIM_NM_PER_MM - 1, -2},
                 {CANOPY_SIM_DISTANCE_MIN_NM, -10000},
                 {CANOPY_SIM_DISTANCE_MAX_NM, 200000}};

    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        set_power(cases[i].nm, 500);
        TEST_ASSERT_EQUAL_INT32(cases[i].mm, canopy_sim_power_distance_mm(&nao.power));
    }
}

static void test_posture_set_refuses_what_is_out_of_range(void)
{
    TEST_ASSERT_FALSE(canopy_sim_posture_set(&nao.posture, -CANOPY_SIM_HEAD_X_LIMIT_MM - 1, 0));
    TEST_ASSERT_FALSE(canopy_sim_posture_set(&nao.posture, CANOPY_SIM_HEAD_X_LIMIT_MM + 1, 0));
    TEST_ASSERT_FALSE(canopy_sim_posture_set(&nao.posture, 0, -1));
    TEST_ASSERT_FALSE(canopy_sim_posture_set(&nao.posture, 0, CANOPY_SIM_HEAD_HEIGHT_MAX_MM + 1));
    expect_posture(500, 0);
    set_posture(-CANOPY_SIM_HEAD_X_LIMIT_MM, 0);
    set_posture(CANOPY_SIM_HEAD_X_LIMIT_MM, CANOPY_SIM_HEAD_HEIGHT_MAX_MM);
    expect_posture(CANOPY_SIM_HEAD_X_LIMIT_MM, CANOPY_SIM_HEAD_HEIGHT_MAX_MM);
}

static void test_each_posture_mode_works_in_its_heights_only(void)
{
    static const struct {
        canopy_sim_posture_mode_t mode;
        int32_t height_mm;
        int32_t then_x_mm;
        int32_t then_height_mm;
    } cases[] = {{CANOPY_SIM_POSTURE_SIT_UP, 0, 500, 30},      {CANOPY_SIM_POSTURE_SIT_UP, 299, 500, 329},
                 {CANOPY_SIM_POSTURE_SIT_UP, 300, 500, 300},   {CANOPY_SIM_POSTURE_STAND_UP, 299, 500, 299},
                 {CANOPY_SIM_POSTURE_STAND_UP, 300, 500, 350}, {CANOPY_SIM_POSTURE_STAND_UP, 479, 500, 529},
                 {CANOPY_SIM_POSTURE_STAND_UP, 480, 500, 480}, {CANOPY_SIM_POSTURE_WALK_HOME, 479, 500, 479},
                 {CANOPY_SIM_POSTURE_WALK_HOME, 480, 400, 480}};

    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        set_posture(500, cases[i].height_mm);
        canopy_sim_posture_step(&nao.posture, cases[i].mode);
        expect_posture(cases[i].then_x_mm, cases[i].then_height_mm);
    }
}

static void test_walking_ends_at_the_limit(void)
{
    set_posture(-CANOPY_SIM_HEAD_X_LIMIT_MM + 1, 500);
    canopy_sim_posture_step(&nao.posture, CANOPY_SIM_POSTURE_WALK_HOME);
    expect_posture(-CANOPY_SIM_HEAD_X_LIMIT_MM, 500);
}

static void test_push_over_puts_the_head_on_the_floor(void)
{
    set_posture(300, 529);
    canopy_sim_posture_push_over(&nao.posture);
    expect_posture(300, 0);
}

/* Example 5's policy: Fallback(Walk Home, Sit to Stand, Lie down to Sit up). */
static canopy_sim_posture_mode_t get_home(const canopy_sim_posture_t *posture)
{
    if (posture->head_x_mm <= 0) {
        return CANOPY_SIM_POSTURE_STOP;
    }
    if (posture->head_height_mm >= CANOPY_SIM_STANDING_MM) {
        return CANOPY_SIM_POSTURE_WALK_HOME;
    }
    return posture->head_height_mm >= CANOPY_SIM_SITTING_MM ? CANOPY_SIM_POSTURE_STAND_UP : CANOPY_SIM_POSTURE_SIT_UP;
}

static void test_example_5_is_home_after_10_4_and_5_steps(void)
{
    uint32_t steps[4] = {0};

    canopy_sim_posture_mode_t mode = get_home(&nao.posture);
    while (mode != CANOPY_SIM_POSTURE_STOP) {
        steps[mode]++;
        canopy_sim_posture_step(&nao.posture, mode);
        mode = get_home(&nao.posture);
    }
    TEST_ASSERT_EQUAL_UINT32(10, steps[CANOPY_SIM_POSTURE_SIT_UP]);
    TEST_ASSERT_EQUAL_UINT32(4, steps[CANOPY_SIM_POSTURE_STAND_UP]);
    TEST_ASSERT_EQUAL_UINT32(5, steps[CANOPY_SIM_POSTURE_WALK_HOME]);
    expect_posture(0, 500);
}

/* Example 4's policy: Sequence(Guarantee Power Supply, Do Other Task). */
static canopy_sim_power_mode_t keep_power(const canopy_sim_power_t *power)
{
    const bool at_charger = power->distance_nm < CANOPY_SIM_CHARGER_REACH_NM;

    if (power->battery >= CANOPY_SIM_BATTERY_FULL || (!at_charger && power->battery > 200)) {
        return CANOPY_SIM_POWER_DO_TASK;
    }
    return at_charger ? CANOPY_SIM_POWER_CHARGE : CANOPY_SIM_POWER_DRIVE_TO_CHARGER;
}

static void test_lemma_10_the_battery_is_never_empty(void)
{
    for (int64_t metres = 0; metres <= 100; metres += 10) {
        for (int32_t battery = 150; battery <= 1000; battery += 50) {
            set_power(metres * CANOPY_SIM_NM_PER_M, battery);
            for (uint32_t tick = 0; tick < 500; tick++) {
                canopy_sim_power_step(&nao.power, keep_power(&nao.power));
                TEST_ASSERT_TRUE(nao.power.battery > 0);
            }
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_begins_where_the_examples_begin);
    RUN_TEST(test_power_set_refuses_what_is_out_of_range);
    RUN_TEST(test_stop_and_unknown_modes_change_nothing);
    RUN_TEST(test_task_goes_a_fiftieth_of_the_way_to_50_m);
    RUN_TEST(test_task_rounds_to_the_nearest_nanometre);
    RUN_TEST(test_driving_goes_1_m_and_past_the_charger);
    RUN_TEST(test_charging_needs_reach_and_ends_at_or_above_full);
    RUN_TEST(test_charging_ends_with_the_step);
    RUN_TEST(test_battery_stops_at_0);
    RUN_TEST(test_distance_is_shown_rounded_down);
    RUN_TEST(test_posture_set_refuses_what_is_out_of_range);
    RUN_TEST(test_each_posture_mode_works_in_its_heights_only);
    RUN_TEST(test_walking_ends_at_the_limit);
    RUN_TEST(test_push_over_puts_the_head_on_the_floor);
    RUN_TEST(test_example_5_is_home_after_10_4_and_5_steps);
    RUN_TEST(test_lemma_10_the_battery_is_never_empty);
    return UNITY_END();
}
