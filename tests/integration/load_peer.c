/* SPDX-License-Identifier: MIT */
/**
 * @file
 * load_peer BUS PERCENT CUTS: the robot of load_probe, and the others on its bus.
 *
 * The robot sends a Battery message in every period and, CUTS times, falls silent for a while. The others take PERCENT of
 * 500 kbit/s, in bursts of ten of the longest frames, all of them more urgent than the controller's. All in one thread.
 * Prints, with times of CLOCK_MONOTONIC [us]:
 *
 *   sent LEVEL BEFORE AFTER   a Battery message with this level, which was on the bus between these times
 *   got MODE TIME             a PowerCommand, when it arrived here
 *   peer MOST_LATE FRAMES     how late the robot ever sent; how many frames the others have sent
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "canopy/can/open.h"
#include "canopy/clock/posix.h"
#include "canopy/e2e.h"
#include "nao_power_app.h"

enum {
    BATTERY = 0x100, /* of nao.dbc */
    POWER_COMMAND = 0x200,
    PERIOD_US = 50000,
    SENT_IN_A_ROUND = 20,
    SILENT_US = 700000,
    PHASE_US = 17000,
    BURST = 10,
    FRAME_US = 270, /* 135 bits */
    LEVEL_LOW = 300,
    LEVELS = 700 /* from LEVEL_LOW on: the robot works */
};

typedef struct {
    canopy_time_t due; /* of the next message */
    unsigned round;
    unsigned number; /* in the round */
    uint32_t sent;
    canopy_time_t most_late;
} robot_t;

typedef struct {
    canopy_time_t due; /* of the next burst */
    canopy_time_t pause;
    uint32_t sent;
} others_t;

static canopy_can_port_t robot_port;
static canopy_can_port_t others_port;
static canopy_posix_clock_t posix_clock;

static canopy_time_t now(void)
{
    return posix_clock.clock.now(posix_clock.clock.context);
}

static void send_battery(robot_t *robot)
{
    const unsigned level = LEVEL_LOW + robot->sent % (unsigned)LEVELS;
    const canopy_time_t before = now();
    canopy_can_frame_t frame = {
        .id = BATTERY, .length = 8, .data = {0, 0, (uint8_t)(level & 0xFFu), (uint8_t)(level >> 8), 0, 0x10, 0, 0}};
    const canopy_can_t *can = robot_port.can;
    canopy_time_t after;

    canopy_e2e_protect((uint16_t)nao_power_app.bus->rx[0].data_id, (uint8_t)(robot->sent % CANOPY_E2E_COUNTERS),
                       frame.data, frame.length);
    if (can->send(can->context, 0, &frame) != 1) {
        fprintf(stderr, "load_peer: a Battery message could not be sent\n");
        exit(EXIT_FAILURE);
    }
    after = now();
    printf("sent %u %" PRIu64 " %" PRIu64 "\n", level, before, after);
    robot->most_late = after - robot->due > robot->most_late ? after - robot->due : robot->most_late;
    robot->sent++;
    robot->due += PERIOD_US;
    robot->number++;
    if (robot->number == (unsigned)SENT_IN_A_ROUND) {
        robot->number = 0;
        robot->round++;
        robot->due += SILENT_US + (canopy_time_t)PHASE_US; /* at another moment of the controller's cycle */
    }
}

static void send_burst(others_t *others)
{
    const canopy_can_t *can = others_port.can;

    for (unsigned number = 0; number < (unsigned)BURST; number++) {
        canopy_can_frame_t frame = {
            .id = 1u + others->sent % 0xFFu, .length = 8, .data = {0xFF, 0, 0xFF, 0, 0xFF, 0, 0xFF, 0}};

        others->sent += can->send(can->context, 0, &frame) == 1 ? 1u : 0u;
    }
    others->due += others->pause;
}

static void take_commands(canopy_time_t until)
{
    const canopy_can_t *can = robot_port.can;
    const canopy_time_t started = now();
    canopy_can_frame_t frame;

    if (!canopy_time_reached(started, until)) {
        (void)can->wait(can->context, (uint32_t)(until - started));
    }
    while (can->receive(can->context, &frame) == 1) {
        if (frame.id == (uint32_t)POWER_COMMAND) {
            printf("got %u %" PRIu64 "\n", frame.data[2], frame.time);
        }
    }
}

static void run(unsigned percent, unsigned cuts)
{
    const canopy_time_t begin = now();
    robot_t robot = {.due = begin};
    others_t others = {.due = begin, .pause = percent != 0u ? BURST * FRAME_US * 100u / percent : UINT64_MAX / 4u};

    others.due += percent != 0u ? 0u : others.pause;
    /* The last silence is waited for, too. */
    while (robot.round < cuts || !canopy_time_reached(now() + PERIOD_US, robot.due)) {
        if (robot.round < cuts && canopy_time_reached(now(), robot.due)) {
            send_battery(&robot);
        }
        if (canopy_time_reached(now(), others.due)) {
            send_burst(&others);
        }
        take_commands(others.due < robot.due ? others.due : robot.due);
    }
    printf("peer %" PRIu64 " %" PRIu32 "\n", robot.most_late, others.sent);
}

int main(int argc, char **argv)
{
    static const uint32_t command = POWER_COMMAND;
    static const canopy_can_acceptance_t commands = {.ids = &command, .count = 1};
    static const canopy_can_acceptance_t nothing = {0};
    char message[CANOPY_CAN_OPEN_MESSAGE] = "load_peer BUS PERCENT CUTS";

    if (argc != 4 || canopy_can_open(&robot_port, argv[1], &commands, message, sizeof message) != CANOPY_OK ||
        canopy_can_open(&others_port, argv[1], &nothing, message, sizeof message) != CANOPY_OK) {
        fprintf(stderr, "%s\n", message);
        return EXIT_FAILURE;
    }
    canopy_posix_clock_init(&posix_clock, NULL);
    run((unsigned)strtoul(argv[2], NULL, 10), (unsigned)strtoul(argv[3], NULL, 10));
    canopy_can_close(&others_port);
    canopy_can_close(&robot_port);
    return EXIT_SUCCESS;
}
