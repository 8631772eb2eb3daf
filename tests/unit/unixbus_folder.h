/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Two unixbus drivers, `a` and `b`, in a folder of their own, and bare sockets beside them. setUp() and tearDown() are here.
 */
#ifndef CANOPY_TEST_UNIXBUS_FOLDER_H
#define CANOPY_TEST_UNIXBUS_FOLDER_H

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
static inline unsigned each_file(void (*visit)(const char *path))
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

static inline void delete_file(const char *path)
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

static inline void open_bus(canopy_unixbus_t *bus, const canopy_can_acceptance_t *acceptance)
{
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_unixbus_open(bus, "bus0", acceptance));
}

static inline int send_id(canopy_unixbus_t *bus, uint32_t id)
{
    const canopy_can_frame_t frame = {.id = id, .length = 1, .data = {(uint8_t)id}};
    return bus->can.send(bus->can.context, 0, &frame);
}

static inline canopy_can_frame_t receive_waiting(canopy_unixbus_t *bus)
{
    canopy_can_frame_t frame = {0};
    TEST_ASSERT_EQUAL_MESSAGE(1, bus->can.wait(bus->can.context, 10 * SECOND_US), "no frame came");
    TEST_ASSERT_EQUAL(1, bus->can.receive(bus->can.context, &frame));
    return frame;
}

static inline void expect_silence(canopy_unixbus_t *bus)
{
    canopy_can_frame_t frame;
    TEST_ASSERT_EQUAL(0, bus->can.wait(bus->can.context, 20000));
    TEST_ASSERT_EQUAL(0, bus->can.receive(bus->can.context, &frame));
}

static inline canopy_can_stats_t stats(canopy_unixbus_t *bus)
{
    canopy_can_stats_t result;
    bus->can.stats(bus->can.context, &result);
    return result;
}

static inline double seconds(void)
{
    struct timespec now;
    TEST_ASSERT_EQUAL(0, clock_gettime(CLOCK_MONOTONIC, &now));
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static inline int new_socket(void)
{
    const int descriptor = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (descriptor < 0) {
        perror("socket");
        abort();
    }
    return descriptor;
}

/** The path of a file in the bus's folder; the text is written anew at the next call. */
static inline const char *path_of(const char *name)
{
    static char path[120];
    (void)snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

/** A participant without a driver: a bound socket that nobody reads. */
static inline int bare_socket(const char *name)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    const int descriptor = new_socket();
    (void)snprintf(address.sun_path, sizeof address.sun_path, "%s/%s", folder, name);
    TEST_ASSERT_EQUAL(0, bind(descriptor, (const struct sockaddr *)&address, sizeof address));
    return descriptor;
}

/** Sends bytes as they are to the driver `a`. */
static inline void send_bytes(const void *bytes, size_t size)
{
    const int descriptor = new_socket();
    TEST_ASSERT_EQUAL((ssize_t)size, sendto(descriptor, bytes, size, 0, (const struct sockaddr *)&a.tx.folder.own,
                                            sizeof a.tx.folder.own));
    (void)close(descriptor);
}

#endif
