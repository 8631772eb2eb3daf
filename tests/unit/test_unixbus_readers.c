/* SPDX-License-Identifier: MIT */
/**
 * @file
 * What slow, stopped and too many participants of a unixbus cost: themselves some frames, and nobody else anything.
 */
#include <sched.h>

#include "unixbus_folder.h"

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

/** Sends frames that b takes one by one. @return the longest of these sends [s] */
static double longest_send(uint32_t frames)
{
    double longest = 0;
    for (uint32_t i = 0; i < frames; i++) {
        const double start = seconds();
        TEST_ASSERT_EQUAL(1, send_id(&a, i & 0x7FFu));
        longest = seconds() - start > longest ? seconds() - start : longest;
        TEST_ASSERT_EQUAL_HEX32(i & 0x7FFu, receive_waiting(&b).id);
    }
    return longest;
}

enum { ATTEMPTS = 5 }; /* a send that waits does so each time; one that a busy machine has held up does not */

static void test_full_participant_costs_nobody_time(void)
{
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    open_bus(&b, CANOPY_CAN_ACCEPT_EVERYTHING);
    for (unsigned attempt = 0;; attempt++) {
        const int peer = bare_socket("1-00c0ffee.sock");
        const double longest = longest_send(1000);
        (void)close(peer);
        delete_file(path_of("1-00c0ffee.sock"));
        if (longest < 0.05) {
            break;
        }
        TEST_ASSERT_TRUE_MESSAGE(attempt < ATTEMPTS, "waited for the full participant");
    }
    TEST_ASSERT_EQUAL_UINT32(0, stats(&b).rx_dropped);
}

static void test_full_participant_is_told_what_it_lost(void)
{
    enum { FRAMES = 3000, LATER = 20 };
    uint32_t told = 0;
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    open_bus(&b, CANOPY_CAN_ACCEPT_EVERYTHING);
    const int peer = bare_socket("1-00c0ffee.sock");
    (void)longest_send(FRAMES);
    sleep_ms(250); /* what still waits for it is too old now */

    uint32_t taken = take_all(peer, &told);
    TEST_ASSERT_GREATER_THAN_UINT32(0, taken);
    for (uint32_t i = 0; i < LATER || told < stats(&a).tx_dropped; i++) { /* a frame can tell of 255 */
        TEST_ASSERT_TRUE_MESSAGE(i < 10u * LATER, "was not told all");
        TEST_ASSERT_EQUAL(1, send_id(&a, 0x200));
        sleep_ms(40);
        taken += take_all(peer, &told);
    }
    TEST_ASSERT_EQUAL_UINT32(stats(&a).sent, taken + stats(&a).tx_dropped);
    TEST_ASSERT_EQUAL_UINT32(stats(&a).tx_dropped, told);
    (void)close(peer);
}

/* More than a sender's one buffer could hold: nobody else may be without a frame because of it. */
static void test_many_full_participants_cost_nobody_a_frame(void)
{
    enum { STOPPED = 200, FRAMES = 400 };
    int peers[STOPPED];
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    open_bus(&b, CANOPY_CAN_ACCEPT_EVERYTHING);
    for (unsigned i = 0; i < STOPPED; i++) {
        char name[24];
        (void)snprintf(name, sizeof name, "%u-00c0ffee.sock", i);
        peers[i] = bare_socket(name);
    }
    (void)longest_send(FRAMES);
    TEST_ASSERT_EQUAL_UINT32(FRAMES, stats(&a).sent);
    TEST_ASSERT_EQUAL_UINT32(0, stats(&b).rx_dropped);
    for (unsigned i = 0; i < STOPPED; i++) {
        (void)close(peers[i]);
    }
}

/* The socket's own queue may be short; what does not fit comes a moment later, and in order. */
static void test_a_burst_reaches_a_slow_reader_whole(void)
{
    enum { FRAMES = 100 };
    uint8_t bytes[100];
    uint32_t taken = 0;
    open_bus(&a, CANOPY_CAN_ACCEPT_EVERYTHING);
    const int peer = bare_socket("1-00c0ffee.sock");
    const double start = seconds();
    for (uint32_t i = 0; i < FRAMES; i++) {
        TEST_ASSERT_EQUAL(1, send_id(&a, i));
    }
    const struct timeval timeout = {.tv_usec = 300000};
    TEST_ASSERT_EQUAL(0, setsockopt(peer, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout));
    for (int last = -1; taken < FRAMES && recv(peer, bytes, sizeof bytes, 0) == 9; taken++) {
        TEST_ASSERT_GREATER_THAN(last, bytes[4]); /* in order */
        last = bytes[4];
    }
    const double took = seconds() - start;
    TEST_ASSERT_EQUAL_UINT32(FRAMES, taken + stats(&a).tx_dropped);
    if (took < 0.08) { /* nothing was held up for as long as a frame is offered */
        TEST_ASSERT_EQUAL_UINT32(0, stats(&a).tx_dropped);
    }
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
    char name[24];
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
        /* b's thread keeps up: what is lost is lost in its queue */
        for (int tries = 0; tries < 5000 && canopy_ring_count(&b.queue) + canopy_ring_dropped(&b.queue) <= i; tries++) {
            (void)sched_yield();
        }
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

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_full_participant_costs_nobody_time);
    RUN_TEST(test_full_participant_is_told_what_it_lost);
    RUN_TEST(test_many_full_participants_cost_nobody_a_frame);
    RUN_TEST(test_a_burst_reaches_a_slow_reader_whole);
    RUN_TEST(test_close_waits_for_those_who_take_frames);
    RUN_TEST(test_what_a_sender_says_is_lost_counts);
    RUN_TEST(test_a_bus_has_only_so_many_participants);
    RUN_TEST(test_a_link_is_no_participant);
    RUN_TEST(test_sockets_take_the_rights_of_their_folder);
    RUN_TEST(test_loop_that_does_not_receive_loses_the_newest_and_counts);
    RUN_TEST(test_a_frame_that_nobody_took_is_not_out);
    return UNITY_END();
}
