/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Tree images at the edges of what a firmware has room for: exactly enough is enough, one less is refused, and nothing
 * beyond a table is read or written.
 */
#include "exchange_app.h"
#include "exchange_main.inc"
#include "exchange_other.inc"
#include "fake_loop.h"
#include "image_bytes.h"
#include "unity.h"

enum { KINDS_MAX = 16, GUARD = 0x5A5A, DRIVE = 3 };

void setUp(void)
{
    fake_loop_start(&exchange_app);
    memset(exchange_image.state, 0, sizeof *exchange_image.state);
    take(exchange_other_bytes, sizeof exchange_other_bytes);
}

void tearDown(void)
{
}

static canopy_image_error_t load_into(const canopy_image_app_t *app, uint16_t *where)
{
    *where = 0xBEEF;
    return canopy_image_load(app, copy, copy_size, where);
}

static void expect(canopy_image_error_t error, uint16_t where, const canopy_image_app_t *app)
{
    uint16_t got;

    TEST_ASSERT_EQUAL_INT(error, load_into(app, &got));
    TEST_ASSERT_EQUAL_UINT16(where, got);
}

static void room_for_exactly_what_is_there_is_enough(void)
{
    const canopy_image_app_t whole = {.app = exchange_image.app,
                                      .engine = exchange_image.engine,
                                      .kinds = exchange_image.kinds,
                                      .scripts = exchange_image.scripts,
                                      .entries = exchange_image.entries,
                                      .slots = {exchange_image.slots[0], exchange_image.slots[1]},
                                      .state = exchange_image.state,
                                      .counts = exchange_image.counts,
                                      .kind_count = exchange_image.kind_count,
                                      .entry_count = exchange_image.entry_count,
                                      .script_leaf = exchange_image.script_leaf,
                                      .nodes_max = (uint16_t)get(AT_NODES, 2),
                                      .parameters_max = (uint16_t)get(AT_PARAMETERS, 2),
                                      .words_max = (uint16_t)get(AT_WORDS, 2),
                                      .uses_max = exchange_image.uses_max,
                                      .texts_max = get(AT_TEXTS, 4)};
    canopy_image_app_t tight = whole;

    TEST_ASSERT_TRUE(whole.nodes_max > 0u && whole.parameters_max > 0u && whole.words_max > 0u && whole.texts_max > 0u);
    expect(CANOPY_IMAGE_OK, 0, &tight);
    tight.nodes_max--;
    expect(CANOPY_IMAGE_TOO_LARGE, 0, &tight);
    tight = whole;
    tight.parameters_max--;
    expect(CANOPY_IMAGE_TOO_LARGE, 1, &tight);
    tight = whole;
    tight.words_max--;
    expect(CANOPY_IMAGE_TOO_LARGE, 2, &tight);
    tight = whole;
    tight.texts_max--;
    expect(CANOPY_IMAGE_TOO_LARGE, 3, &tight);
}

/* Buffers of exactly the image's size, with a guard behind each. */
static void nothing_is_written_beyond_the_buffers(void)
{
    enum { NODES = 64, PARAMETERS = 64 };
    static canopy_node_t nodes[NODES + 1];
    static int32_t parameters[PARAMETERS + 1];
    canopy_image_app_t app = exchange_image;
    const uint32_t node_count = get(AT_NODES, 2);
    const uint32_t parameter_count = get(AT_PARAMETERS, 2);

    TEST_ASSERT_TRUE(node_count <= (uint32_t)NODES && parameter_count <= (uint32_t)PARAMETERS);
    app.slots[0].nodes = nodes;
    app.slots[0].parameters = parameters;
    nodes[node_count].leaf = GUARD;
    nodes[node_count].end = GUARD;
    parameters[parameter_count] = GUARD;
    expect(CANOPY_IMAGE_OK, 0, &app);
    TEST_ASSERT_EQUAL_HEX16(GUARD, nodes[node_count].leaf);
    TEST_ASSERT_EQUAL_HEX16(GUARD, nodes[node_count].end);
    TEST_ASSERT_EQUAL_HEX32(GUARD, parameters[parameter_count]);
}

static void nothing_is_counted_beyond_the_kinds(void)
{
    uint16_t counts[KINDS_MAX + 1];
    canopy_image_app_t app = exchange_image;

    TEST_ASSERT_TRUE(app.kind_count <= (uint16_t)KINDS_MAX);
    app.counts = counts;
    for (unsigned kind = 0; kind <= (unsigned)KINDS_MAX; kind++) {
        counts[kind] = GUARD;
    }
    expect(CANOPY_IMAGE_OK, 0, &app);
    TEST_ASSERT_EQUAL_HEX16(GUARD, counts[app.kind_count]);
}

