/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Tree images (canopy/image.h) in the application "exchange": the image of its own tree ticks as the tree does, another one
 * runs with its own ports, and whatever is wrong with an image is refused without touching what runs.
 */
#include <stddef.h>
#include <string.h>

#include "exchange_app.h"
#include "exchange_main.inc"
#include "exchange_other.inc"
#include "fake_loop.h"
#include "image_bytes.h"
#include "unity.h"

enum { PERIOD_US = 10000, CLIMATE_ID = 256, FAN_ID = 512, TICKS = 60, NODES_MAX = 40 };

void setUp(void)
{
    fake_loop_start(&exchange_app);
    memset(&exchange_seen, 0, sizeof exchange_seen);
    /* Buffers as they are when the program starts, so that no test lives on what another one has left. */
    memset(exchange_image.state, 0, sizeof *exchange_image.state);
    TEST_ASSERT_TRUE(canopy_image_running(&exchange_image) == 0u);
}

void tearDown(void)
{
}

static canopy_image_error_t load_copy(uint16_t *where)
{
    *where = 0xBEEF;
    return canopy_image_load(&exchange_image, copy, copy_size, where);
}

/** Seals the copy and expects this refusal, and that nothing is loaded then. */
static void refused(canopy_image_error_t error, uint16_t where)
{
    uint16_t got;

    seal();
    TEST_ASSERT_EQUAL_INT(error, load_copy(&got));
    TEST_ASSERT_EQUAL_UINT16(where, got);
    TEST_ASSERT_EQUAL_INT(CANOPY_ERROR_NOT_FOUND, canopy_image_run(&exchange_image, &loop, time));
}

/* --- running --------------------------------------------------------------------------------------------------------- */

static void cycle(void)
{
    canopy_can_frame_t *frame = &fake.rx[0];
    uint16_t temperature = (uint16_t)(time / PERIOD_US);

    *frame = (canopy_can_frame_t){.id = CLIMATE_ID, .length = 2};
    frame->data[0] = (uint8_t)(temperature & 0xFFu);
    (void)fake_loop_cycle(1);
}

typedef struct {
    exchange_seen_t seen;
    exchange_entries_t entries;
    uint32_t sent_id;
    uint16_t speed;
    uint8_t sent[2];
    uint8_t status[NODES_MAX];
} record_t;

static record_t records[TICKS];

static void record(record_t *into)
{
    memset(into, 0, sizeof *into);
    for (uint16_t node = 0; node < exchange_app.tree_instance->tree->node_count; node++) {
        into->status[node] = canopy_tree_status_code(exchange_app.tree_instance, node);
    }
    memcpy(&into->entries, exchange_entries, sizeof into->entries);
    memcpy(&into->seen, &exchange_seen, sizeof into->seen);
    into->speed = exchange_output->fan.speed;
    into->sent_id = fake.tx_count > 0u ? fake.tx[0].id : 0u;
    memcpy(into->sent, fake.tx[0].data, sizeof into->sent);
}

static void load_and_run(const uint8_t *bytes, size_t size)
{
    TEST_ASSERT_EQUAL_INT(CANOPY_IMAGE_OK, canopy_image_load(&exchange_image, bytes, size, NULL));
    TEST_ASSERT_EQUAL_INT(CANOPY_OK, canopy_image_run(&exchange_image, &loop, time));
    TEST_ASSERT_EQUAL_UINT8(3, exchange_app.trace_state->announcements); /* the trace tells that it is another tree */
}

/** Ticks the tree that is there from the start on and keeps, or compares, what there is to be seen. */
static void run_for_records(bool compare)
{
    time = 0;
    memset(&exchange_seen, 0, sizeof exchange_seen);
    for (unsigned tick = 0; tick < (unsigned)TICKS; tick++) {
        record_t seen;

        memset(&fake.tx[0], 0, sizeof fake.tx[0]);
        loop.ticks = tick;
        cycle();
        record(&seen);
        if (compare) {
            TEST_ASSERT_EQUAL_UINT8_ARRAY(records[tick].status, seen.status, NODES_MAX);
            TEST_ASSERT_EQUAL_MEMORY(&records[tick], &seen, sizeof seen);
        }
        memcpy(&records[tick], &seen, sizeof seen);
    }
}

