/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A replay's files: frames as they were written, what is no record, and what cannot be opened or written.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "canopy/can_state.h"
#include "canopy/clock/replay_files.h"
#include "unity.h"

static canopy_replay_files_t files;
static char message[CANOPY_REPLAY_MESSAGE];
static char folder[64];
static char record[100];
static char sent[100];

/* Bytes of a record: a tick with its time, the state of the bus, overload and return; frames with their age, header
 * (version, flags, length, 0, id), and data. */
static const uint8_t tick[] = {'T', 5, 4, 3, 2, 1, 0, 7, 0, CANOPY_CAN_BUS_OFF, 3};
static const uint8_t sensor[] = {'F', 0x34, 0x12, 1, 0, 2, 0, 0x00, 0x01, 0, 0, 0xAB, 0xCD};
static const uint8_t request[] = {'F', 0, 0, 1, 2, 8, 0, 0x00, 0x01, 0, 0}; /* remote: a length, and no data */
static const uint8_t old[] = {1, 0, 8, 0, 0x04, 0x06, 0, 0, 5, 4, 3, 2, 1, 0, 77, 88}; /* of version 1 */

void setUp(void)
{
    message[0] = '\0';
    (void)snprintf(folder, sizeof folder, "/tmp/canopy-test-XXXXXX");
    TEST_ASSERT_NOT_NULL(mkdtemp(folder));
    (void)snprintf(record, sizeof record, "%s/record", folder);
    (void)snprintf(sent, sizeof sent, "%s/sent", folder);
}

void tearDown(void)
{
    (void)unlink(record);
    (void)unlink(sent);
    (void)rmdir(folder);
}

static void append(const uint8_t *bytes, size_t size)
{
    FILE *file = fopen(record, "ab");

    TEST_ASSERT_NOT_NULL(file);
    TEST_ASSERT_EQUAL(size, fwrite(bytes, 1, size, file));
    TEST_ASSERT_EQUAL(0, fclose(file));
}

static void begin(void)
{
    (void)unlink(record);
    append((const uint8_t *)CANOPY_REPLAY_BEGIN, sizeof CANOPY_REPLAY_BEGIN - 1u);
}

static canopy_error_t open_files(const char *to)
{
    return canopy_replay_open(&files, record, to, message, sizeof message);
}

static void test_frames_come_and_go_as_they_are(void)
{
    const canopy_can_t *can = &files.replay.can;
    canopy_can_conditions_t conditions;
    canopy_can_frame_t frame; /* its bytes behind the data are never written: nor may they be in the file */
    uint8_t written[sizeof sensor];
    FILE *file;

    begin();
    append(tick, sizeof tick);
    append(sensor, sizeof sensor);
    append(request, sizeof request);
    TEST_ASSERT_EQUAL_MESSAGE(CANOPY_OK, open_files(sent), message);
    TEST_ASSERT_EQUAL_STRING("", message);
    TEST_ASSERT_TRUE(files.replay.clock.wait_until(files.replay.clock.context, 0));
    TEST_ASSERT_TRUE(files.replay.clock.now(files.replay.clock.context) == UINT64_C(0x0007000102030405));
    can->conditions(can->context, &conditions);
    TEST_ASSERT_EQUAL_UINT8(CANOPY_CAN_BUS_OFF, conditions.can_state);
    TEST_ASSERT_TRUE(conditions.overload && conditions.returning);
    TEST_ASSERT_EQUAL(1, can->receive(can->context, &frame));
    TEST_ASSERT_TRUE(frame.time == UINT64_C(0x0007000102030405) - UINT64_C(1000) * 0x1234u);
    TEST_ASSERT_EQUAL_HEX32(0x100, frame.id);
    TEST_ASSERT_EQUAL_UINT8(2, frame.length);
    TEST_ASSERT_EQUAL_HEX8(0xCD, frame.data[1]);
    TEST_ASSERT_EQUAL(1, can->send(can->context, 0, &frame));
    TEST_ASSERT_EQUAL(1, can->receive(can->context, &frame));
    TEST_ASSERT_EQUAL_HEX8(CANOPY_CAN_REMOTE, frame.flags);
    TEST_ASSERT_EQUAL_UINT8(8, frame.length);
    TEST_ASSERT_EQUAL(0, can->receive(can->context, &frame));
    TEST_ASSERT_FALSE(files.replay.clock.wait_until(files.replay.clock.context, 0));
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_replay_close(&files));
    file = fopen(sent, "rb");
    TEST_ASSERT_NOT_NULL(file);
    TEST_ASSERT_EQUAL(sizeof sensor - 3u, fread(written, 1, sizeof written, file)); /* the frame alone */
    TEST_ASSERT_EQUAL_HEX8_ARRAY(sensor + 3, written, sizeof sensor - 3u);
    TEST_ASSERT_EQUAL(0, fclose(file));
}

