/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The unixbus driver against itself and against bare sockets that keep to the protocol, or do not.
 */
#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include "canopy/can/unixbus.h"
#include "unity.h"

#define SECOND_US 1000000u

static canopy_unixbus_t a, b;
static char base[64];
static char folder[80]; /* of the bus "bus0" */

void setUp(void)
{
    (void)snprintf(base, sizeof base, "/tmp/canopy-test-XXXXXX");
    TEST_ASSERT_NOT_NULL(mkdtemp(base));
    TEST_ASSERT_EQUAL(0, setenv("CANOPY_BUS_DIR", base, 1)); /* NOLINT(concurrency-mt-unsafe): no thread yet */
    (void)snprintf(folder, sizeof folder, "%s/bus0", base);
    a.socket = -1;
    b.socket = -1;
}

/** Calls visit for each file of the bus's folder, if it is given. @return their number */
static unsigned each_file(void (*visit)(const char *path))
{
    unsigned count = 0;
    DIR *directory = opendir(folder);
    if (directory == NULL) {
        return 0;
    }
    const struct dirent *entry;
    while ((entry = readdir(directory)) != NULL) { /* NOLINT(concurrency-mt-unsafe): the stream is ours alone */
        if (entry->d_name[0] != '.') {
            char path[400];
            (void)snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
            count++;
            if (visit != NULL) {
                visit(path);
            }
        }
    }
    (void)closedir(directory);
    return count;
}

static void delete_file(const char *path)
{
    (void)unlink(path);
}

void tearDown(void)
{
    canopy_unixbus_close(&a);
    canopy_unixbus_close(&b);
    (void)each_file(delete_file);
    (void)rmdir(folder);
    (void)rmdir(base);
}

static void open_bus(canopy_unixbus_t *bus, const canopy_can_acceptance_t *acceptance)
{
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_unixbus_open(bus, "bus0", acceptance));
}

static int send_id(canopy_unixbus_t *bus, uint32_t id)
{
    const canopy_can_frame_t frame = {.id = id, .length = 1, .data = {(uint8_t)id}};
    return bus->can.send(bus->can.context, 0, &frame);
}

static canopy_can_frame_t receive_waiting(canopy_unixbus_t *bus)
{
    canopy_can_frame_t frame = {0};
    TEST_ASSERT_EQUAL_MESSAGE(1, bus->can.wait(bus->can.context, 10 * SECOND_US), "no frame came");
    TEST_ASSERT_EQUAL(1, bus->can.receive(bus->can.context, &frame));
    return frame;
}

static void expect_silence(canopy_unixbus_t *bus)
{
    canopy_can_frame_t frame;
    TEST_ASSERT_EQUAL(0, bus->can.wait(bus->can.context, 20000));
    TEST_ASSERT_EQUAL(0, bus->can.receive(bus->can.context, &frame));
}

static canopy_can_stats_t stats(canopy_unixbus_t *bus)
{
    canopy_can_stats_t result;
    bus->can.stats(bus->can.context, &result);
    return result;
}

static double seconds(void)
{
    struct timespec now;
    TEST_ASSERT_EQUAL(0, clock_gettime(CLOCK_MONOTONIC, &now));
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int new_socket(void)
{
    const int descriptor = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (descriptor < 0) {
        perror("socket");
        abort();
    }
    return descriptor;
}

/** A participant without a driver: a bound socket that nobody reads. */
static int bare_socket(const char *name)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    const int descriptor = new_socket();
    (void)snprintf(address.sun_path, sizeof address.sun_path, "%s/%s", folder, name);
    TEST_ASSERT_EQUAL(0, bind(descriptor, (const struct sockaddr *)&address, sizeof address));
    return descriptor;
}

/** Sends bytes as they are to the driver `a`. */
static void send_bytes(const void *bytes, size_t size)
{
    const int descriptor = new_socket();
    TEST_ASSERT_EQUAL((ssize_t)size, sendto(descriptor, bytes, size, 0, (const struct sockaddr *)&a.tx.folder.own,
                                            sizeof a.tx.folder.own));
    (void)close(descriptor);
}

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