static void the_image_of_the_own_tree_ticks_as_the_tree(void)
{
    run_for_records(false);
    TEST_ASSERT_TRUE(exchange_seen.starts > 3u && exchange_seen.halts > 2u); /* something happened */
    load_and_run(exchange_main_bytes, sizeof exchange_main_bytes);
    TEST_ASSERT_TRUE(canopy_image_running(&exchange_image) == EXCHANGE_TREE_HASH);
    TEST_ASSERT_EQUAL_HEX32(EXCHANGE_TREE_HASH >> 32, exchange_app.tree_instance->tree->hash);
    run_for_records(true);
    TEST_ASSERT_EQUAL_INT(CANOPY_OK, canopy_image_run_own(&exchange_image, &loop, time));
    TEST_ASSERT_TRUE(canopy_image_running(&exchange_image) == 0u);
    run_for_records(true);
    /* Twice more, so that both buffers have run. */
    load_and_run(exchange_main_bytes, sizeof exchange_main_bytes);
    run_for_records(true);
    load_and_run(exchange_main_bytes, sizeof exchange_main_bytes);
    TEST_ASSERT_EQUAL_UINT8(2, exchange_image.state->running);
    run_for_records(true);
    load_and_run(exchange_main_bytes, sizeof exchange_main_bytes);
    TEST_ASSERT_EQUAL_UINT8(1, exchange_image.state->running);
    run_for_records(true);
}

static void expect_compare(unsigned index, const compare_seen_t *expected)
{
    const compare_seen_t *seen = &exchange_seen.compares[index];

    TEST_ASSERT_EQUAL(expected->exact, seen->exact);
    TEST_ASSERT_EQUAL_INT8(expected->small, seen->small);
    TEST_ASSERT_EQUAL_UINT16(expected->count, seen->count);
    TEST_ASSERT_EQUAL_UINT32(expected->after, seen->after);
    TEST_ASSERT_TRUE(expected->wide == seen->wide);
    TEST_ASSERT_EQUAL_STRING(expected->label, seen->label);
}

static void another_tree_runs_with_its_own_ports(void)
{
    load_and_run(exchange_other_bytes, sizeof exchange_other_bytes);
    TEST_ASSERT_EQUAL_UINT16(14, exchange_app.tree_instance->tree->node_count);
    cycle();
    TEST_ASSERT_EQUAL_UINT(3, exchange_seen.compare_count);
    expect_compare(0, &(compare_seen_t){true, 127, 1, 7, INT64_C(9000000000000000000), "three"});
    expect_compare(1, &(compare_seen_t){false, 1, 300, 7, -1, "four"});
    expect_compare(2, &(compare_seen_t){false, 0, 0, 0, 0, "one"});
    TEST_ASSERT_EQUAL_INT32(2, exchange_entries->count); /* Measure twice */
    TEST_ASSERT_EQUAL_UINT32(2, exchange_entries->count_updates);
    TEST_ASSERT_EQUAL_INT32(1, exchange_entries->pose.x); /* the second one's pose is not connected */
    TEST_ASSERT_EQUAL_UINT(1, exchange_seen.notes);
    TEST_ASSERT_EQUAL_INT32(0, exchange_entries->note); /* Note's port is not connected */
    TEST_ASSERT_EQUAL_UINT16(777, exchange_seen.speed);
    TEST_ASSERT_FALSE(exchange_seen.fast);
    TEST_ASSERT_EQUAL(GEAR_LOW, exchange_seen.gear);
    TEST_ASSERT_EQUAL_STRING("measured", exchange_seen.label);
    TEST_ASSERT_EQUAL_INT16(0, exchange_seen.temperature);
    TEST_ASSERT_EQUAL_UINT16(777, exchange_output->fan.speed);
    cycle();
    expect_compare(4, &(compare_seen_t){false, 1, 301, 7, -1, "four"}); /* the entry as it is now */
    TEST_ASSERT_EQUAL_INT16(1, exchange_seen.temperature);
    TEST_ASSERT_EQUAL_UINT16(778, exchange_output->fan.speed); /* Drive's state */
}

