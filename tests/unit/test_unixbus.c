/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The unixbus driver against itself and against bare sockets that keep to the protocol, or do not.
 */
#include "unixbus_folder.h"

static void test_frames_go_both_ways_and_not_to_the_sender(void)
{
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    open_bus(&b, CANOPY_CAN_ACCEPT_EVERYTHING);

    TEST_ASSERT_EQUAL(1, send_id(&a, 0x123));
    TEST_ASSERT_EQUAL_HEX32(0x123, receive_waiting(&b).id);
    TEST_ASSERT_EQUAL(1, send_id(&b, 0x321));
    TEST_ASSERT_EQUAL_HEX32(0x321, receive_waiting(&a).id);
    expect_silence(&a);
    expect_silence(&b);
    TEST_ASSERT_EQUAL_UINT32(1, stats(&a).sent);
    TEST_ASSERT_EQUAL_UINT32(1, stats(&a).received);
    TEST_ASSERT_EQUAL_UINT32(1, stats(&a).rx_high_water);
}

static void test_every_kind_of_frame_arrives_as_it_was_sent(void)
{
    canopy_can_frame_t frames[] = {
        {.id = 0x7FF, .length = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}},
        {.id = 0x1FFFFFFF, .flags = CANOPY_CAN_EXTENDED, .length = 0},
        {.id = 0x123, .flags = CANOPY_CAN_REMOTE, .length = 5},
        {.id = 0x456, .flags = CANOPY_CAN_FD | CANOPY_CAN_BITRATE_SWITCH | CANOPY_CAN_ERROR_STATE, .length = 64},
    };
    memset(frames[3].data, 0xA5, 64);
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    open_bus(&b, CANOPY_CAN_ACCEPT_EVERYTHING);

    for (size_t i = 0; i < sizeof frames / sizeof frames[0]; i++) {
        TEST_ASSERT_EQUAL(1, a.can.send(a.can.context, 0, &frames[i]));
        const canopy_can_frame_t frame = receive_waiting(&b);
        TEST_ASSERT_EQUAL_HEX32(frames[i].id, frame.id);
        TEST_ASSERT_EQUAL_HEX8(frames[i].flags, frame.flags);
        TEST_ASSERT_EQUAL_UINT8(frames[i].length, frame.length);
        if ((frame.flags & CANOPY_CAN_REMOTE) == 0 && frame.length > 0) {
            TEST_ASSERT_EQUAL_HEX8_ARRAY(frames[i].data, frame.data, frame.length);
        }
    }
}

static void test_datagram_is_the_one_of_the_documentation(void)
{
    static const uint8_t expected[] = {0x01, 0x00, 0x02, 0x00, 0x23, 0x01, 0x00, 0x00, 0x11, 0x22};
    const canopy_can_frame_t frame = {.id = 0x123, .length = 2, .data = {0x11, 0x22}};
    uint8_t bytes[100];
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    const int peer = bare_socket("1-00c0ffee.sock");

    TEST_ASSERT_EQUAL(1, a.can.send(a.can.context, 0, &frame));
    TEST_ASSERT_EQUAL(sizeof expected, recv(peer, bytes, sizeof bytes, MSG_DONTWAIT));
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, bytes, sizeof expected);
    (void)close(peer);
}

/* What lies in the frame behind its data, or in a remote frame's data, was never written, or is of an older frame. */
static void test_nothing_but_the_data_reaches_the_bus(void)
{
    static const uint8_t data[] = {0x01, 0x00, 0x02, 0x00, 0x23, 0x01, 0x00, 0x00, 0x11, 0x22};
    static const uint8_t remote[] = {0x01, CANOPY_CAN_REMOTE, 0x08, 0x00, 0x23, 0x01, 0x00, 0x00};
    canopy_can_frame_t frame; /* as the runtime makes one: no more than that is written */
    uint8_t bytes[100];

    frame.id = 0x123;
    frame.flags = 0;
    frame.length = 2;
    frame.data[0] = 0x11;
    frame.data[1] = 0x22;
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    const int peer = bare_socket("1-00c0ffee.sock");
    TEST_ASSERT_EQUAL(1, a.can.send(a.can.context, 0, &frame));
    TEST_ASSERT_EQUAL(sizeof data, recv(peer, bytes, sizeof bytes, MSG_DONTWAIT));
    TEST_ASSERT_EQUAL_HEX8_ARRAY(data, bytes, sizeof data);
    frame.flags = CANOPY_CAN_REMOTE;
    frame.length = 8;
    TEST_ASSERT_EQUAL(1, a.can.send(a.can.context, 0, &frame));
    TEST_ASSERT_EQUAL(sizeof remote, recv(peer, bytes, sizeof bytes, MSG_DONTWAIT));
    TEST_ASSERT_EQUAL_HEX8_ARRAY(remote, bytes, sizeof remote);
    (void)close(peer);
}