/** Takes what waits in a bare socket. @return how many frames; *told is raised by what they say is lost */
static uint32_t take_all(int peer, uint32_t *told)
{
    uint8_t bytes[100];
    uint32_t taken = 0;
    while (recv(peer, bytes, sizeof bytes, MSG_DONTWAIT) > 0) {
        *told += bytes[3];
        taken++;
    }
    return taken;
}

static void sleep_ms(long ms)
{
    (void)nanosleep(&(struct timespec){.tv_nsec = ms * 1000000L}, NULL);
}

static void test_full_participant_costs_nobody_time_and_is_told_what_it_lost(void)
{
    uint32_t told = 0;
    double longest = 0;
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    open_bus(&b, CANOPY_CAN_ACCEPT_EVERYTHING);
    const int peer = bare_socket("1-00c0ffee.sock");

    for (uint32_t i = 0; i < 3000; i++) {
        const double start = seconds();
        TEST_ASSERT_EQUAL(1, send_id(&a, 0x100)); /* taken by b all the while */
        longest = seconds() - start > longest ? seconds() - start : longest;
        (void)receive_waiting(&b);
    }
    TEST_ASSERT_TRUE_MESSAGE(longest < 0.05, "waited for the full participant");
    TEST_ASSERT_EQUAL_UINT32(0, stats(&b).rx_dropped);
    sleep_ms(250); /* what still waits for it is too old now */

    uint32_t taken = take_all(peer, &told);
    TEST_ASSERT_EQUAL_UINT32(3000, taken + stats(&a).tx_dropped);
    TEST_ASSERT_GREATER_THAN_UINT32(0, taken);
    for (uint32_t i = 0; i < 20u; i++) { /* a frame can tell of 255 */
        sleep_ms(20);
        TEST_ASSERT_EQUAL(1, send_id(&a, 0x200));
        sleep_ms(20);
        taken += take_all(peer, &told);
    }
    TEST_ASSERT_EQUAL_UINT32(3020, taken + stats(&a).tx_dropped);
    TEST_ASSERT_EQUAL_UINT32(stats(&a).tx_dropped, told);
    (void)close(peer);
}

/* More than a sender's one buffer could hold: nobody else may be without a frame because of it. */
static void test_many_full_participants_cost_nobody_a_frame(void)
{
    enum { STOPPED = 200, FRAMES = 400 };
    int peers[STOPPED];
    double longest = 0;
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    open_bus(&b, CANOPY_CAN_ACCEPT_EVERYTHING);
    for (unsigned i = 0; i < STOPPED; i++) {
        char name[32];
        (void)snprintf(name, sizeof name, "%u-00c0ffee.sock", i);
        peers[i] = bare_socket(name);
    }
    for (unsigned i = 0; i < FRAMES; i++) {
        const double start = seconds();
        TEST_ASSERT_EQUAL(1, send_id(&a, i));
        longest = seconds() - start > longest ? seconds() - start : longest;
        TEST_ASSERT_EQUAL_HEX32(i, receive_waiting(&b).id);
    }
    TEST_ASSERT_TRUE_MESSAGE(longest < 0.1, "a send waited");
    TEST_ASSERT_EQUAL_UINT32(FRAMES, stats(&a).sent);
    TEST_ASSERT_EQUAL_UINT32(0, stats(&b).rx_dropped);
    for (unsigned i = 0; i < STOPPED; i++) {
        (void)close(peers[i]);
    }
}

/* The socket's own queue may be short; what does not fit comes a moment later, and in order. */
static void test_a_burst_reaches_a_slow_reader_whole(void)
{
    uint8_t bytes[100];
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    const int peer = bare_socket("1-00c0ffee.sock");
    for (uint32_t i = 0; i < 100u; i++) {
        TEST_ASSERT_EQUAL(1, send_id(&a, i));
    }
    const struct timeval timeout = {.tv_sec = 5};
    TEST_ASSERT_EQUAL(0, setsockopt(peer, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout));
    for (uint32_t i = 0; i < 100u; i++) {
        TEST_ASSERT_EQUAL(9, recv(peer, bytes, sizeof bytes, 0));
        TEST_ASSERT_EQUAL_HEX8(i, bytes[4]);
    }
    TEST_ASSERT_EQUAL_UINT32(0, stats(&a).tx_dropped);
    (void)close(peer);
}