static void the_tree_that_ran_is_halted_and_all_begins_again(void)
{
    cycle();
    cycle();
    TEST_ASSERT_EQUAL_UINT(1, exchange_seen.starts);
    exchange_app.tree_instance->faults = 7;
    fake.tx_count = 0;
    load_and_run(exchange_main_bytes, sizeof exchange_main_bytes);
    TEST_ASSERT_EQUAL_UINT(1, exchange_seen.halts);
    TEST_ASSERT_EQUAL_UINT(1, fake.tx_count);
    TEST_ASSERT_EQUAL_UINT32(FAN_ID, fake.tx[0].id);
    TEST_ASSERT_EQUAL_UINT8(301 & 0xFF, fake.tx[0].data[0]); /* what the halt handler wrote */
    TEST_ASSERT_EQUAL_UINT16(300, exchange_entries->level);
    TEST_ASSERT_EQUAL_INT32(0, exchange_entries->count);
    TEST_ASSERT_EQUAL_UINT32(7, exchange_app.tree_instance->faults);
    TEST_ASSERT_EQUAL(CANOPY_IDLE, canopy_tree_status(exchange_app.tree_instance, 0));
    cycle();
    TEST_ASSERT_EQUAL_UINT16(300, exchange_output->fan.speed); /* Drive's state is 0 again */
}

static void what_runs_goes_on_while_another_is_refused_or_loaded(void)
{
    uint16_t where;

    load_and_run(exchange_main_bytes, sizeof exchange_main_bytes);
    run_for_records(false);
    load_and_run(exchange_main_bytes, sizeof exchange_main_bytes);
    time = 0;
    memset(&exchange_seen, 0, sizeof exchange_seen);
    for (unsigned tick = 0; tick < (unsigned)TICKS; tick++) {
        record_t seen;

        memset(&fake.tx[0], 0, sizeof fake.tx[0]);
        loop.ticks = tick;
        cycle();
        record(&seen);
        TEST_ASSERT_EQUAL_MEMORY(&records[tick], &seen, sizeof seen);
        take(exchange_other_bytes, sizeof exchange_other_bytes);
        put(use_at(6), 1, 8); /* refused late: at its last leaf */
        seal();
        TEST_ASSERT_EQUAL_INT(CANOPY_IMAGE_PORTS, load_copy(&where));
        TEST_ASSERT_EQUAL_INT(CANOPY_IMAGE_OK, canopy_image_load(&exchange_image, exchange_other_bytes,
                                                                 sizeof exchange_other_bytes, NULL));
    }
}

static void an_image_is_not_run_in_the_loop_of_another_application(void)
{
    canopy_app_t other_app = exchange_app;
    const canopy_loop_config_t other_config = {.app = &other_app, .can = &fake_can, .clock = &fake_clock};
    canopy_loop_t other = {.config = &other_config};

    cycle();
    fake.tx_count = 0;
    TEST_ASSERT_EQUAL_INT(CANOPY_IMAGE_OK,
                          canopy_image_load(&exchange_image, exchange_other_bytes, sizeof exchange_other_bytes, NULL));
    TEST_ASSERT_EQUAL_INT(CANOPY_ERROR_ARGUMENT, canopy_image_run(&exchange_image, &other, time));
    TEST_ASSERT_EQUAL_INT(CANOPY_ERROR_ARGUMENT, canopy_image_run_own(&exchange_image, &other, time));
    TEST_ASSERT_EQUAL_UINT(0, fake.tx_count);
    TEST_ASSERT_EQUAL_PTR(exchange_app.tree, exchange_app.tree_instance->tree);
    TEST_ASSERT_EQUAL_INT(CANOPY_OK, canopy_image_run(&exchange_image, &loop, time)); /* it is still loaded */
}

