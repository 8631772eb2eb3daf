/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A whole firmware image: the compiled tree of Example 5 with its leaves, the loop, a CAN bus, and, at the other end of
 * that bus, the robot's plant. Starts at (x1, x2) = (0.5 m, 0 m), prints every tick, and succeeds when the robot is home
 * after the paper's number of steps: sit up until x2 = 0.3 m (10), stand up until 0.5 m (4), walk until x1 = 0 (5).
 */
#include <stddef.h>

#include "canopy/can/loopback.h"
#include "canopy/e2e.h"
#include "canopy/loop.h"
#include "canopy_sim/posture.h"
#include "nao_home.h"
#include "semihosting.h"

enum { QUEUE = 16, MODES = 4, TICKS_MAX = 100 };

static const char *const mode_names[MODES] = {"Stop", "SitUp", "StandUp", "WalkHome"};
static const uint32_t expected_steps[MODES] = {0, 10, 4, 5};

/** The robot: plant, endpoint on the bus, and what it has been told. */
typedef struct {
    canopy_loopback_endpoint_t endpoint;
    canopy_sim_posture_t posture;
    canopy_e2e_receiver_t command_check;
    uint32_t steps[MODES];
    uint8_t counter;
    uint8_t mode;
} robot_t;

static canopy_loopback_t bus;
static canopy_loopback_endpoint_t controller;
static canopy_can_frame_t controller_queue[QUEUE];
static canopy_can_frame_t robot_queue[QUEUE];
static robot_t robot;
static canopy_time_t now;

static const canopy_rx_message_t *posture_message(void)
{
    const canopy_rx_message_t *message = nao_bus.rx;

    while (message->id != NAO_POSTURE_ID) {
        message++;
    }
    return message;
}

static const canopy_tx_message_t *command_message(void)
{
    const canopy_tx_message_t *message = nao_bus.tx;

    while (message->id != NAO_POSTURE_COMMAND_ID) {
        message++;
    }
    return message;
}

/* Where the robot is, as the message Posture of nao.dbc: HeadX from bit 16, HeadHeight from bit 32 on. */
static void send_posture(void)
{
    const canopy_rx_message_t *message = posture_message();
    canopy_can_frame_t frame = {.id = message->id, .length = message->length};
    uint32_t x = (uint32_t)robot.posture.head_x_mm;
    uint32_t height = (uint32_t)robot.posture.head_height_mm;

    frame.data[2] = (uint8_t)(x & 0xFFu);
    frame.data[3] = (uint8_t)((x >> 8) & 0xFFu);
    frame.data[4] = (uint8_t)(height & 0xFFu);
    frame.data[5] = (uint8_t)(height >> 8);
    canopy_e2e_protect((uint16_t)message->data_id, robot.counter, frame.data, frame.length);
    robot.counter = (uint8_t)((robot.counter + 1u) % CANOPY_E2E_COUNTERS);
    (void)robot.endpoint.can.send(robot.endpoint.can.context, &frame);
}

/* Takes the last command from the bus; without a good one the robot stops. */
static void take_command(void)
{
    const canopy_tx_message_t *message = command_message();
    canopy_can_frame_t frame;

    robot.mode = NAO_POSTURE_COMMAND_MODE_STOP;
    while (robot.endpoint.can.receive(robot.endpoint.can.context, &frame) > 0) {
        if (frame.id == message->id && frame.length == message->length &&
            canopy_e2e_check(&robot.command_check, (uint16_t)message->data_id, frame.data, frame.length) ==
                CANOPY_E2E_OK &&
            frame.data[2] < MODES) {
            robot.mode = frame.data[2];
        }
    }
}

static canopy_time_t clock_now(void *context)
{
    (void)context;
    return now;
}

/* Time passes for the robot while the controller waits: it has done a step, and its sensors show it. */
static bool clock_wait_until(void *context, canopy_time_t deadline)
{
    (void)context;
    now = deadline;
    send_posture();
    return true;
}

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

static bool after_cycle(void *context, canopy_status_t root)
{
    const canopy_loop_t *loop = context;

    take_command();
    semihosting_put("tick ");
    semihosting_put_number(loop->ticks);
    print_metres(": x1 ", robot.posture.head_x_mm);
    print_metres(", x2 ", robot.posture.head_height_mm);
    semihosting_put(", ");
    semihosting_put(mode_names[robot.mode]);
    semihosting_put("\n");
    robot.steps[robot.mode] += root == CANOPY_RUNNING ? 1u : 0u;
    canopy_sim_posture_step(&robot.posture, (canopy_sim_posture_mode_t)robot.mode);
    return root == CANOPY_RUNNING && loop->ticks < TICKS_MAX;
}

int main(void)
{
    static canopy_loop_t loop;
    static const canopy_clock_t clock = {.now = clock_now, .wait_until = clock_wait_until};
    static const canopy_loop_config_t config = {
        .context = &loop,
        .app = &nao_home_app,
        .can = &controller.can,
        .clock = &clock,
        .after_cycle = after_cycle,
    };
    int failures = 0;

    if (canopy_loopback_join(&bus, &controller, controller_queue, QUEUE, NULL) != CANOPY_OK ||
        canopy_loopback_join(&bus, &robot.endpoint, robot_queue, QUEUE, NULL) != CANOPY_OK ||
        !canopy_sim_posture_set(&robot.posture, 500, 0) || canopy_loop_init(&loop, &config) != CANOPY_OK) {
        semihosting_put("The set-up failed.\n");
        return 1;
    }
    canopy_loop_run(&loop);
    for (size_t mode = 0; mode < MODES; mode++) {
        failures += robot.steps[mode] == expected_steps[mode] ? 0 : 1;
    }
    failures += robot.posture.head_x_mm == 0 ? 0 : 1;
    semihosting_put(failures == 0 ? "home\n" : "not home, or not in the paper's number of steps\n");
    return failures;
}
