/* SPDX-License-Identifier: MIT */
/**
 * @file
 * can_probe SPEC [accept=ID,ID,...] [errors]: a CAN driver driven by hand, for the integration tests.
 *
 * Reads commands from stdin, a line each, and answers each with one line. FRAME is written as cansend and candump -L
 * write it: 123#1122, 00000123#1122 (extended), 123#R5 (remote), 123##5AABB (CAN FD, 5 = flags).
 *
 *   send FRAME          1, 0 or the error's number
 *   outcome             of the frame sent last: pending, sent or aborted
 *   state               of the controller, as a number
 *   restart             "tried"
 *   advice NUMBER       its text, or "none"
 *   burst COUNT FRAME   "taken T full F failed E"
 *   receive MS          the frame, "none" after MS milliseconds, or the error's number
 *   drain               number of frames that were waiting
 *   stats               all counters, name=value
 *   age                 of the frame received last, since it arrived [us]
 *   malformed           malformed datagrams (unixbus)
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "canopy/can/open.h"

#define IDS_MAX 8

static canopy_can_port_t port;
static canopy_time_t arrived; /* the frame received last */

/* candump's flags of a CAN FD frame */
enum { FLAG_BITRATE_SWITCH = 1, FLAG_ERROR_STATE = 2 };

static void print_frame(const canopy_can_frame_t *frame)
{
    if ((frame->flags & CANOPY_CAN_ERROR) != 0) {
        printf("%08" PRIX32 "#", frame->id | UINT32_C(0x20000000));
    } else if ((frame->flags & CANOPY_CAN_EXTENDED) != 0) {
        printf("%08" PRIX32 "#", frame->id);
    } else {
        printf("%03" PRIX32 "#", frame->id);
    }
    if ((frame->flags & CANOPY_CAN_REMOTE) != 0) {
        printf("R%u\n", frame->length);
        return;
    }
    if ((frame->flags & CANOPY_CAN_FD) != 0) {
        const int switched = (frame->flags & CANOPY_CAN_BITRATE_SWITCH) != 0 ? FLAG_BITRATE_SWITCH : 0;
        const int passive = (frame->flags & CANOPY_CAN_ERROR_STATE) != 0 ? FLAG_ERROR_STATE : 0;
        printf("#%X", (unsigned)(switched | passive));
    }
    for (unsigned i = 0; i < frame->length; i++) {
        printf("%02X", frame->data[i]);
    }
    printf("\n");
}

static uint8_t hex_byte(const char *text)
{
    const char digits[3] = {text[0], text[1], '\0'};
    return (uint8_t)strtoul(digits, NULL, 16);
}

/** What the tests write is well formed; what a driver must refuse (ids and lengths out of range) can be written. */
static canopy_can_frame_t parse_frame(const char *text)
{
    canopy_can_frame_t frame;
    unsigned flags = 0;
    char *rest = NULL;
    memset(&frame, 0x5A, sizeof frame); /* what lies behind the data must not reach the bus */
    frame.length = 0;
    frame.id = (uint32_t)strtoul(text, &rest, 16);
    flags |= rest - text > 3 ? (unsigned)CANOPY_CAN_EXTENDED : 0u;
    rest++;
    if (*rest == 'R') {
        flags |= CANOPY_CAN_REMOTE;
        frame.length = (uint8_t)strtoul(rest + 1, NULL, 10);
    } else {
        if (*rest == '#') {
            const char digit[2] = {rest[1], '\0'};
            const unsigned long fd_flags = strtoul(digit, NULL, 16);
            flags |= CANOPY_CAN_FD;
            flags |= (fd_flags & FLAG_BITRATE_SWITCH) != 0 ? (unsigned)CANOPY_CAN_BITRATE_SWITCH : 0u;
            flags |= (fd_flags & FLAG_ERROR_STATE) != 0 ? (unsigned)CANOPY_CAN_ERROR_STATE : 0u;
            rest += 2;
        }
        for (; rest[0] != '\0' && rest[1] != '\0' && frame.length < CANOPY_CAN_DATA_MAX; rest += 2) {
            frame.data[frame.length++] = hex_byte(rest);
        }
    }
    frame.flags = (uint8_t)flags;
    return frame;
}

static void burst(unsigned long count, const canopy_can_frame_t *frame)
{
    unsigned long taken = 0;
    unsigned long full = 0;
    for (unsigned long i = 0; i < count; i++) {
        const int result = port.can->send(port.can->context, 0, frame);
        if (result == 1 && port.can->outcome != NULL) {
            (void)port.can->outcome(port.can->context, 0);
        }
        taken += result == 1;
        full += result == 0;
    }
    printf("taken %lu full %lu failed %lu\n", taken, full, count - taken - full);
}

