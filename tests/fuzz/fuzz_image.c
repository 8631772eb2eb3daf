/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Any image at the application of tests/unit/exchange: what canopy_image_load() refuses changes nothing that runs, what it
 * accepts ticks, is halted and exchanged without leaving its memory.
 *
 * Inputs are raw images, or the two good ones with some leaves doubled, bytes changed, records copied and parts cut out. Size and CRC are
 * put right mostly, so that the search gets past them. Every image is loaded twice: into buffers that stand alone, where
 * the address sanitizer sees each byte too many, and into the application's own, in which it then runs.
 */
#include <string.h>

#include "exchange_app.h"
#include "exchange_main.inc"
#include "exchange_other.inc"
#include "input.h"

enum {
    IMAGE_BYTES = 2048,
    NODES = 40,
    USES = 4,
    PORTS_MAX = 8,
    PORTS_SIZE = 64,
    KINDS_MAX = 8,
    TEXTS = 512,
    EDITS = 24
};

static input_t input;
static uint8_t image[IMAGE_BYTES];
static size_t size;

/* --- buffers that stand alone ----------------------------------------------------------------------------------------- */

static canopy_node_t nodes[NODES];
static int32_t parameters[2 * NODES];
static canopy_script_t scripts[16];
static uint16_t counts[KINDS_MAX];
static uint16_t sources[KINDS_MAX][USES * PORTS_MAX];
static uint16_t bases[KINDS_MAX][USES];
static uint64_t pools[KINDS_MAX][USES * PORTS_SIZE / 8];
static canopy_image_state_t state;

/** Copies what the application offers, and takes away all that its buffers have more than they need. */
static canopy_image_error_t load_alone(void)
{
    static canopy_image_kind_t kinds[KINDS_MAX];
    canopy_image_app_t alone = exchange_image;
    char *texts = malloc(alone.texts_max);
    canopy_image_error_t error;
    uint8_t *exact = malloc(size != 0u ? size : 1u);

    EXPECT(texts != NULL && exact != NULL);
    memcpy(exact, image, size);
    EXPECT(alone.kind_count <= KINDS_MAX && alone.nodes_max == NODES && alone.uses_max == USES &&
           alone.parameters_max == 2u * NODES && alone.app->tree->script_count <= 16u);
    for (uint16_t kind = 0; kind < alone.kind_count; kind++) {
        kinds[kind] = exchange_image.kinds[kind];
        EXPECT(kinds[kind].ports_size <= PORTS_SIZE && kinds[kind].port_count <= PORTS_MAX);
        kinds[kind].pool[0] = &pools[kind][USES * (PORTS_SIZE - kinds[kind].ports_size) / 8];
        kinds[kind].sources[0] = &sources[kind][USES * (PORTS_MAX - kinds[kind].port_count)];
        kinds[kind].bases[0] = bases[kind];
    }
    alone.kinds = kinds;
    alone.counts = &counts[KINDS_MAX - alone.kind_count];
    alone.state = &state;
    alone.slots[0] = (canopy_image_slot_t){nodes, parameters, &scripts[16u - alone.app->tree->script_count], texts};
    memset(&state, 0, sizeof state);
    error = canopy_image_load(&alone, exact, size, NULL);
    free(exact);
    free(texts);
    return error;
}

/* --- images ----------------------------------------------------------------------------------------------------------- */

static void put(size_t at, uint64_t value, unsigned bytes)
{
    for (unsigned byte = 0; byte < bytes && at + byte < size; byte++) {
        image[at + byte] = (uint8_t)((value >> (8u * byte)) & 0xFFu);
    }
}

