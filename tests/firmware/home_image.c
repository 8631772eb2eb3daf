/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A whole firmware image: the compiled tree of Example 5 with its leaves, the loop, a CAN bus, and, at the other end of
 * that bus, the robot's plant. Starts at (x1, x2) = (0.5 m, 0 m), prints every tick, and succeeds when the robot is home
 * after the paper's number of steps: sit up until x2 = 0.3 m (10), stand up until 0.5 m (4), walk until x1 = 0 (5).
 */
#include "in_process.h"
#include "nao_home_app.h"
#include "semihosting.h"

enum { MODES = 4, TICKS_MAX = 100 };

static const char *const mode_names[MODES] = {"Stop", "SitUp", "StandUp", "WalkHome"};
/* Of the RUNNING ticks; then one more sees that the robot is home. */
static const unsigned expected_steps[MODES] = {0, 10, 4, 5};

static nao_in_process_t run;

static void print_metres(const char *name, int32_t millimetres)
{
    semihosting_put(name);
    semihosting_put_number((unsigned long)(millimetres / 1000));
    semihosting_put(".");
    for (int32_t digit = 100; digit > 0; digit /= 10) {
        semihosting_put_number((unsigned long)(millimetres / digit % 10));
    }
    semihosting_put(" m");
}

static void print_tick(unsigned tick, const canopy_sim_posture_t *before)
{
    semihosting_put("tick ");
    semihosting_put_number(tick);
    print_metres(": x1 ", before->head_x_mm);
    print_metres(", x2 ", before->head_height_mm);
    semihosting_put(", ");
    semihosting_put(mode_names[run.nao.posture_mode]);
    semihosting_put("\n");
}

int main(void)
{
    unsigned steps[MODES] = {0};
    canopy_status_t root = CANOPY_RUNNING;
    int failures = 0;

    if (nao_in_process_init(&run, &nao_home_app) != CANOPY_OK ||
        !canopy_sim_posture_set(&run.nao.robot.posture, 500, 0)) {
        semihosting_put("The set-up failed.\n");
        return 1;
    }
    for (unsigned tick = 1; root == CANOPY_RUNNING && tick <= TICKS_MAX; tick++) {
        canopy_sim_posture_t before = run.nao.robot.posture;

        root = nao_in_process_tick(&run);
        steps[run.nao.posture_mode] += root == CANOPY_RUNNING ? 1u : 0u;
        print_tick(tick, &before);
    }
    for (unsigned mode = 0; mode < MODES; mode++) {
        failures += steps[mode] == expected_steps[mode] ? 0 : 1;
    }
    failures += root == CANOPY_SUCCESS && run.nao.robot.posture.head_x_mm == 0 ? 0 : 1;
    semihosting_put(failures == 0 ? "home\n" : "not home, or not in the paper's number of steps\n");
    return failures;
}