/* Behind the kinds' hashes lie those of the scripts. A script whose hash is a kind's must not pass for that kind. */
static void a_kind_number_that_the_image_does_not_have_is_refused(void)
{
    enum { SCRIPTS_MAX = 32 };
    uint64_t hashes[SCRIPTS_MAX];
    canopy_image_app_t app = exchange_image;
    const uint16_t kinds = (uint16_t)get(AT_KINDS, 2);
    const uint16_t drive = node_of(DRIVE, 0);
    const uint16_t count = app.app->tree->script_count;

    TEST_ASSERT_TRUE(count <= (uint16_t)SCRIPTS_MAX && get(AT_SCRIPTS, 2) > 0u);
    memcpy(hashes, app.scripts, count * sizeof hashes[0]);
    for (uint16_t script = 0; script < count; script++) {
        uint8_t bytes[8];
        for (unsigned byte = 0; byte < 8u; byte++) {
            bytes[byte] = (uint8_t)(app.scripts[script] >> (8u * byte));
        }
        if (memcmp(bytes, copy + script_at(0), sizeof bytes) == 0) {
            memcpy(copy + script_at(0), copy + kind_at(DRIVE), 8);
            hashes[script] = (uint64_t)get(kind_at(DRIVE), 4) | (uint64_t)get(kind_at(DRIVE) + 4u, 4) << 32;
        }
    }
    app.scripts = hashes;
    seal();
    expect(CANOPY_IMAGE_OK, 0, &app);
    put(node_at(drive) + 8u, kinds, 2);
    seal();
    expect(CANOPY_IMAGE_TREE, drive, &app);
}

/* The last value is taken for the first text: it must not be read as a value. */
static void values_are_not_read_from_what_lies_behind_them(void)
{
    const uint32_t values = get(AT_VALUES, 4);

    put(AT_VALUES, values - 1u, 4);
    put(AT_TEXTS, get(AT_TEXTS, 4) + 12u, 4);
    seal();
    expect(CANOPY_IMAGE_PORTS, node_of(DRIVE, 0), &exchange_image);
}

static void an_image_is_run_once_for_each_load(void)
{
    uint16_t where;

    TEST_ASSERT_EQUAL_INT(CANOPY_IMAGE_OK, load_into(&exchange_image, &where));
    TEST_ASSERT_EQUAL_INT(CANOPY_OK, canopy_image_run(&exchange_image, &loop, time));
    TEST_ASSERT_EQUAL_INT(CANOPY_ERROR_NOT_FOUND, canopy_image_run(&exchange_image, &loop, time));
    TEST_ASSERT_TRUE(canopy_image_running(&exchange_image) != 0u);
    TEST_ASSERT_EQUAL_INT(CANOPY_IMAGE_OK,
                          canopy_image_load(&exchange_image, exchange_main_bytes, sizeof exchange_main_bytes, NULL));
    TEST_ASSERT_EQUAL_INT(CANOPY_OK, canopy_image_run(&exchange_image, &loop, time));
}

static void an_image_that_was_loaded_is_given_up_by_the_next_load(void)
{
    uint16_t where;

    TEST_ASSERT_EQUAL_INT(CANOPY_IMAGE_OK, load_into(&exchange_image, &where));
    copy[AT_CRC] ^= 1u;
    TEST_ASSERT_TRUE(load_into(&exchange_image, &where) != CANOPY_IMAGE_OK);
    TEST_ASSERT_EQUAL_INT(CANOPY_ERROR_NOT_FOUND, canopy_image_run(&exchange_image, &loop, time));
    TEST_ASSERT_TRUE(canopy_image_running(&exchange_image) == 0u);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(room_for_exactly_what_is_there_is_enough);
    RUN_TEST(nothing_is_written_beyond_the_buffers);
    RUN_TEST(nothing_is_counted_beyond_the_kinds);
    RUN_TEST(a_kind_number_that_the_image_does_not_have_is_refused);
    RUN_TEST(values_are_not_read_from_what_lies_behind_them);
    RUN_TEST(an_image_is_run_once_for_each_load);
    RUN_TEST(an_image_that_was_loaded_is_given_up_by_the_next_load);
    return UNITY_END();
}
