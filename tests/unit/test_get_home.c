/* SPDX-License-Identifier: MIT */
/** @file Example 5 in one process: home in finite time from everywhere (Lemma 11), with the paper's number of ticks. */
#include "in_process.h"
#include "nao_home_app.h"
#include "unity.h"

enum {
    TICKS_MAX = 24 + 1,
    WALKED_PER_TICK_MM = 100
}; /* Lemma 11's bound, and the tick that sees that home is reached */

static nao_in_process_t run;

void setUp(void)
{
    TEST_ASSERT_EQUAL(CANOPY_OK, nao_in_process_init(&run, &nao_home_app));
}

void tearDown(void)
{
}

static void from_lying_at_half_a_metre(void)
{
    static const struct {
        canopy_sim_posture_mode_t mode;
        unsigned ticks;
    } phases[] = {{CANOPY_SIM_POSTURE_SIT_UP, 10}, {CANOPY_SIM_POSTURE_STAND_UP, 4}, {CANOPY_SIM_POSTURE_WALK_HOME, 5}};

    TEST_ASSERT_TRUE(canopy_sim_posture_set(&run.nao.robot.posture, 500, 0));
    for (unsigned phase = 0; phase < 3u; phase++) {
        for (unsigned tick = 0; tick < phases[phase].ticks; tick++) {
            TEST_ASSERT_EQUAL(CANOPY_RUNNING, nao_in_process_tick(&run));
            TEST_ASSERT_EQUAL(phases[phase].mode, run.nao.posture_mode);
        }
    }
    TEST_ASSERT_EQUAL(CANOPY_SUCCESS, nao_in_process_tick(&run));
    TEST_ASSERT_EQUAL(CANOPY_SIM_POSTURE_STOP, run.nao.posture_mode);
    TEST_ASSERT_EQUAL_INT32(0, run.nao.robot.posture.head_x_mm);
}

static void from_everywhere_within_the_papers_bound(void)
{
    /* 0 < x1 <= 0.5 m, 0 <= x2 <= 0.55 m, in steps of 1.3 cm and 1.1 cm: 39 * 51 starts. */
    for (int32_t x1 = 500; x1 > 0; x1 -= 13) {
        for (int32_t x2 = 0; x2 <= 550; x2 += 11) {
            unsigned ticks = 1;

            TEST_ASSERT_TRUE(canopy_sim_posture_set(&run.nao.robot.posture, x1, x2));
            while (nao_in_process_tick(&run) == CANOPY_RUNNING) {
                ticks++;
                TEST_ASSERT_LESS_OR_EQUAL_UINT(TICKS_MAX, ticks);
            }
            TEST_ASSERT_LESS_OR_EQUAL_INT32(0, run.nao.robot.posture.head_x_mm);
            TEST_ASSERT_GREATER_THAN_INT32(-WALKED_PER_TICK_MM, run.nao.robot.posture.head_x_mm);
        }
    }
}

static void pushed_over_it_gets_up_again(void)
{
    TEST_ASSERT_TRUE(canopy_sim_posture_set(&run.nao.robot.posture, 500, 500));
    for (unsigned tick = 0; tick < 3u; tick++) {
        TEST_ASSERT_EQUAL(CANOPY_RUNNING, nao_in_process_tick(&run));
    }
    canopy_sim_posture_push_over(&run.nao.robot.posture);
    TEST_ASSERT_EQUAL(CANOPY_RUNNING, nao_in_process_tick(&run));
    TEST_ASSERT_EQUAL(CANOPY_SIM_POSTURE_SIT_UP, run.nao.posture_mode);
    for (unsigned tick = 1; tick < 10u + 4u + 2u; tick++) {
        TEST_ASSERT_EQUAL(CANOPY_RUNNING, nao_in_process_tick(&run));
    }
    TEST_ASSERT_EQUAL(CANOPY_SUCCESS, nao_in_process_tick(&run));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(from_lying_at_half_a_metre);
    RUN_TEST(from_everywhere_within_the_papers_bound);
    RUN_TEST(pushed_over_it_gets_up_again);
    return UNITY_END();
}