static void test_malformed_datagrams_are_counted_and_change_nothing(void)
{
    static const uint8_t good[] = {1, 0, 2, 0, 0x23, 1, 0, 0, 0x11, 0x22};
    static const struct {
        uint8_t place;
        uint8_t value;
    } changes[] = {{0, 2}, {1, 64}, {1, CANOPY_CAN_BITRATE_SWITCH}, {2, 3}, {2, 1}, {2, 9}, {5, 8}};
    uint8_t bytes[200] = {0};
    uint32_t count = 0;
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);

    for (size_t i = 0; i < sizeof changes / sizeof changes[0]; i++, count++) {
        memcpy(bytes, good, sizeof good);
        bytes[changes[i].place] = changes[i].value;
        send_bytes(bytes, sizeof good);
    }
    memcpy(bytes, good, sizeof good);
    for (size_t size = 0; size < sizeof good; size++, count++) {
        send_bytes(bytes, size);
    }
    send_bytes(bytes, sizeof good + 1);
    send_bytes(bytes, sizeof bytes);
    count += 2;
    send_bytes(good, sizeof good);

    TEST_ASSERT_EQUAL_HEX32(0x123, receive_waiting(&a).id);
    expect_silence(&a);
    TEST_ASSERT_EQUAL_UINT32(count, canopy_unixbus_malformed(&a));
    TEST_ASSERT_EQUAL_UINT32(0, stats(&a).rx_dropped);
}

static void test_filter_and_error_frames(void)
{
    static const uint32_t ids[] = {0x100, 0x200 | CANOPY_CAN_ACCEPT_EXTENDED};
    static const canopy_can_acceptance_t acceptance = {.ids = ids, .count = 2};
    static const uint8_t error[] = {1, CANOPY_CAN_ERROR, 8, 0, 0x40, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    open_bus(&a, &acceptance);
    open_bus(&b, CANOPY_CAN_ACCEPT_EVERYTHING);

    TEST_ASSERT_EQUAL(1, send_id(&b, 0x101));
    TEST_ASSERT_EQUAL(1, send_id(&b, 0x200));
    send_bytes(error, sizeof error);
    TEST_ASSERT_EQUAL(1, send_id(&b, 0x100));

    TEST_ASSERT_EQUAL_HEX32(0x100, receive_waiting(&a).id);
    expect_silence(&a);
    TEST_ASSERT_EQUAL_UINT32(1, stats(&a).error_frames);
}

static void test_frame_that_no_bus_can_carry_is_refused(void)
{
    const canopy_can_frame_t frame = {.id = 1, .flags = CANOPY_CAN_FD, .length = 9};
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);

    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, a.can.send(a.can.context, 0, &frame));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, send_id(&a, 0x800));
    TEST_ASSERT_EQUAL_UINT32(2, stats(&a).tx_dropped);
    TEST_ASSERT_EQUAL_UINT32(0, stats(&a).sent);
}

/* Joining and sending within one step of the clock that stamps folders. */
static void test_newcomers_are_reached_at_once(void)
{
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    for (uint32_t i = 0; i < 50; i++) {
        TEST_ASSERT_EQUAL(1, send_id(&a, 0x10));
        open_bus(&b, CANOPY_CAN_ACCEPT_EVERYTHING);
        TEST_ASSERT_EQUAL(1, send_id(&a, 0x100 + i));
        TEST_ASSERT_EQUAL_HEX32(0x100 + i, receive_waiting(&b).id);
        canopy_unixbus_close(&b);
    }
    TEST_ASSERT_EQUAL_UINT32(100, stats(&a).sent);
    TEST_ASSERT_EQUAL_UINT32(0, stats(&a).tx_dropped);
}

