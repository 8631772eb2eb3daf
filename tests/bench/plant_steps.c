/* SPDX-License-Identifier: MIT */
/** @file How fast the whole robot's plant steps: prints steps per second, for each profile. tests/bench/robot.py runs it. */
#include <inttypes.h>
#include <stdio.h>
#include <time.h>

#include "canopy_sim/robot.h"

enum { STEPS = 5000000, ORDERS = 8 };

static canopy_sim_robot_t robot;

static double seconds(void)
{
    struct timespec now;

    (void)clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + (double)now.tv_nsec / 1e9;
}

int main(void)
{
    for (unsigned profile = 0; profile < 2u; profile++) {
        double begin = seconds();

        canopy_sim_robot_init(&robot, (canopy_sim_profile_t)profile, 1);
        for (unsigned step = 0; step < (unsigned)STEPS; step++) {
            /* Another order to the legs every 1024 steps, so that all of them have their turn. */
            const canopy_sim_command_t command = {.legs = (canopy_sim_legs_t)((step >> 10) % (unsigned)ORDERS),
                                                  .arms = CANOPY_SIM_ARMS_GRASP,
                                                  .say = CANOPY_SIM_SAY_OUCH,
                                                  .say_number = (uint8_t)(step >> 8),
                                                  .track_ball = true};

            canopy_sim_robot_step(&robot, &command);
        }
        printf("%s %.0f\n", profile == 0u ? "paper" : "nao", (double)STEPS / (seconds() - begin));
    }
    return robot.steps == (uint64_t)STEPS ? 0 : 1;
}