/* What the program sent last must not be lost because the program ends. */
static void test_close_waits_for_those_who_take_frames(void)
{
    uint8_t bytes[100];
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    const int peer = bare_socket("1-00c0ffee.sock");
    const double start = seconds();
    for (uint32_t i = 0; i < 40u; i++) {
        TEST_ASSERT_EQUAL(1, send_id(&a, i));
    }
    canopy_unixbus_close(&a);
    TEST_ASSERT_TRUE_MESSAGE(seconds() - start >= 0.09, "did not wait");
    TEST_ASSERT_TRUE_MESSAGE(seconds() - start < 2.0, "waited for one that takes nothing");
    uint32_t told = 0;
    TEST_ASSERT_GREATER_THAN_UINT32(0, take_all(peer, &told));
    TEST_ASSERT_EQUAL(-1, recv(peer, bytes, sizeof bytes, MSG_DONTWAIT));
    (void)close(peer);
}

static void test_what_a_sender_says_is_lost_counts(void)
{
    static const uint8_t lossy[] = {1, 0, 0, 7, 0x23, 1, 0, 0};
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    send_bytes(lossy, sizeof lossy);
    send_bytes(lossy, sizeof lossy);
    TEST_ASSERT_EQUAL_HEX32(0x123, receive_waiting(&a).id);
    TEST_ASSERT_EQUAL_HEX32(0x123, receive_waiting(&a).id);
    TEST_ASSERT_EQUAL_UINT32(14, stats(&a).rx_dropped);
    TEST_ASSERT_EQUAL_UINT32(0, canopy_unixbus_malformed(&a));
}

static void test_a_bus_has_only_so_many_participants(void)
{
    static int peers[CANOPY_UNIXBUS_PEERS_MAX];
    char name[32];
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    for (unsigned i = 1; i < CANOPY_UNIXBUS_PEERS_MAX; i++) {
        (void)snprintf(name, sizeof name, "%u-00c0ffee.sock", i);
        peers[i] = bare_socket(name);
    }
    TEST_ASSERT_EQUAL(CANOPY_ERROR_IO, canopy_unixbus_open(&b, "bus0", CANOPY_CAN_ACCEPT_EVERYTHING));
    TEST_ASSERT_EQUAL(EUSERS, errno);
    TEST_ASSERT_EQUAL(CANOPY_UNIXBUS_PEERS_MAX, each_file(NULL)); /* it has left nothing behind */
    (void)close(peers[7]);                                        /* dies */
    open_bus(&b, CANOPY_CAN_ACCEPT_EVERYTHING);
    TEST_ASSERT_EQUAL(1, send_id(&b, 0x55));
    TEST_ASSERT_EQUAL_HEX32(0x55, receive_waiting(&a).id);
    for (unsigned i = 1; i < CANOPY_UNIXBUS_PEERS_MAX; i++) {
        if (i != 7u) {
            (void)close(peers[i]);
        }
    }
}

/* A link in the folder could lead to a socket that is none of the bus's. */
static void test_a_link_is_no_participant(void)
{
    char target[100];
    char link[120];
    uint8_t bytes[100];
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    const int peer = bare_socket("stranger");
    (void)snprintf(target, sizeof target, "%s/stranger", folder);
    (void)snprintf(link, sizeof link, "%s/1-00c0ffee.sock", folder);
    TEST_ASSERT_EQUAL(0, symlink(target, link));
    TEST_ASSERT_EQUAL(1, send_id(&a, 1));
    TEST_ASSERT_EQUAL(-1, recv(peer, bytes, sizeof bytes, MSG_DONTWAIT));
    (void)close(peer);
}

