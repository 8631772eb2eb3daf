/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The application "language" with its own tree and with the image of it (argv[1]): prints what every node, the blackboard
 * and the outputs are in each tick, "own" first, "image" then. test_image.py builds it and compares.
 */
#include <stdio.h>
#include <string.h>

#include "language_app.h"

enum { TICKS = 80, IMAGE_MAX = 65536 };

static canopy_time_t now(void *context)
{
    (void)context;
    return 0;
}

static bool never_wait(void *context, canopy_time_t deadline)
{
    (void)context;
    (void)deadline;
    return false;
}

static unsigned tick;

/** Climate, at other temperatures and doors, and sometimes not at all. */
static int receive(void *context, canopy_can_frame_t *frame)
{
    static unsigned sent;
    unsigned temperature = 4096u + tick * 7u % 100u;

    (void)context;
    if (sent == tick || tick % 16u > 10u) {
        return 0;
    }
    sent = tick;
    *frame = (canopy_can_frame_t){
        .time = tick * UINT64_C(10000), .id = 0x18FECA15, .flags = CANOPY_CAN_EXTENDED, .length = 8};
    frame->data[0] = (uint8_t)((temperature - 4096u) >> 8);
    frame->data[1] = (uint8_t)(temperature & 0xFFu);
    frame->data[2] = (uint8_t)(tick % 3u | (tick % 8u) << 3);
    return 1;
}

static int send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    (void)context;
    (void)mailbox;
    (void)printf("sent %u", (unsigned)frame->id);
    for (uint8_t byte = 0; byte < frame->length; byte++) {
        (void)printf(" %u", frame->data[byte]);
    }
    (void)printf("\n");
    return 1;
}

static void print_bytes(const char *what, const void *data, size_t size)
{
    const unsigned char *bytes = data;

    (void)printf("%s", what);
    for (size_t index = 0; index < size; index++) {
        (void)printf(" %x", bytes[index]);
    }
    (void)printf("\n");
}

static void run(canopy_loop_t *loop, const char *name)
{
    (void)printf("%s\n", name);
    for (tick = 1; tick <= TICKS; tick++) {
        loop->ticks = tick;
        (void)canopy_loop_cycle(loop, tick * UINT64_C(10000));
        print_bytes("status", language_app.status, language_app.tree->node_count);
        print_bytes("entries", language_entries, sizeof *language_entries);
    }
    tick = 0;
}

int main(int argc, char **argv)
{
    static unsigned char image[IMAGE_MAX];
    static const canopy_can_t can = {.receive = receive, .send = send};
    static const canopy_clock_t clock = {.now = now, .wait_until = never_wait};
    static const canopy_loop_config_t config = {.app = &language_app, .can = &can, .clock = &clock};
    static canopy_loop_t loop;
    FILE *file = argc == 2 ? fopen(argv[1], "rb") : NULL;
    canopy_image_error_t error;
    uint16_t where = 0;
    size_t size;

    if (file == NULL) {
        return 2;
    }
    size = fread(image, 1, sizeof image, file);
    (void)fclose(file);
    if (canopy_loop_init(&loop, &config) != CANOPY_OK) {
        return 2;
    }
    run(&loop, "own");
    error = canopy_image_load(&language_image, image, size, &where);
    if (error != CANOPY_IMAGE_OK) {
        (void)printf("refused: %d at %u\n", (int)error, where);
        return 1;
    }
    (void)printf("exchange\n");
    if (canopy_image_run(&language_image, &loop, 0) != CANOPY_OK) {
        return 1;
    }
    /* A fresh start: what was received before the first tick of the other run was nothing. */
    memset(language_app.input, 0, sizeof *language_input);
    for (uint16_t index = 0; index < language_app.bus->rx_count; index++) {
        language_app.rx[index] = (canopy_rx_state_t){0};
    }
    run(&loop, "image");
    return 0;
}
