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

bool canopy_unixbus_folder_address(const canopy_unixbus_folder_t *folder, const char *name, struct sockaddr_un *address)
{
    address->sun_family = AF_UNIX;
    return PRINT(address->sun_path, "%s/%s", folder->path, name) == CANOPY_OK;
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
    if (!canopy_unixbus_folder_address(folder, name, &folder->own)) {
        errno = ENAMETOOLONG;
        return CANOPY_ERROR_ARGUMENT;
    }
    return make_folder(folder->path);
}

/* Who may write the folder takes part in the bus: for that he must be able to write to its sockets, too. */
static void share(const char *folder, const char *path)
{
    struct stat status;
    if (stat(folder, &status) == 0) {
        const int changed = lchown(path, (uid_t)-1, status.st_gid); /* not by everybody to every group */
        (void)changed;
        (void)chmod(path, status.st_mode & 0666u);
    }
}

/* "<pid>-<8 hex digits>.sock", and nothing else: a dead participant's file is deleted, a stranger's must not be. */
static bool is_socket_name(const char *name)
{
    const size_t pid = strspn(name, "0123456789");
    const char *hex = name + pid + 1;
    return pid > 0u && pid <= 10u && name[pid] == '-' && strspn(hex, "0123456789abcdef") == HEX_DIGITS &&
           strcmp(hex + HEX_DIGITS, ".sock") == 0;
}

/** Unlinks a socket that nobody holds any more. @return whether it was one */
static bool is_dead(const canopy_unixbus_folder_t *folder, int probe, const char *name)
{
    struct sockaddr_un address;
    return canopy_unixbus_folder_address(folder, name, &address) &&
           connect(probe, (const struct sockaddr *)&address, sizeof address) != 0 && errno == ECONNREFUSED &&
           unlink(address.sun_path) == 0;
}

/** Counts the sockets in the folder, and deletes the dead ones among them. @return their number; negative with errno */
static int count_living(const canopy_unixbus_folder_t *folder)
{
    int count = 0;
    const int probe = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    DIR *directory = opendir(folder->path);
    const struct dirent *entry;
    if (probe < 0 || directory == NULL) {
        count = -1;
    }
    /* readdir() is safe here: the stream is this function's own. NOLINTNEXTLINE(concurrency-mt-unsafe) */
    while (count >= 0 && (entry = readdir(directory)) != NULL) {
        count += is_socket_name(entry->d_name) && !is_dead(folder, probe, entry->d_name);
    }
    const int number = errno;
    if (directory != NULL) {
        (void)closedir(directory);
    }
    if (probe >= 0) {
        (void)close(probe);
    }
    errno = number;
    return count;
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
    share(folder->path, hidden.sun_path);
    const int living = count_living(folder);
    if (living >= 0 && living < (int)CANOPY_UNIXBUS_PEERS_MAX && rename(hidden.sun_path, folder->own.sun_path) == 0) {
        return CANOPY_OK;
    }
    const int number = living >= (int)CANOPY_UNIXBUS_PEERS_MAX ? EUSERS : errno;
    (void)unlink(hidden.sun_path);
    errno = number;
    return CANOPY_ERROR_IO;
}

/** @param hint where it is if nobody came or left: the system gives the names in the same order again */
static canopy_unixbus_peer_t *find_peer(canopy_unixbus_folder_t *folder, const char *name, size_t hint)
{
    for (size_t i = 0; i < folder->count; i++) {
        canopy_unixbus_peer_t *peer = &folder->peers[(hint + i) % folder->count];
        if (strcmp(peer->name, name) == 0) {
            return peer;
        }
    }
    return NULL;
}

static canopy_unixbus_peer_t *add_peer(canopy_unixbus_folder_t *folder, const char *name, uint32_t next)
{
    if (folder->count == CANOPY_UNIXBUS_PEERS_MAX) {
        folder->too_many = true;
        return NULL;
    }
    canopy_unixbus_peer_t *peer = &folder->peers[folder->count++];
    *peer = (canopy_unixbus_peer_t){.socket = -1, .next = next};
    memcpy(peer->name, name, strlen(name)); /* is_socket_name() bounds it; zeros lie behind it */
    return peer;
}