static void test_socket_of_a_dead_participant_is_removed_and_other_files_are_not(void)
{
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    (void)close(bare_socket("1-00c0ffee.sock"));
    (void)close(bare_socket("stranger.sock"));
    (void)close(bare_socket("1-00c0ffee.new"));
    TEST_ASSERT_EQUAL(4, each_file(NULL));

    TEST_ASSERT_EQUAL(1, send_id(&a, 1));

    TEST_ASSERT_EQUAL(3, each_file(NULL));
    TEST_ASSERT_EQUAL_UINT32(0, stats(&a).tx_dropped);
}

static void test_wait_lasts_as_long_as_asked(void)
{
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    open_bus(&b, CANOPY_CAN_ACCEPT_EVERYTHING);
    TEST_ASSERT_EQUAL(1, send_id(&b, 1));
    (void)receive_waiting(&a); /* leaves no event behind that would cut the next wait short */

    const double start = seconds();
    TEST_ASSERT_EQUAL(0, a.can.wait(a.can.context, 50000));
    TEST_ASSERT_TRUE(seconds() - start >= 0.05);
}

static void test_deleted_folder_is_told(void)
{
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    TEST_ASSERT_EQUAL(1, send_id(&a, 1));
    (void)each_file(delete_file);
    TEST_ASSERT_EQUAL(CANOPY_ERROR_BUS_DOWN, send_id(&a, 1));
    TEST_ASSERT_EQUAL(0, rmdir(folder));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_BUS_DOWN, send_id(&a, 1));
    TEST_ASSERT_EQUAL_UINT32(2, stats(&a).tx_dropped);
}

static canopy_can_controller_t state(canopy_unixbus_t *bus)
{
    return bus->can.state(bus->can.context);
}

static void test_a_folder_that_is_gone_is_made_again(void)
{
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    open_bus(&b, CANOPY_CAN_ACCEPT_EVERYTHING);
    TEST_ASSERT_EQUAL(CANOPY_CAN_CONTROLLER_ACTIVE, state(&a));
    for (uint32_t round = 0; round < 3u; round++) {
        (void)each_file(delete_file);
        TEST_ASSERT_EQUAL(0, rmdir(folder));
        TEST_ASSERT_EQUAL(CANOPY_CAN_CONTROLLER_GONE, state(&a));
        TEST_ASSERT_EQUAL(CANOPY_CAN_CONTROLLER_GONE, state(&a)); /* until somebody restarts it */
        a.can.restart(a.can.context);
        TEST_ASSERT_EQUAL(CANOPY_CAN_CONTROLLER_ACTIVE, state(&a));
        b.can.restart(b.can.context);
        a.can.restart(a.can.context); /* in vain: nothing is wrong */
        TEST_ASSERT_EQUAL(2, each_file(NULL));
        TEST_ASSERT_EQUAL(1, send_id(&a, 0x100 + round));
        TEST_ASSERT_EQUAL_HEX32(0x100 + round, receive_waiting(&b).id);
        TEST_ASSERT_EQUAL(1, send_id(&b, 0x200 + round));
        TEST_ASSERT_EQUAL_HEX32(0x200 + round, receive_waiting(&a).id);
    }
    TEST_ASSERT_EQUAL_UINT32(0, canopy_unixbus_malformed(&a));
}

static void test_a_folder_that_cannot_be_made_again_stays_gone(void)
{
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    (void)each_file(delete_file);
    TEST_ASSERT_EQUAL(0, rmdir(folder));
    FILE *file = fopen(folder, "w"); /* something else has the name */
    TEST_ASSERT_NOT_NULL(file);
    (void)fclose(file);
    a.can.restart(a.can.context);
    TEST_ASSERT_EQUAL(CANOPY_CAN_CONTROLLER_GONE, state(&a));
    TEST_ASSERT_EQUAL(0, unlink(folder));
    a.can.restart(a.can.context);
    TEST_ASSERT_EQUAL(CANOPY_CAN_CONTROLLER_ACTIVE, state(&a));
}

static void test_frames_say_when_they_were_sent(void)
{
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    open_bus(&b, CANOPY_CAN_ACCEPT_EVERYTHING);
    for (uint32_t round = 0; round < 20u; round++) {
        const double before = seconds();
        TEST_ASSERT_EQUAL(1, send_id(&a, round));
        const double after = seconds();
        (void)nanosleep(&(struct timespec){.tv_nsec = 5000000}, NULL);
        const double came = 1e-6 * (double)receive_waiting(&b).time;
        TEST_ASSERT_TRUE_MESSAGE(came < after + 1e-5, "younger than it is");
        TEST_ASSERT_TRUE_MESSAGE(came > before - 0.1, "much older than it is");
    }
}