static void an_application_without_a_trace_exchanges_its_tree_too(void)
{
    canopy_app_t silent = exchange_app;
    canopy_image_app_t image = exchange_image;
    const canopy_loop_config_t its_config = {.app = &silent, .can = &fake_can, .clock = &fake_clock};
    canopy_loop_t its_loop;

    silent.trace = NULL;
    image.app = &silent;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&its_loop, &its_config));
    TEST_ASSERT_EQUAL_INT(CANOPY_IMAGE_OK,
                          canopy_image_load(&image, exchange_other_bytes, sizeof exchange_other_bytes, NULL));
    TEST_ASSERT_EQUAL_INT(CANOPY_OK, canopy_image_run(&image, &its_loop, 0));
    TEST_ASSERT_TRUE(canopy_image_running(&image) != 0u);
    fake.tx_count = 0;
    (void)canopy_loop_cycle(&its_loop, silent.period);
    TEST_ASSERT_EQUAL_UINT(1, fake.tx_count); /* the command alone */
}

static void an_exchange_on_a_bus_that_lets_nothing_out_says_so_and_is_done(void)
{
    cycle();
    TEST_ASSERT_EQUAL_INT(CANOPY_IMAGE_OK,
                          canopy_image_load(&exchange_image, exchange_other_bytes, sizeof exchange_other_bytes, NULL));
    fake.tx_result = 0;
    TEST_ASSERT_EQUAL_INT(CANOPY_ERROR_BUS_DOWN, canopy_image_run(&exchange_image, &loop, time));
    TEST_ASSERT_TRUE(canopy_image_running(&exchange_image) != 0u);
    TEST_ASSERT_EQUAL_INT(CANOPY_ERROR_NOT_FOUND, canopy_image_run(&exchange_image, &loop, time)); /* not once more */
    TEST_ASSERT_EQUAL_INT(CANOPY_ERROR_BUS_DOWN, canopy_image_run_own(&exchange_image, &loop, time));
    TEST_ASSERT_TRUE(canopy_image_running(&exchange_image) == 0u);
}

static void an_image_may_lie_at_any_address(void)
{
    for (unsigned offset = 0; offset < 8u; offset++) {
        memcpy(copy + offset, exchange_other_bytes, sizeof exchange_other_bytes);
        TEST_ASSERT_EQUAL_INT(CANOPY_IMAGE_OK,
                              canopy_image_load(&exchange_image, copy + offset, sizeof exchange_other_bytes, NULL));
    }
}

/* --- refusals -------------------------------------------------------------------------------------------------------- */

static void null_pointers_are_refused(void)
{
    TEST_ASSERT_EQUAL_INT(CANOPY_IMAGE_ARGUMENT, canopy_image_load(NULL, copy, 1, NULL));
    TEST_ASSERT_EQUAL_INT(CANOPY_IMAGE_ARGUMENT, canopy_image_load(&exchange_image, NULL, 1, NULL));
    TEST_ASSERT_EQUAL_INT(CANOPY_ERROR_NOT_FOUND, canopy_image_run(&exchange_image, &loop, time));
}

static void every_other_length_is_refused(void)
{
    for (size_t size = 0; size < sizeof exchange_other_bytes; size++) {
        TEST_ASSERT_EQUAL_INT(CANOPY_IMAGE_SIZE, canopy_image_load(&exchange_image, exchange_other_bytes, size, NULL));
    }
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    copy_size++;
    TEST_ASSERT_EQUAL_INT(CANOPY_IMAGE_SIZE, canopy_image_load(&exchange_image, copy, copy_size, NULL));
    /* A right CRC over a part, too: the parts do not fill it. */
    for (size_t size = CANOPY_IMAGE_HEADER; size < sizeof exchange_other_bytes; size += 7u) {
        take(exchange_other_bytes, size);
        refused(CANOPY_IMAGE_SIZE, 0);
    }
}

static void every_flipped_bit_is_refused(void)
{
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    for (size_t bit = 0; bit < 8u * sizeof exchange_other_bytes; bit++) {
        canopy_image_error_t error;

        copy[bit / 8u] ^= (uint8_t)(1u << (bit % 8u));
        error = canopy_image_load(&exchange_image, copy, copy_size, NULL);
        TEST_ASSERT_EQUAL_INT(bit < 32u                           ? CANOPY_IMAGE_MAGIC
                              : bit < 48u                         ? CANOPY_IMAGE_FORMAT
                              : bit / 32u == (size_t)AT_SIZE / 4u ? CANOPY_IMAGE_SIZE
                                                                  : CANOPY_IMAGE_CRC,
                              error);
        copy[bit / 8u] ^= (uint8_t)(1u << (bit % 8u));
    }
}