static void forget_unlisted(canopy_unixbus_folder_t *folder)
{
    for (size_t i = folder->count; i > 0u; i--) {
        if (!folder->peers[i - 1u].is_listed) {
            canopy_unixbus_folder_forget(folder, i - 1u);
        }
    }
}

/** @return CANOPY_OK; CANOPY_ERROR_BUS_DOWN; CANOPY_ERROR_IO: could not be read just now */
static canopy_error_t read_folder(canopy_unixbus_folder_t *folder, uint32_t next)
{
    const char *own_name = strrchr(folder->own.sun_path, '/') + 1;
    bool own_seen = false;
    size_t hint = 0;
    DIR *directory = opendir(folder->path);
    if (directory == NULL) {
        return errno == ENOENT || errno == ENOTDIR ? CANOPY_ERROR_BUS_DOWN : CANOPY_ERROR_IO;
    }
    for (size_t i = 0; i < folder->count; i++) {
        folder->peers[i].is_listed = false;
    }
    const struct dirent *entry;
    errno = 0;
    /* readdir() is safe here: the stream is this function's own. NOLINTNEXTLINE(concurrency-mt-unsafe) */
    while ((entry = readdir(directory)) != NULL) {
        if (strcmp(entry->d_name, own_name) == 0) {
            own_seen = true;
        } else if (is_socket_name(entry->d_name)) {
            canopy_unixbus_peer_t *peer = find_peer(folder, entry->d_name, hint);
            peer = peer == NULL ? add_peer(folder, entry->d_name, next) : peer;
            if (peer != NULL) {
                peer->is_listed = true;
                hint = (size_t)(peer - folder->peers) + 1u;
            }
        }
        errno = 0; /* readdir() says by it whether it has failed or is at the end */
    }
    const bool failed = errno != 0;
    (void)closedir(directory);
    if (failed) {
        return CANOPY_ERROR_IO;
    }
    folder->too_many &= folder->count == CANOPY_UNIXBUS_PEERS_MAX;
    forget_unlisted(folder);
    return own_seen ? CANOPY_OK : CANOPY_ERROR_BUS_DOWN;
}

static int64_t nanoseconds(const struct timespec *time)
{
    return (int64_t)time->tv_sec * INT64_C(1000000000) + time->tv_nsec;
}

/** What cannot be read just now is no harm where it was read before. */
static canopy_error_t passing(const canopy_unixbus_folder_t *folder, canopy_error_t error)
{
    return error == CANOPY_ERROR_IO && folder->was_read ? CANOPY_OK : error;
}

canopy_error_t canopy_unixbus_folder_refresh(canopy_unixbus_folder_t *folder, uint32_t next)
{
    struct stat status;
    struct timespec now;
    if (folder->own.sun_path[0] == '\0') {
        return CANOPY_ERROR_BUS_DOWN; /* joining again has failed half-way */
    }
    if (stat(folder->path, &status) != 0) {
        folder->settled = false;
        return passing(folder, errno == ENOENT || errno == ENOTDIR ? CANOPY_ERROR_BUS_DOWN : CANOPY_ERROR_IO);
    }
    const int64_t modified = nanoseconds(&status.st_mtim);
    if (folder->settled && modified == nanoseconds(&folder->modified)) {
        return CANOPY_OK;
    }
    /* The stamp was taken before the folder is read: a change in between shows as a new stamp at the next send. */
    folder->modified = status.st_mtim;
    (void)clock_gettime(CLOCK_REALTIME, &now);
    const canopy_error_t error = read_folder(folder, next);
    folder->settled = error == CANOPY_OK && nanoseconds(&now) - modified > SETTLE_NS;
    folder->was_read |= error == CANOPY_OK;
    return passing(folder, error);
}

void canopy_unixbus_folder_forget(canopy_unixbus_folder_t *folder, size_t index)
{
    if (folder->peers[index].socket >= 0) {
        (void)close(folder->peers[index].socket);
    }
    folder->count--;
    folder->peers[index] = folder->peers[folder->count];
}

void canopy_unixbus_folder_clear(canopy_unixbus_folder_t *folder)
{
    while (folder->count > 0u) {
        canopy_unixbus_folder_forget(folder, folder->count - 1u);
    }
}
