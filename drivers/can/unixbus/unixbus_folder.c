/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The folder of a unixbus: where it is, and whose sockets are in it (docs/unixbus.md).
 */
#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "unixbus_internal.h"

/*
 * The kernel stamps a folder with a clock that moves in steps of up to 10 ms. A list read within such a step after a
 * change may miss a second change that gets the same stamp, so a list is trusted only when the stamp was older than this.
 */
#define SETTLE_NS INT64_C(100000000)

#define HEX_DIGITS 8u

static canopy_error_t make_folder(const char *path)
{
    if (mkdir(path, S_IRWXU) == 0 || errno == EEXIST) {
        return CANOPY_OK;
    }
    return errno == ENOENT ? CANOPY_ERROR_NOT_FOUND : CANOPY_ERROR_IO;
}

/* In /tmp anybody could have made the folder first, and would then read and write our bus. */
static canopy_error_t check_owner(const char *path)
{
    struct stat status;
    if (lstat(path, &status) != 0) {
        return CANOPY_ERROR_IO;
    }
    if (!S_ISDIR(status.st_mode) || status.st_uid != geteuid() || (status.st_mode & (S_IWGRP | S_IWOTH)) != 0u) {
        errno = EPERM;
        return CANOPY_ERROR_IO;
    }
    return CANOPY_OK;
}

static bool is_folder(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && S_ISDIR(status.st_mode);
}

/* snprintf() that gives an error instead of a shortened text. */
#define PRINT(text, ...) \
    (snprintf((text), sizeof(text), __VA_ARGS__) < (int)sizeof(text) ? CANOPY_OK : CANOPY_ERROR_ARGUMENT)

/** Makes the folder that holds the buses, and writes its path. */
static canopy_error_t find_base(char (*base)[sizeof(((struct sockaddr_un *)NULL)->sun_path)])
{
    /* Safe as long as no other thread changes the environment, which nothing here does. */
    const char *configured = getenv("CANOPY_BUS_DIR"); /* NOLINT(concurrency-mt-unsafe) */
    const char *runtime = getenv("XDG_RUNTIME_DIR");   /* NOLINT(concurrency-mt-unsafe) */
    canopy_error_t error;
    bool shared = false;
    if (configured != NULL && configured[0] != '\0') {
        error = PRINT(*base, "%s", configured);
    } else if (runtime != NULL && runtime[0] != '\0' && is_folder(runtime)) {
        error = PRINT(*base, "%s/canopy", runtime);
    } else {
        error = PRINT(*base, "/tmp/canopy-%lu", (unsigned long)geteuid());
        shared = true;
    }
    if (error == CANOPY_OK) {
        error = make_folder(*base);
    } else {
        errno = ENAMETOOLONG;
    }
    return error == CANOPY_OK && shared ? check_owner(*base) : error;
}

/** Writes the path of the bus's folder, which need not exist yet. */
static canopy_error_t find_folder(canopy_unixbus_folder_t *folder, const char *bus)
{
    canopy_error_t error;
    if (bus[0] == '\0' || strcmp(bus, ".") == 0 || strcmp(bus, "..") == 0) {
        errno = EINVAL;
        return CANOPY_ERROR_ARGUMENT;
    }
    if (strchr(bus, '/') != NULL) {
        error = PRINT(folder->path, "%s", bus);
    } else {
        char base[sizeof folder->path];
        error = find_base(&base);
        if (error != CANOPY_OK) {
            return error;
        }
        error = PRINT(folder->path, "%s/%s", base, bus);
    }
    if (error != CANOPY_OK) {
        errno = ENAMETOOLONG;
    }
    return error;
}

static canopy_error_t make_address(struct sockaddr_un *address, const char *path, const char *name)
{
    address->sun_family = AF_UNIX;
    if (PRINT(address->sun_path, "%s/%s", path, name) != CANOPY_OK) {
        errno = ENAMETOOLONG;
        return CANOPY_ERROR_ARGUMENT;
    }
    return CANOPY_OK;
}

canopy_error_t canopy_unixbus_folder_init(canopy_unixbus_folder_t *folder, const char *bus)
{
    uint32_t number;
    char name[32];
    memset(folder, 0, sizeof *folder);
    canopy_error_t error = find_folder(folder, bus);
    if (error != CANOPY_OK) {
        return error;
    }
    if (getrandom(&number, sizeof number, 0) != (ssize_t)sizeof number) {
        return CANOPY_ERROR_IO;
    }
    (void)snprintf(name, sizeof name, "%ld-%08lx.sock", (long)getpid(), (unsigned long)number);
    error = make_address(&folder->own, folder->path, name);
    return error == CANOPY_OK ? make_folder(folder->path) : error;
}