static void other_formats_and_engines_are_refused(void)
{
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    put(AT_VERSION, 2, 2);
    refused(CANOPY_IMAGE_FORMAT, 0);
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    copy[AT_ENGINE + 7] ^= 0x80u;
    refused(CANOPY_IMAGE_ENGINE, 0);
}

static void what_is_too_large_is_refused(void)
{
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    resize(parameters_at(), 27 * 12);
    put(AT_NODES, 14 + 27, 2);
    refused(CANOPY_IMAGE_TOO_LARGE, 0);
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    resize(parameters_at(), 80 * 4);
    put(AT_PARAMETERS, 81, 2);
    refused(CANOPY_IMAGE_TOO_LARGE, 1);
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    put(AT_WORDS, 81, 2);
    refused(CANOPY_IMAGE_TOO_LARGE, 2);
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    put(AT_TEXTS, exchange_image.texts_max + 1u, 4);
    resize(copy_size, (int)(texts_at() + exchange_image.texts_max + 1u - copy_size));
    refused(CANOPY_IMAGE_TOO_LARGE, 3);
}

static void what_the_firmware_does_not_have_is_refused(void)
{
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    for (uint16_t kind = 0; kind < (uint16_t)get(AT_KINDS, 2); kind++) {
        copy[kind_at(kind)] ^= 1u;
        refused(CANOPY_IMAGE_KIND, kind);
        copy[kind_at(kind)] ^= 1u;
    }
    for (uint16_t script = 0; script < (uint16_t)get(AT_SCRIPTS, 2); script++) {
        copy[script_at(script) + 7u] ^= 1u;
        refused(CANOPY_IMAGE_SCRIPT, script);
        copy[script_at(script) + 7u] ^= 1u;
    }
    for (uint16_t entry = 0; entry < (uint16_t)get(AT_ENTRIES, 2); entry++) {
        copy[entry_at(entry) + 3u] ^= 1u;
        refused(CANOPY_IMAGE_ENTRY, entry);
        copy[entry_at(entry) + 3u] ^= 1u;
    }
}

static void more_scripts_than_the_firmware_has_are_refused(void)
{
    uint16_t there = exchange_app.tree->script_count;
    uint16_t scripts;

    take(exchange_other_bytes, sizeof exchange_other_bytes);
    scripts = (uint16_t)get(AT_SCRIPTS, 2);
    for (; scripts <= there; scripts++) {
        size_t at = script_at(scripts);

        resize(at, 8);
        memcpy(copy + at, copy + script_at(0), 8);
        put(AT_SCRIPTS, scripts + 1u, 2);
    }
    refused(CANOPY_IMAGE_SCRIPT, there);
}

/* Kinds of other.xml in their order there. */
enum { COMPARE, MEASURE, NOTE, DRIVE };
/* Their values: three uses of Compare, two of Measure, Note, Drive. */
enum { COMPARE_VALUES = 0, MEASURE_VALUES = 18, NOTE_VALUES = 22, DRIVE_VALUES = 23 };
/* Ports of Compare and Drive. */
enum { EXACT, SMALL, COUNT, AFTER, WIDE, LABEL };
enum { SPEED, FAST, GEAR, POSE, DRIVE_LABEL };

static void value_refused(uint16_t value, uint32_t source, uint64_t bits, canopy_image_error_t error, uint16_t node)
{
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    put(value_at(value), source, 4);
    put(value_at(value) + 4u, bits, 8);
    refused(error, node);
}