static void test_nothing_need_be_written(void)
{
    const canopy_can_frame_t frame = {.id = 1};

    begin();
    append(tick, sizeof tick);
    TEST_ASSERT_EQUAL(CANOPY_OK, open_files(NULL));
    TEST_ASSERT_EQUAL(1, files.replay.can.send(files.replay.can.context, 0, &frame));
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_replay_close(&files));
}

static void expect_refused(canopy_error_t error, const char *text)
{
    TEST_ASSERT_EQUAL(error, open_files(sent));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(message, text), message);
    TEST_ASSERT_LESS_THAN(sizeof message - 1u, strlen(message)); /* not shortened */
}

static void test_what_cannot_be_opened_says_why(void)
{
    expect_refused(CANOPY_ERROR_NOT_FOUND, record);
    append(old, sizeof old);
    expect_refused(CANOPY_ERROR_NOT_FOUND, "one of another version of Canopy; `canopy replay --keep` makes one");
    begin();
    expect_refused(CANOPY_ERROR_NOT_FOUND, "is no record");
    append(sensor, sizeof sensor);
    expect_refused(CANOPY_ERROR_NOT_FOUND, "canopy replay --keep");
    begin();
    append(tick, sizeof tick - 1u);
    expect_refused(CANOPY_ERROR_IO, "is no record");
    begin();
    append(tick, 3);
    expect_refused(CANOPY_ERROR_IO, "is no record");
    begin();
    append(old, sizeof old);
    expect_refused(CANOPY_ERROR_IO, "is no record");
    begin();
    append(tick, sizeof tick);
    (void)snprintf(sent, sizeof sent, "%s/none/sent", folder);
    expect_refused(CANOPY_ERROR_IO, sent);
}

static void test_damage_within_a_record_ends_the_replay(void)
{
    static const uint8_t too_long[] = {'F', 0, 0, 1, 0, 200, 0, 0, 1, 0, 0};
    const struct {
        const uint8_t *bytes;
        size_t size;
    } damage[] = {{too_long, sizeof too_long}, {sensor, sizeof sensor - 1u}, {sensor, 5}, {tick, 4}, {old, 1}};

    for (unsigned kind = 0; kind < sizeof damage / sizeof *damage; kind++) {
        begin();
        append(tick, sizeof tick);
        append(damage[kind].bytes, damage[kind].size);
        TEST_ASSERT_EQUAL(CANOPY_OK, open_files(NULL));
        TEST_ASSERT_TRUE(files.replay.clock.wait_until(files.replay.clock.context, 0));
        TEST_ASSERT_FALSE(files.replay.clock.wait_until(files.replay.clock.context, 0));
        TEST_ASSERT_EQUAL(CANOPY_ERROR_IO, canopy_replay_close(&files));
    }
}

static void test_a_full_disk_is_told(void)
{
    const canopy_can_frame_t frame = {.id = 1};

    begin();
    append(tick, sizeof tick);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_replay_open(&files, record, "/dev/full", message, sizeof message));
    TEST_ASSERT_EQUAL(1, files.replay.can.send(files.replay.can.context, 0, &frame)); /* into the buffer */
    TEST_ASSERT_EQUAL(CANOPY_ERROR_IO, canopy_replay_close(&files));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_frames_come_and_go_as_they_are);
    RUN_TEST(test_nothing_need_be_written);
    RUN_TEST(test_what_cannot_be_opened_says_why);
    RUN_TEST(test_damage_within_a_record_ends_the_replay);
    RUN_TEST(test_a_full_disk_is_told);
    return UNITY_END();
}