static void test_a_filter_leaves_nothing_unknown(void)
{
    static const uint32_t ids[] = {1};
    static const canopy_can_acceptance_t acceptance = {.ids = ids, .count = 1};
    open_bus(&a, &acceptance);
    open_bus(&b, CANOPY_CAN_ACCEPT_EVERYTHING);
    TEST_ASSERT_TRUE(a.can.is_filtered);
    TEST_ASSERT_FALSE(b.can.is_filtered);
}

static void test_close_removes_the_socket_and_can_be_repeated(void)
{
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    TEST_ASSERT_EQUAL(1, each_file(NULL));
    canopy_unixbus_close(&a);
    canopy_unixbus_close(&a);
    TEST_ASSERT_EQUAL(0, each_file(NULL));
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    TEST_ASSERT_EQUAL(1, each_file(NULL));
}

static void test_open_refuses_bad_names(void)
{
    static const canopy_can_acceptance_t bad = {.ids = NULL, .count = 1};
    char name[200];
    memset(name, 'x', sizeof name);
    name[sizeof name - 1] = '\0';

    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_unixbus_open(&a, NULL, CANOPY_CAN_ACCEPT_EVERYTHING));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_unixbus_open(&a, "", CANOPY_CAN_ACCEPT_EVERYTHING));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_unixbus_open(&a, "..", CANOPY_CAN_ACCEPT_EVERYTHING));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_unixbus_open(&a, "bus0", &bad));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_unixbus_open(&a, name, CANOPY_CAN_ACCEPT_EVERYTHING));
    TEST_ASSERT_EQUAL(ENAMETOOLONG, errno);
    name[90 - strlen(base)] = '\0'; /* the folder's path fits, the socket's does not */
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_unixbus_open(&a, name, CANOPY_CAN_ACCEPT_EVERYTHING));
    TEST_ASSERT_EQUAL(ENAMETOOLONG, errno);
    (void)snprintf(folder, sizeof folder, "%.60s/none/bus", base);
    TEST_ASSERT_EQUAL(CANOPY_ERROR_NOT_FOUND, canopy_unixbus_open(&a, folder, CANOPY_CAN_ACCEPT_EVERYTHING));
}

static void test_path_names_the_folder_itself(void)
{
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_unixbus_open(&b, folder, CANOPY_CAN_ACCEPT_EVERYTHING));
    TEST_ASSERT_EQUAL(1, send_id(&a, 0x42));
    TEST_ASSERT_EQUAL_HEX32(0x42, receive_waiting(&b).id);
    struct stat status;
    TEST_ASSERT_EQUAL(0, stat(folder, &status));
    TEST_ASSERT_EQUAL_HEX32(0700, status.st_mode & 07777u);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_frames_go_both_ways_and_not_to_the_sender);
    RUN_TEST(test_every_kind_of_frame_arrives_as_it_was_sent);
    RUN_TEST(test_datagram_is_the_one_of_the_documentation);
    RUN_TEST(test_nothing_but_the_data_reaches_the_bus);
    RUN_TEST(test_malformed_datagrams_are_counted_and_change_nothing);
    RUN_TEST(test_filter_and_error_frames);
    RUN_TEST(test_frame_that_no_bus_can_carry_is_refused);
    RUN_TEST(test_newcomers_are_reached_at_once);
    RUN_TEST(test_socket_of_a_dead_participant_is_removed_and_other_files_are_not);
    RUN_TEST(test_wait_lasts_as_long_as_asked);
    RUN_TEST(test_deleted_folder_is_told);
    RUN_TEST(test_a_folder_that_is_gone_is_made_again);
    RUN_TEST(test_a_folder_that_cannot_be_made_again_stays_gone);
    RUN_TEST(test_frames_say_when_they_were_sent);
    RUN_TEST(test_a_filter_leaves_nothing_unknown);
    RUN_TEST(test_close_removes_the_socket_and_can_be_repeated);
    RUN_TEST(test_open_refuses_bad_names);
    RUN_TEST(test_path_names_the_folder_itself);
    return UNITY_END();
}
