/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Runs of a controller and the robot in one program, for test_runs.py: the compiled application, its bus, and the plant.
 * RUNS_APP names the application.
 */
#include "in_process.h"

extern const canopy_app_t RUNS_APP;

enum { HEAD_X_MAX = 500, HEAD_HEIGHT_MAX = 550, LOWEST = 150, FULL = 1000, STATE = 2 };

static nao_in_process_t run;

bool runs_init(void)
{
    return nao_in_process_init(&run, &RUNS_APP) == CANOPY_OK;
}

/** xorshift64*: the same starts everywhere. */
static uint64_t next(uint64_t *seed)
{
    *seed ^= *seed >> 12;
    *seed ^= *seed << 25;
    *seed ^= *seed >> 27;
    return *seed * UINT64_C(0x2545F4914F6CDD1D);
}

/** States of `ticks` ticks from a start, [head_x, head_height] in mm; the first one is the start. @return ticks RUNNING */
int runs_posture(int32_t head_x, int32_t head_height, int ticks, int32_t *states)
{
    int running = 0;

    if (!canopy_sim_posture_set(&run.robot.posture, head_x, head_height)) {
        return -1;
    }
    for (int tick = 0; tick < ticks; tick++) {
        states[STATE * tick] = run.robot.posture.head_x_mm;
        states[STATE * tick + 1] = run.robot.posture.head_height_mm;
        running += nao_in_process_tick(&run) == CANOPY_RUNNING;
    }
    return running;
}

/** States of `ticks` ticks, [distance in nm, battery in 0.1 %]. @return ticks RUNNING */
int runs_power(int64_t distance, int32_t battery, int ticks, int64_t *states)
{
    int running = 0;

    if (!canopy_sim_power_set(&run.robot.power, distance, battery)) {
        return -1;
    }
    for (int tick = 0; tick < ticks; tick++) {
        states[STATE * tick] = run.robot.power.distance_nm;
        states[STATE * tick + 1] = run.robot.power.battery;
        running += nao_in_process_tick(&run) == CANOPY_RUNNING;
    }
    return running;
}

/** From `count` random starts with x1 above 0. @return most ticks until home, `limit` + 1 where it is not there yet */
int runs_worst_way_home(uint32_t count, uint64_t seed, int limit)
{
    int worst = 0;

    for (uint32_t start = 0; start < count; start++) {
        int32_t head_x = 1 + (int32_t)(next(&seed) % HEAD_X_MAX);
        int32_t head_height = (int32_t)(next(&seed) % (HEAD_HEIGHT_MAX + 1));
        int ticks = 0;

        (void)canopy_sim_posture_set(&run.robot.posture, head_x, head_height);
        while (ticks <= limit && nao_in_process_tick(&run) == CANOPY_RUNNING) {
            ticks++;
        }
        worst = ticks > worst ? ticks : worst;
    }
    return worst;
}

/** From `count` random starts of Lemma 10's I, for `ticks` ticks each. @return least battery [0.1 %] */
int32_t runs_least_battery(uint32_t count, uint64_t seed, int ticks)
{
    int32_t least = FULL;

    for (uint32_t start = 0; start < count; start++) {
        int64_t distance = (int64_t)(next(&seed) % (100u * (uint64_t)CANOPY_SIM_NM_PER_M + 1u));
        int32_t battery = LOWEST + (int32_t)(next(&seed) % (FULL - LOWEST + 1));

        (void)canopy_sim_power_set(&run.robot.power, distance, battery);
        for (int tick = 0; tick < ticks; tick++) {
            (void)nao_in_process_tick(&run);
            least = run.robot.power.battery < least ? run.robot.power.battery : least;
        }
    }
    return least;
}