static uint64_t entry_called(const canopy_image_entry_t *table, size_t offset)
{
    for (uint16_t entry = 0; entry < (uint16_t)get(AT_ENTRIES, 2); entry++) {
        for (uint16_t known = 0; known < exchange_image.entry_count; known++) {
            uint64_t hash = get(entry_at(entry), 4) | ((uint64_t)get(entry_at(entry) + 4u, 4) << 32);
            size_t base = (size_t)((uintptr_t)exchange_entries - (uintptr_t)exchange_app.memory);

            if (table[known].hash == hash && table[known].offset == base + offset) {
                return entry;
            }
        }
    }
    TEST_FAIL_MESSAGE("no such entry");
    return 0;
}

#define ENTRY(name) entry_called(exchange_image.entries, offsetof(exchange_entries_t, name))

static void ports_that_do_not_fit_are_refused(void)
{
    uint64_t level, quick, count, note, pose, label;
    uint16_t compare, drive, note_node;

    take(exchange_other_bytes, sizeof exchange_other_bytes);
    level = ENTRY(level);
    quick = ENTRY(quick);
    count = ENTRY(count);
    note = ENTRY(note);
    pose = ENTRY(pose);
    label = ENTRY(label);
    compare = node_of(COMPARE, 0);
    drive = node_of(DRIVE, 0);
    note_node = node_of(NOTE, 0);

    /* Numbers that their type does not hold. */
    value_refused(COMPARE_VALUES + EXACT, CANOPY_IMAGE_FROM_CONSTANT, 2, CANOPY_IMAGE_PORTS, compare);
    value_refused(COMPARE_VALUES + SMALL, CANOPY_IMAGE_FROM_CONSTANT, 0x100, CANOPY_IMAGE_PORTS, compare);
    value_refused(COMPARE_VALUES + COUNT, CANOPY_IMAGE_FROM_CONSTANT, 0x10000, CANOPY_IMAGE_PORTS, compare);
    value_refused(COMPARE_VALUES + AFTER, CANOPY_IMAGE_FROM_CONSTANT, UINT64_C(1) << 32, CANOPY_IMAGE_PORTS, compare);
    /* Entries of another type, or that are not there. */
    value_refused(COMPARE_VALUES + EXACT, CANOPY_IMAGE_FROM_ENTRY, level, CANOPY_IMAGE_PORTS, compare);
    value_refused(COMPARE_VALUES + COUNT, CANOPY_IMAGE_FROM_ENTRY, quick, CANOPY_IMAGE_PORTS, compare);
    value_refused(COMPARE_VALUES + COUNT, CANOPY_IMAGE_FROM_ENTRY, 7, CANOPY_IMAGE_PORTS, compare);
    value_refused(COMPARE_VALUES + COUNT, CANOPY_IMAGE_FROM_ENTRY, UINT64_C(1) << 32, CANOPY_IMAGE_PORTS, compare);
    /* Sources that the port cannot have, or nothing can. */
    value_refused(COMPARE_VALUES + COUNT, CANOPY_IMAGE_FROM_NOTHING, 0, CANOPY_IMAGE_PORTS, compare);
    value_refused(COMPARE_VALUES + AFTER, CANOPY_IMAGE_FROM_TEXT, 0, CANOPY_IMAGE_PORTS, compare);
    value_refused(COMPARE_VALUES + COUNT, CANOPY_IMAGE_FROM_BASE, 0, CANOPY_IMAGE_PORTS, compare);
    value_refused(COMPARE_VALUES + COUNT, 5, 0, CANOPY_IMAGE_PORTS, compare);
    value_refused(COMPARE_VALUES + LABEL, CANOPY_IMAGE_FROM_TEXT, 15, CANOPY_IMAGE_PORTS, compare);
    value_refused(COMPARE_VALUES + LABEL, CANOPY_IMAGE_FROM_TEXT, UINT64_C(1) << 32, CANOPY_IMAGE_PORTS, compare);
    value_refused(COMPARE_VALUES + LABEL, CANOPY_IMAGE_FROM_CONSTANT, 0, CANOPY_IMAGE_PORTS, compare);
    value_refused(DRIVE_VALUES + DRIVE_LABEL, CANOPY_IMAGE_FROM_ENTRY, label, CANOPY_IMAGE_PORTS, drive);
    value_refused(DRIVE_VALUES + POSE, CANOPY_IMAGE_FROM_NOTHING, 0, CANOPY_IMAGE_PORTS, drive);
    value_refused(DRIVE_VALUES + POSE, CANOPY_IMAGE_FROM_CONSTANT, 0, CANOPY_IMAGE_PORTS, drive);
    value_refused(DRIVE_VALUES + POSE, CANOPY_IMAGE_FROM_ENTRY, count, CANOPY_IMAGE_PORTS, drive);
    value_refused(DRIVE_VALUES + GEAR, CANOPY_IMAGE_FROM_ENTRY, pose, CANOPY_IMAGE_PORTS, drive);
    /* A node of the firmware waits for updates of `count`, and Note does not count them. */
    value_refused(NOTE_VALUES, CANOPY_IMAGE_FROM_ENTRY, count, CANOPY_IMAGE_PORTS, note_node);

    /* A base that is no use of the firmware. */
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    put(use_at(6), 1, 8);
    refused(CANOPY_IMAGE_PORTS, drive);

    /* And what does fit. */
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    put(value_at(NOTE_VALUES), CANOPY_IMAGE_FROM_ENTRY, 4);
    put(value_at(NOTE_VALUES) + 4u, note, 8);
    put(value_at(COMPARE_VALUES + COUNT) + 4u, 0xFFFF, 8);
    put(value_at(DRIVE_VALUES + FAST), CANOPY_IMAGE_FROM_BASE, 4); /* the base's {quick} */
    put(value_at(MEASURE_VALUES), CANOPY_IMAGE_FROM_NOTHING, 4);
    seal();
    load_and_run(copy, copy_size);
    cycle();
    TEST_ASSERT_EQUAL_INT32(5, exchange_entries->note);
    TEST_ASSERT_EQUAL_UINT16(0xFFFF, exchange_seen.compares[0].count);
    TEST_ASSERT_TRUE(exchange_seen.fast);
    TEST_ASSERT_EQUAL_INT32(0, exchange_entries->pose.x);
}