canopy_error_t canopy_unixbus_folder_join(canopy_unixbus_folder_t *folder, int socket)
{
    /*
     * bind() makes the file first and the way to the socket after it. A sender that comes between the two would take
     * the socket for a dead one's and unlink it. So the name that senders look for is given when all is done.
     */
    struct sockaddr_un hidden = folder->own;
    char *ending = strrchr(hidden.sun_path, '.');
    memcpy(ending, ".new", sizeof ".new");
    if (bind(socket, (const struct sockaddr *)&hidden, sizeof hidden) != 0) {
        return CANOPY_ERROR_IO;
    }
    if (rename(hidden.sun_path, folder->own.sun_path) != 0) {
        const int number = errno;
        (void)unlink(hidden.sun_path);
        errno = number;
        return CANOPY_ERROR_IO;
    }
    return CANOPY_OK;
}

/* "<pid>-<8 hex digits>.sock", and nothing else: a dead participant's file is deleted, a stranger's must not be. */
static bool is_socket_name(const char *name)
{
    const size_t pid = strspn(name, "0123456789");
    const char *hex = name + pid + 1;
    return pid > 0u && pid <= 10u && name[pid] == '-' && strspn(hex, "0123456789abcdef") == HEX_DIGITS &&
           strcmp(hex + HEX_DIGITS, ".sock") == 0;
}

static void add_peer(canopy_unixbus_folder_t *folder, const char *name, const canopy_unixbus_peer_t *old,
                     size_t old_count)
{
    canopy_unixbus_peer_t peer = {0};
    if (folder->count == CANOPY_UNIXBUS_PEERS_MAX) {
        folder->too_many = true;
        return;
    }
    if (make_address(&peer.address, folder->path, name) != CANOPY_OK) {
        return; /* nobody can have bound a name that does not fit */
    }
    for (size_t i = 0; i < old_count; i++) {
        if (strcmp(old[i].address.sun_path, peer.address.sun_path) == 0) {
            peer.slow = old[i].slow;
        }
    }
    folder->peers[folder->count++] = peer;
}

static canopy_error_t read_folder(canopy_unixbus_folder_t *folder)
{
    canopy_unixbus_peer_t old[CANOPY_UNIXBUS_PEERS_MAX];
    const size_t old_count = folder->count;
    const char *own_name = strrchr(folder->own.sun_path, '/') + 1;
    bool own_seen = false;
    DIR *directory = opendir(folder->path);
    if (directory == NULL) {
        return CANOPY_ERROR_BUS_DOWN;
    }
    memcpy(old, folder->peers, old_count * sizeof old[0]);
    folder->count = 0;
    folder->too_many = false;
    const struct dirent *entry;
    /* readdir() is safe here: the stream is this function's own. NOLINTNEXTLINE(concurrency-mt-unsafe) */
    while ((entry = readdir(directory)) != NULL) {
        if (strcmp(entry->d_name, own_name) == 0) {
            own_seen = true;
        } else if (is_socket_name(entry->d_name)) {
            add_peer(folder, entry->d_name, old, old_count);
        }
    }
    (void)closedir(directory);
    return own_seen ? CANOPY_OK : CANOPY_ERROR_BUS_DOWN;
}

static int64_t nanoseconds(const struct timespec *time)
{
    return (int64_t)time->tv_sec * INT64_C(1000000000) + time->tv_nsec;
}

canopy_error_t canopy_unixbus_folder_refresh(canopy_unixbus_folder_t *folder)
{
    struct stat status;
    struct timespec now;
    if (stat(folder->path, &status) != 0) {
        return CANOPY_ERROR_BUS_DOWN;
    }
    const int64_t modified = nanoseconds(&status.st_mtim);
    if (folder->settled && modified == nanoseconds(&folder->modified)) {
        return CANOPY_OK;
    }
    /* The stamp was taken before the folder is read: a change in between shows as a new stamp at the next send. */
    folder->modified = status.st_mtim;
    (void)clock_gettime(CLOCK_REALTIME, &now);
    folder->settled = nanoseconds(&now) - modified > SETTLE_NS;
    const canopy_error_t error = read_folder(folder);
    if (error != CANOPY_OK) {
        folder->settled = false;
    }
    return error;
}

void canopy_unixbus_folder_forget(canopy_unixbus_folder_t *folder, size_t index)
{
    folder->count--;
    folder->peers[index] = folder->peers[folder->count];
}