static void edit(void)
{
    uint8_t what = take8(&input);
    size_t at = take16(&input) % size;
    size_t from = take16(&input) % size;
    size_t length = what % 3u == 0u ? 12u : 8u;

    if (what < 96u) {
        image[at] = take8(&input);
    } else if (what < 128u) {
        put(at, take16(&input), 2);
    } else if (what < 176u) {
        length = at + length <= size && from + length <= size ? length : 0u;
        memmove(image + at, image + from, length);
    } else if (what < 208u) {
        length = at + length <= size ? length : 0u;
        memmove(image + at, image + at + length, size - at - length);
        size -= length;
    } else if (size + length <= sizeof image) {
        memmove(image + at + length, image + at, size - at);
        size += length;
    }
    /* A count of the header goes with it, now and then. */
    if (what % 2u == 0u && size >= CANOPY_IMAGE_HEADER) {
        size_t count = 32u + 2u * (take8(&input) % 12u);

        put(count, (uint64_t)image[count] + (what < 208u ? UINT64_MAX : 1u), 1);
    }
}

static size_t get16(size_t at)
{
    return image[at] | ((size_t)image[at + 1u] << 8);
}

static void insert_copy(size_t from, size_t length)
{
    memmove(image + from + length, image + from, size - from);
    size += length;
}

static bool is_user_node(size_t at)
{
    return image[at] <= CANOPY_NODE_STATEFUL_ACTION || image[at] >= CANOPY_NODE_USER_CONTROL;
}

/** How many ports the kind has that stands at this place in the image. */
static size_t ports_of(size_t kinds, size_t kind)
{
    for (uint16_t known = 0; known < exchange_image.kind_count; known++) {
        uint64_t hash = 0;

        for (unsigned byte = 0; byte < 8u; byte++) {
            hash |= (uint64_t)image[kinds + 8u * kind + byte] << (8u * byte);
        }
        if (exchange_image.kinds[known].hash == hash) {
            return exchange_image.kinds[known].port_count;
        }
    }
    return 0;
}

/** In an image that is good: a leaf once more, as its own next sibling, with a use and values of its own. */
static void repeat_leaf(void)
{
    size_t count = get16(32);
    size_t leaf = take8(&input) % count;
    size_t at = CANOPY_IMAGE_HEADER + 12u * leaf;
    size_t kinds = CANOPY_IMAGE_HEADER + 12u * count + 4u * get16(34);
    size_t uses = kinds + 8u * (get16(38) + get16(40) + get16(42));
    size_t values = uses + 8u * get16(44);
    size_t ports = get16(at + 8u) != 0xFFFFu ? ports_of(kinds, get16(at + 8u)) : 0u;

    if (!is_user_node(at) || get16(at + 4u) != leaf + 1u || size + 128u > sizeof image) {
        return;
    }
    for (size_t before = CANOPY_IMAGE_HEADER; before < at; before += 12u) {
        if (is_user_node(before) && get16(before + 8u) != 0xFFFFu) {
            uses += 8u;
            values += 12u * ports_of(kinds, get16(before + 8u));
        }
    }
    if (get16(at + 8u) != 0xFFFFu) {
        insert_copy(values, 12u * ports);
        insert_copy(uses, 8);
        put(44, get16(44) + 1u, 2);
        put(48, get16(48) + ports, 2);
    }
    insert_copy(at, 12);
    put(32, count + 1u, 2);
    for (size_t node = 0; node <= count; node++) {
        size_t row = CANOPY_IMAGE_HEADER + 12u * node;

        if (node != leaf && get16(row + 4u) > leaf) {
            put(row + 4u, get16(row + 4u) + 1u, 2);
        }
        if (get16(row + 2u) > leaf) {
            put(row + 2u, get16(row + 2u) + 1u, 2);
        }
    }
}

static void seal(void)
{
    uint32_t crc = UINT32_MAX;

    put(0, UINT64_C(0x100000000) | 0x59504E43u, 6);
    put(8, size, 4);
    put(24, exchange_image.engine, 8);
    for (size_t index = 0; index < size; index++) {
        if (index < 12u || index >= 16u) {
            crc ^= image[index];
            for (unsigned bit = 0; bit < 8u; bit++) {
                crc = (crc & 1u) != 0u ? (crc >> 1) ^ 0xEDB88320u : crc >> 1;
            }
        }
    }
    put(12, ~crc & UINT32_MAX, 4);
}