static void receive(uint32_t timeout_ms)
{
    canopy_can_frame_t frame;
    int result = port.can->wait(port.can->context, 1000u * timeout_ms);
    if (result >= 0) {
        result = port.can->receive(port.can->context, &frame);
    }
    if (result == 1) {
        arrived = frame.time;
        print_frame(&frame);
    } else if (result == 0) {
        printf("none\n");
    } else {
        printf("%d\n", result);
    }
}

static void drain(void)
{
    canopy_can_frame_t frame;
    unsigned count = 0;
    while (port.can->receive(port.can->context, &frame) == 1) {
        count++;
    }
    printf("%u\n", count);
}

static void print_age(void)
{
    struct timespec now = {0};
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    printf("%" PRId64 "\n", (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000 - (int64_t)arrived);
}

static void print_outcome(void)
{
    static const char *const names[] = {"pending", "sent", "aborted"};
    printf("%s\n", names[port.can->outcome != NULL ? port.can->outcome(port.can->context, 0) : CANOPY_CAN_SENT]);
}

static void print_stats(void)
{
    canopy_can_stats_t stats;
    port.can->stats(port.can->context, &stats);
    printf("received=%" PRIu32 " sent=%" PRIu32 " rx_dropped=%" PRIu32 " tx_dropped=%" PRIu32 " error_frames=%" PRIu32
           " rx_high_water=%" PRIu32 "\n",
           stats.received, stats.sent, stats.rx_dropped, stats.tx_dropped, stats.error_frames, stats.rx_high_water);
}

/** True when the line is this command; *argument is what follows its name. */
static bool is_command(const char *line, const char *name, const char **argument)
{
    const size_t length = strlen(name);
    *argument = line[length] == ' ' ? line + length + 1 : "";
    return strncmp(line, name, length) == 0 && (line[length] == ' ' || line[length] == '\0');
}

static bool obey(const char *line)
{
    const char *argument = NULL;
    if (is_command(line, "send", &argument)) {
        const canopy_can_frame_t frame = parse_frame(argument);
        printf("%d\n", port.can->send(port.can->context, 0, &frame));
    } else if (is_command(line, "outcome", &argument)) {
        print_outcome();
    } else if (is_command(line, "state", &argument)) {
        printf("%d\n", (int)port.can->state(port.can->context));
    } else if (is_command(line, "restart", &argument)) {
        port.can->restart(port.can->context);
        printf("tried\n");
    } else if (is_command(line, "advice", &argument)) {
        const char *advice = canopy_can_advice(&port, (unsigned)strtoul(argument, NULL, 10));
        printf("%s\n", advice != NULL ? advice : "none");
    } else if (is_command(line, "burst", &argument)) {
        char *rest = NULL;
        const unsigned long count = strtoul(argument, &rest, 10);
        const canopy_can_frame_t frame = parse_frame(rest + 1);
        burst(count, &frame);
    } else if (is_command(line, "receive", &argument)) {
        receive((uint32_t)strtoul(argument, NULL, 10));
    } else if (is_command(line, "drain", &argument)) {
        drain();
    } else if (is_command(line, "stats", &argument)) {
        print_stats();
    } else if (is_command(line, "age", &argument)) {
        print_age();
    } else if (is_command(line, "malformed", &argument) && port.kind == CANOPY_CAN_OPEN_UNIXBUS) {
        printf("%" PRIu32 "\n", canopy_unixbus_malformed(&port.driver.unixbus));
    } else {
        (void)fprintf(stderr, "can_probe: unknown command: %s\n", line);
        return false;
    }
    return fflush(stdout) == 0;
}

int main(int argument_count, char **arguments)
{
    static uint32_t ids[IDS_MAX];
    static canopy_can_acceptance_t acceptance;
    char message[CANOPY_CAN_OPEN_MESSAGE];
    char line[256];
    for (int i = 2; i < argument_count; i++) {
        char *next = strchr(arguments[i], '=');
        acceptance.error_frames = acceptance.error_frames || next == NULL;
        while (next != NULL && *next != '\0' && acceptance.count < IDS_MAX) {
            ids[acceptance.count++] = (uint32_t)strtoul(next + 1, &next, 16);
            acceptance.ids = ids;
        }
    }
    acceptance.everything = acceptance.count == 0u;
    if (argument_count < 2 || canopy_can_open(&port, arguments[1], &acceptance, message, sizeof message) != CANOPY_OK) {
        (void)fprintf(stderr, "%s\n", argument_count < 2 ? "usage: can_probe SPEC [accept=ID,...] [errors]" : message);
        return EXIT_FAILURE;
    }
    printf("ready\n");
    bool good = fflush(stdout) == 0;
    while (good && fgets(line, sizeof line, stdin) != NULL) {
        char *end = strchr(line, '\n');
        if (end != NULL) {
            *end = '\0';
        }
        good = obey(line);
    }
    canopy_can_close(&port);
    return good ? EXIT_SUCCESS : EXIT_FAILURE;
}
