/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A library to be preloaded: lets the n-th call of one function of the C library fail, as the kernel could let it fail.
 *
 *   FAIL_CALL   name of the function, e.g. recvmsg
 *   FAIL_ERRNO  the error, as a number
 *   FAIL_AT     which call, from 1; 0: none, calls are only counted
 *   FAIL_FOR    how many calls from there on; 1 if not given
 *   FAIL_PATH   part of a path: calls on other paths, and on files that were not opened by such a path, are not counted
 *   FAIL_COUNT  file into which the number of calls is written at each of them
 *
 * A call that fails has done nothing. Calls on descriptors count only for sockets, eventfds and files of FAIL_PATH.
 */
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <net/if.h>
#include <poll.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

static atomic_long calls;

static long number_of(const char *name, long otherwise)
{
    const char *text = getenv(name);
    return text == NULL ? otherwise : strtol(text, NULL, 10);
}

static void report(long count)
{
    const char *path = getenv("FAIL_COUNT");
    char text[24];
    if (path != NULL) {
        const int file = (int)(long)((int (*)(const char *, int, ...))dlsym(RTLD_NEXT, "open"))(
            path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
        const int size = snprintf(text, sizeof text, "%ld", count);
        if (file >= 0) {
            const ssize_t written =
                ((ssize_t (*)(int, const void *, size_t))dlsym(RTLD_NEXT, "write"))(file, text, (size_t)size);
            (void)written;
            (void)close(file);
        }
    }
}

/** Whether this call of `name` is one that shall fail; then errno says how. */
static bool fails(const char *name)
{
    const char *wanted = getenv("FAIL_CALL");
    if (wanted == NULL || strcmp(wanted, name) != 0) {
        return false;
    }
    const int before = errno;
    const long call = atomic_fetch_add(&calls, 1) + 1;
    const long at = number_of("FAIL_AT", 0);
    report(call);
    const bool result = at > 0 && call >= at && call < at + number_of("FAIL_FOR", 1);
    errno = result ? (int)number_of("FAIL_ERRNO", EIO) : before;
    return result;
}

static bool is_ours(const char *path)
{
    const char *part = getenv("FAIL_PATH");
    return part == NULL || (path != NULL && strstr(path, part) != NULL);
}

static bool counts(int descriptor)
{
    char link[40];
    char target[512];
    const int before = errno;
    (void)snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
    const ssize_t size = readlink(link, target, sizeof target - 1);
    errno = before;
    if (size < 0) {
        return false;
    }
    target[size] = '\0';
    return strncmp(target, "socket:", 7) == 0 || strstr(target, "eventfd") != NULL ||
           (getenv("FAIL_PATH") != NULL && is_ours(target));
}

/* NOLINTBEGIN(bugprone-macro-parentheses): types and lists of parameters cannot be put in parentheses */
/* A function of the C library with the same name: fails when `condition` holds and it is its turn. */
#define WRAP(type, failed, name, parameters, arguments, condition) \
    type name parameters;                                          \
    type name parameters                                           \
    {                                                              \
        static type(*next) parameters;                             \
        if (next == NULL) {                                        \
            next = (type(*) parameters)dlsym(RTLD_NEXT, #name);    \
        }                                                          \
        if ((condition) && fails(#name)) {                         \
            return failed;                                         \
        }                                                          \
        return next arguments;                                     \
    }

/* NOLINTEND(bugprone-macro-parentheses) */

WRAP(int, -1, socket, (int family, int type, int protocol), (family, type, protocol), true)
WRAP(int, -1, bind, (int fd, const struct sockaddr *a, socklen_t size), (fd, a, size), true)
WRAP(int, -1, connect, (int fd, const struct sockaddr *a, socklen_t size), (fd, a, size), true)
WRAP(int, -1, setsockopt, (int fd, int l, int o, const void *v, socklen_t s), (fd, l, o, v, s), true)
WRAP(ssize_t, -1, send, (int fd, const void *b, size_t s, int f), (fd, b, s, f), counts(fd))
WRAP(ssize_t, -1, sendto, (int fd, const void *b, size_t s, int f, const struct sockaddr *a, socklen_t z),
     (fd, b, s, f, a, z), counts(fd))
WRAP(ssize_t, -1, sendmsg, (int fd, const struct msghdr *m, int f), (fd, m, f), counts(fd))
WRAP(ssize_t, -1, recv, (int fd, void *b, size_t s, int f), (fd, b, s, f), counts(fd))
WRAP(ssize_t, -1, recvfrom, (int fd, void *b, size_t s, int f, struct sockaddr *a, socklen_t *z), (fd, b, s, f, a, z),
     counts(fd))
WRAP(ssize_t, -1, recvmsg, (int fd, struct msghdr *m, int f), (fd, m, f), counts(fd))
WRAP(ssize_t, -1, read, (int fd, void *b, size_t s), (fd, b, s), counts(fd))
WRAP(ssize_t, -1, write, (int fd, const void *b, size_t s), (fd, b, s), counts(fd))
WRAP(int, -1, recvmmsg, (int fd, struct mmsghdr *m, unsigned n, int f, struct timespec *t), (fd, m, n, f, t),
     counts(fd))
WRAP(int, -1, getsockopt, (int fd, int l, int o, void *v, socklen_t *s), (fd, l, o, v, s), true)
WRAP(unsigned, 0u, if_nametoindex, (const char *name), (name), true)
WRAP(int, -1, poll, (struct pollfd * p, nfds_t n, int t), (p, n, t), true)
WRAP(int, -1, ppoll, (struct pollfd * p, nfds_t n, const struct timespec *t, const sigset_t *s), (p, n, t, s), true)
WRAP(int, -1, eventfd, (unsigned count, int flags), (count, flags), true)
WRAP(int, -1, dup3, (int from, int to, int flags), (from, to, flags), true)
WRAP(ssize_t, -1, getrandom, (void *b, size_t s, unsigned f), (b, s, f), true)
WRAP(int, -1, stat, (const char *p, struct stat *s), (p, s), is_ours(p))
WRAP(int, -1, lstat, (const char *p, struct stat *s), (p, s), is_ours(p))
WRAP(int, -1, stat64, (const char *p, struct stat64 *s), (p, s), is_ours(p))
WRAP(int, -1, lstat64, (const char *p, struct stat64 *s), (p, s), is_ours(p))
WRAP(int, -1, mkdir, (const char *p, mode_t m), (p, m), is_ours(p))
WRAP(int, -1, chmod, (const char *p, mode_t m), (p, m), is_ours(p))
WRAP(int, -1, rename, (const char *p, const char *q), (p, q), is_ours(p))
WRAP(int, -1, unlink, (const char *p), (p), is_ours(p))
WRAP(DIR *, NULL, opendir, (const char *p), (p), is_ours(p))
WRAP(struct dirent *, NULL, readdir, (DIR * d), (d), counts(dirfd(d)))
WRAP(struct dirent64 *, NULL, readdir64, (DIR * d), (d), counts(dirfd(d)))
WRAP(int, errno, pthread_create, (pthread_t * t, const pthread_attr_t *a, void *(*f)(void *), void *c), (t, a, f, c),
     true)

/* Its argument is whatever the request says; the callers here hand over a pointer. */
/* NOLINTNEXTLINE(readability-inconsistent-declaration-parameter-name): the system's are reserved */
int ioctl(int descriptor, unsigned long request, ...)
{
    static int (*next)(int, unsigned long, ...);
    va_list list;
    va_start(list, request);
    void *argument = va_arg(list, void *);
    va_end(list);
    if (next == NULL) {
        next = (int (*)(int, unsigned long, ...))dlsym(RTLD_NEXT, "ioctl");
    }
    return counts(descriptor) && fails("ioctl") ? -1 : next(descriptor, request, argument);
}