static void uses_and_values_must_match_the_nodes(void)
{
    /* One use too few: the last leaf has none. */
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    resize(use_at(6), -8);
    put(AT_USES, 6, 4);
    refused(CANOPY_IMAGE_TREE, node_of(DRIVE, 0));
    /* One too many. */
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    resize(use_at(7), 8);
    put(AT_USES, 8, 4);
    refused(CANOPY_IMAGE_SIZE, 0);
    /* The same with values. */
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    resize(value_at(28), -12);
    put(AT_VALUES, 28, 4);
    refused(CANOPY_IMAGE_PORTS, node_of(DRIVE, 0));
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    resize(value_at(29), 12);
    put(AT_VALUES, 30, 4);
    refused(CANOPY_IMAGE_SIZE, 0);
    /* Texts without an end. */
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    copy[copy_size - 1u] = 'x';
    refused(CANOPY_IMAGE_SIZE, 0);
}

static void more_uses_of_a_kind_than_there_is_room_for_are_refused(void)
{
    uint16_t node;

    take(exchange_main_bytes, sizeof exchange_main_bytes);
    /* Idle has no ports, so a use of it is 8 bytes: five of them, at the end, in a tree of their own. */
    for (node = 0; copy[node_at(node)] != CANOPY_NODE_CONDITION || get(node_at(node) + 8u, 2) != 3u; node++) {}
    memcpy(copy + node_at(1), copy + node_at(node), 12);
    put(node_at(0), CANOPY_NODE_REACTIVE_FALLBACK, 1);
    put(node_at(0) + 4u, 6, 2);
    for (node = 1; node < 6u; node++) {
        memcpy(copy + node_at(node), copy + node_at(1), 12);
        put(node_at(node) + 2u, 0, 2);
        put(node_at(node) + 4u, node + 1u, 2);
    }
    resize(value_at(0), -(int)(12u * get(AT_VALUES, 4)));
    resize(use_at(0), -(int)(8u * get(AT_USES, 4)));
    resize(use_at(0), 5 * 8);
    resize(node_at(6), -(int)(12u * (get(AT_NODES, 2) - 6u)));
    put(AT_NODES, 6, 2);
    put(AT_USES, 5, 4);
    put(AT_VALUES, 0, 4);
    refused(CANOPY_IMAGE_USES, 5);
    /* A base for a leaf without ports. */
    put(use_at(0), 1, 8);
    refused(CANOPY_IMAGE_PORTS, 1);
    put(use_at(0), 0, 8);
    /* Four of them are not too many. */
    resize(use_at(4), -8);
    resize(node_at(5), -12);
    put(AT_NODES, 5, 2);
    put(AT_USES, 4, 4);
    put(node_at(0) + 4u, 5, 2);
    seal();
    load_and_run(copy, copy_size);
    cycle();
    TEST_ASSERT_EQUAL(CANOPY_FAILURE, canopy_tree_status(exchange_app.tree_instance, 0));
}