static void test_sockets_take_the_rights_of_their_folder(void)
{
    struct stat status;
    TEST_ASSERT_EQUAL(0, mkdir(folder, 0700));
    TEST_ASSERT_EQUAL(0, chmod(folder, 02770));
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    TEST_ASSERT_EQUAL(0, stat(a.tx.folder.own.sun_path, &status));
    TEST_ASSERT_EQUAL_HEX32(0660, status.st_mode & 07777u);
    TEST_ASSERT_EQUAL(0, chmod(folder, 0700));
    open_bus(&b, CANOPY_CAN_ACCEPT_EVERYTHING);
    TEST_ASSERT_EQUAL(0, stat(b.tx.folder.own.sun_path, &status));
    TEST_ASSERT_EQUAL_HEX32(0600, status.st_mode & 07777u);
}

static void test_loop_that_does_not_receive_loses_the_newest_and_counts(void)
{
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    open_bus(&b, CANOPY_CAN_ACCEPT_EVERYTHING);
    for (uint32_t i = 0; i < CANOPY_UNIXBUS_FRAMES + 100u; i++) {
        TEST_ASSERT_EQUAL(1, send_id(&a, i & 0x7FFu));
    }
    for (int tries = 0; stats(&b).rx_dropped < 100u && tries < 5000; tries++) {
        (void)nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    }
    TEST_ASSERT_EQUAL_UINT32(100, stats(&b).rx_dropped);
    TEST_ASSERT_EQUAL_UINT32(CANOPY_UNIXBUS_FRAMES, stats(&b).rx_high_water);
    for (uint32_t i = 0; i < CANOPY_UNIXBUS_FRAMES; i++) {
        TEST_ASSERT_EQUAL_HEX32(i & 0x7FFu, receive_waiting(&b).id);
    }
    expect_silence(&b);
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

static void test_a_frame_that_nobody_took_is_not_out(void)
{
    unsigned taken = 0;
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    const int peer = bare_socket("1-00c0ffee.sock");

    while (taken < 10000u && send_id(&a, 1) == 1) { /* the first ones may still come: there is room to wait */
        taken++;
    }
    sleep_ms(250);
    const uint32_t dropped = stats(&a).tx_dropped;
    for (int i = 0; i < 100; i++) {
        TEST_ASSERT_EQUAL(0, send_id(&a, 1));
    }
    TEST_ASSERT_EQUAL_UINT32(taken, stats(&a).sent);
    TEST_ASSERT_EQUAL_UINT32(dropped, stats(&a).tx_dropped); /* it may be offered again */
    (void)close(peer);
    sleep_ms(50);
    TEST_ASSERT_EQUAL(1, send_id(&a, 1)); /* nobody is there: nobody misses it */
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
    RUN_TEST(test_full_participant_costs_nobody_time_and_is_told_what_it_lost);
    RUN_TEST(test_many_full_participants_cost_nobody_a_frame);
    RUN_TEST(test_a_burst_reaches_a_slow_reader_whole);
    RUN_TEST(test_close_waits_for_those_who_take_frames);
    RUN_TEST(test_what_a_sender_says_is_lost_counts);
    RUN_TEST(test_a_bus_has_only_so_many_participants);
    RUN_TEST(test_a_link_is_no_participant);
    RUN_TEST(test_sockets_take_the_rights_of_their_folder);
    RUN_TEST(test_loop_that_does_not_receive_loses_the_newest_and_counts);
    RUN_TEST(test_wait_lasts_as_long_as_asked);
    RUN_TEST(test_deleted_folder_is_told);
    RUN_TEST(test_a_folder_that_is_gone_is_made_again);
    RUN_TEST(test_a_folder_that_cannot_be_made_again_stays_gone);
    RUN_TEST(test_a_frame_that_nobody_took_is_not_out);
    RUN_TEST(test_frames_say_when_they_were_sent);
    RUN_TEST(test_a_filter_leaves_nothing_unknown);
    RUN_TEST(test_close_removes_the_socket_and_can_be_repeated);
    RUN_TEST(test_open_refuses_bad_names);
    RUN_TEST(test_path_names_the_folder_itself);
    return UNITY_END();
}
