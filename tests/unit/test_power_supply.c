/* SPDX-License-Identifier: MIT */
/** @file Example 4 in one process: from anywhere in the paper's region I the battery never runs empty (Lemma 10). */
#include "in_process.h"
#include "nao_power_app.h"
#include "unity.h"

/*
 * 0 <= x1 <= 100 m, 15 <= x2 <= 100 %: 26 * 25 = 650 starts, each for 1,200 ticks: a whole discharge, a drive and a
 * charge at least. The emulated target, which is slower, takes the corners and a few starts between them.
 */
#ifdef __arm__
enum { DISTANCES = 3, CHARGES = 3, TICKS = 1200 };
#else
enum { DISTANCES = 26, CHARGES = 25, TICKS = 1200 };
#endif
enum { LAST_DISTANCE = DISTANCES - 1, LAST_CHARGE = CHARGES - 1, FULL = 1000, LOWEST = 150 };

static nao_in_process_t run;

void setUp(void)
{
    TEST_ASSERT_EQUAL(CANOPY_OK, nao_in_process_init(&run, &nao_power_app));
}

void tearDown(void)
{
}

static void the_battery_never_runs_empty(void)
{
    for (unsigned distance = 0; distance < DISTANCES; distance++) {
        for (unsigned charge = 0; charge < CHARGES; charge++) {
            /* From corner to corner of I, in steps that are not round. */
            int64_t nm = (int64_t)distance * 100 * CANOPY_SIM_NM_PER_M / LAST_DISTANCE;
            int32_t tenths = LOWEST + ((int32_t)charge * (FULL - LOWEST) / LAST_CHARGE);

            TEST_ASSERT_TRUE(canopy_sim_power_set(&run.nao.robot.power, nm, tenths));
            for (unsigned tick = 0; tick < TICKS; tick++) {
                TEST_ASSERT_EQUAL(CANOPY_RUNNING, nao_in_process_tick(&run));
                TEST_ASSERT_GREATER_THAN_INT32(0, run.nao.robot.power.battery);
            }
        }
    }
    TEST_ASSERT_EQUAL_UINT32(0, nao_power_app.bus_state->counters.timeouts);
    TEST_ASSERT_EQUAL_UINT32(0, canopy_bus_rejected(&nao_power_app.bus_state->counters));
}

static void without_sensors_it_commands_stop(void)
{
    TEST_ASSERT_TRUE(canopy_sim_power_set(&run.nao.robot.power, 50 * CANOPY_SIM_NM_PER_M, 500));
    TEST_ASSERT_EQUAL(CANOPY_RUNNING, nao_in_process_tick(&run));
    TEST_ASSERT_EQUAL(CANOPY_SIM_POWER_DO_TASK, run.nao.power_mode);
    TEST_ASSERT_EQUAL(CANOPY_RUNNING, canopy_loop_cycle(&run.host.loop, run.host.now + 400000));
    TEST_ASSERT_EQUAL(NAO_POWER_POWER_COMMAND_MODE_DO_TASK, nao_power_output->power_command.mode);
    TEST_ASSERT_EQUAL(CANOPY_FAILURE, canopy_loop_cycle(&run.host.loop, run.host.now + 500000));
    TEST_ASSERT_EQUAL(NAO_POWER_POWER_COMMAND_MODE_STOP, nao_power_output->power_command.mode);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_battery_never_runs_empty);
    RUN_TEST(without_sensors_it_commands_stop);
    return UNITY_END();
}