static void trees_that_are_not_well_formed_are_refused(void)
{
    uint16_t compare;

    take(exchange_other_bytes, sizeof exchange_other_bytes);
    compare = node_of(COMPARE, 1);
    put(node_at(compare) + 2u, 0, 2); /* parent */
    refused(CANOPY_IMAGE_TREE, (uint16_t)(compare - 1u));
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    put(node_at(compare), CANOPY_NODE_SYNC_ACTION, 1); /* Compare is a Condition */
    refused(CANOPY_IMAGE_TREE, compare);
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    put(node_at(compare) + 8u, 4, 2); /* the kind's number */
    refused(CANOPY_IMAGE_TREE, compare);
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    put(node_at(1), CANOPY_NODE_TYPES, 1);
    refused(CANOPY_IMAGE_TREE, 1);
    /* A script that the image does not name. */
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    compare = node_of(CANOPY_IMAGE_NONE, 0);
    put(node_at(compare) + 10u, get(AT_SCRIPTS, 2), 2);
    refused(CANOPY_IMAGE_TREE, compare);
    /* No node at all. */
    memset(copy + AT_NODES, 0, 24);
    copy_size = CANOPY_IMAGE_HEADER;
    refused(CANOPY_IMAGE_TREE, 0);
}

static void a_firmware_without_scripts_refuses_them(void)
{
    canopy_image_app_t without = exchange_image;
    uint16_t where;

    without.script_leaf = CANOPY_IMAGE_NONE;
    TEST_ASSERT_EQUAL_INT(CANOPY_IMAGE_TREE,
                          canopy_image_load(&without, exchange_other_bytes, sizeof exchange_other_bytes, &where));
    take(exchange_other_bytes, sizeof exchange_other_bytes);
    TEST_ASSERT_EQUAL_UINT16(node_of(CANOPY_IMAGE_NONE, 0), where);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_image_of_the_own_tree_ticks_as_the_tree);
    RUN_TEST(another_tree_runs_with_its_own_ports);
    RUN_TEST(the_tree_that_ran_is_halted_and_all_begins_again);
    RUN_TEST(what_runs_goes_on_while_another_is_refused_or_loaded);
    RUN_TEST(an_image_is_not_run_in_the_loop_of_another_application);
    RUN_TEST(an_application_without_a_trace_exchanges_its_tree_too);
    RUN_TEST(an_exchange_on_a_bus_that_lets_nothing_out_says_so_and_is_done);
    RUN_TEST(an_image_may_lie_at_any_address);
    RUN_TEST(null_pointers_are_refused);
    RUN_TEST(every_other_length_is_refused);
    RUN_TEST(every_flipped_bit_is_refused);
    RUN_TEST(other_formats_and_engines_are_refused);
    RUN_TEST(what_is_too_large_is_refused);
    RUN_TEST(what_the_firmware_does_not_have_is_refused);
    RUN_TEST(more_scripts_than_the_firmware_has_are_refused);
    RUN_TEST(ports_that_do_not_fit_are_refused);
    RUN_TEST(uses_and_values_must_match_the_nodes);
    RUN_TEST(more_uses_of_a_kind_than_there_is_room_for_are_refused);
    RUN_TEST(trees_that_are_not_well_formed_are_refused);
    RUN_TEST(a_firmware_without_scripts_refuses_them);
    return UNITY_END();
}