static void make_image(void)
{
    uint8_t kind = take8(&input);

    if (kind % 4u == 0u) {
        size = (size_t)(input.end - input.next) < sizeof image ? (size_t)(input.end - input.next) : sizeof image;
        for (size_t index = 0; index < size; index++) {
            image[index] = take8(&input);
        }
    } else {
        const uint8_t *good = kind % 4u == 1u ? exchange_main_bytes : exchange_other_bytes;

        size = kind % 4u == 1u ? sizeof exchange_main_bytes : sizeof exchange_other_bytes;
        memcpy(image, good, size);
        for (unsigned leaves = take8(&input) % 8u; leaves > 0u; leaves--) {
            repeat_leaf();
        }
        for (unsigned edits = take8(&input) % (unsigned)EDITS; edits > 0u && size > 16u; edits--) {
            edit();
        }
    }
    if (kind < 240u) {
        seal();
    }
}

/* --- running ----------------------------------------------------------------------------------------------------------- */

static canopy_time_t time;

static canopy_time_t now(void *context)
{
    (void)context;
    return time;
}

static bool never_wait(void *context, canopy_time_t deadline)
{
    (void)context;
    (void)deadline;
    return false;
}

static int receive(void *context, canopy_can_frame_t *frame)
{
    (void)context;
    *frame = (canopy_can_frame_t){.time = time, .id = 256, .length = 2, .data = {take8(&input)}};
    return take8(&input) % 2u == 0u ? 1 : 0;
}

static int send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    (void)context;
    (void)mailbox;
    (void)frame;
    return 1;
}

static void stats(void *context, canopy_can_stats_t *into)
{
    (void)context;
    *into = (canopy_can_stats_t){0};
}

static canopy_loop_t loop;

static void cycles(unsigned most)
{
    for (unsigned cycle = 0; cycle < most; cycle++) {
        canopy_status_t root;

        time += take8(&input) * UINT64_C(200);
        root = canopy_loop_cycle(&loop, time);
        EXPECT(root > CANOPY_IDLE && root <= CANOPY_SKIPPED);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t length)
{
    static const canopy_can_t can = {.receive = receive, .send = send, .stats = stats};
    static const canopy_clock_t clock = {.now = now, .wait_until = never_wait};
    static const canopy_loop_config_t config = {.app = &exchange_app, .can = &can, .clock = &clock, .rx_max = 4};

    input = (input_t){.next = data, .end = data + length};
    time = 0;
    memset(exchange_image.state, 0, sizeof *exchange_image.state);
    EXPECT(canopy_loop_init(&loop, &config) == CANOPY_OK);
    for (unsigned round = 0; round < 3u && input.next != input.end; round++) {
        const canopy_tree_t *running = exchange_app.tree_instance->tree;
        const canopy_tree_t before = *running;
        canopy_image_error_t error;
        uint16_t where;

        make_image();
        error = canopy_image_load(&exchange_image, image, size, &where);
        EXPECT(error <= CANOPY_IMAGE_OK && error >= CANOPY_IMAGE_TREE);
        EXPECT(load_alone() == error);
        EXPECT(exchange_app.tree_instance->tree == running && memcmp(&before, running, sizeof before) == 0);
        cycles(take8(&input) % 8u);
        if (error == CANOPY_IMAGE_OK) {
            EXPECT(canopy_tree_validate(&exchange_image.state->trees[exchange_image.state->loaded - 1u], NULL) ==
                   CANOPY_OK);
            EXPECT(canopy_image_run(&exchange_image, &loop, time) == CANOPY_OK);
        } else {
            EXPECT(canopy_image_run(&exchange_image, &loop, time) == CANOPY_ERROR_NOT_FOUND);
        }
        cycles(take8(&input) % 24u);
        if (take8(&input) % 4u == 0u) {
            EXPECT(canopy_image_run_own(&exchange_image, &loop, time) == CANOPY_OK);
            cycles(2);
        }
    }
    return 0;
}
