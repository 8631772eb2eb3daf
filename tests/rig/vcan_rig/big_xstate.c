/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Preloaded into User-Mode Linux: makes it work on processors with much register state (Intel AMX: 11 KB).
 *
 * UML 6.1 keeps room for the state of AVX-512 only. The host's kernel takes a PTRACE_SETREGSET of the extended state at
 * its full size or not at all, so on such a processor the guest's first process dies. Here a state that is too short is
 * laid over what the process has now, and set at full size. The rest, AMX, is then not switched between threads of the
 * guest; nothing in it uses that.
 */
#define _GNU_SOURCE /* NOLINT: the name is the C library's; for RTLD_NEXT */
#include <dlfcn.h>
#include <elf.h>
#include <errno.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/types.h>
#include <sys/uio.h>

/* Linux's largest is 11008 bytes so far. */
enum { ROOM = 65536 };

typedef long (*ptrace_function_t)(int request, pid_t process, void *address, void *data);

static long set_full_state(ptrace_function_t next, pid_t process, void *address, const struct iovec *given)
{
    static _Alignas(64) char state[ROOM]; /* the guest's kernel is one thread */
    struct iovec full = {.iov_base = state, .iov_len = sizeof(state)};

    if (next(PTRACE_GETREGSET, process, address, &full) != 0) {
        return -1;
    }
    if (given->iov_len >= full.iov_len) {
        errno = EFAULT;
        return -1;
    }
    memcpy(state, given->iov_base, given->iov_len);
    return next(PTRACE_SETREGSET, process, address, &full);
}

long ptrace(enum __ptrace_request request, ...)
{
    static ptrace_function_t next;
    va_list arguments;

    va_start(arguments, request);
    pid_t process = va_arg(arguments, pid_t);
    void *address = va_arg(arguments, void *);
    void *data = va_arg(arguments, void *);
    va_end(arguments);

    if (next == NULL) {
        /* POSIX lets a pointer to a function come out of dlsym(); C has no cast for it. */
        *(void **)&next = dlsym(RTLD_NEXT, "ptrace");
    }
    long result = next((int)request, process, address, data);
    if (result != 0 && errno == EFAULT && request == PTRACE_SETREGSET && address == (void *)NT_X86_XSTATE) {
        result = set_full_state(next, process, address, data);
    }
    return result;
}
