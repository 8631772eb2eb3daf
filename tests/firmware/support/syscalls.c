/* SPDX-License-Identifier: MIT */
/**
 * @file
 * What newlib asks of a system, for tests that print or call assert() through the C library. Output goes to semihosting;
 * there are no files, and the heap is what the linker script leaves between .bss and the stack.
 */
#include <errno.h>
#include <stddef.h>
#include <sys/stat.h>

#include "semihosting.h"

/* Names and types are newlib's. */
int _close(int file);
void _exit(int status);
int _fstat(int file, struct stat *status);
int _getpid(void);
int _isatty(int file);
int _kill(int process, int signal);
int _lseek(int file, int offset, int whence);
int _read(int file, char *buffer, int length);
void *_sbrk(ptrdiff_t increment);
int _write(int file, const char *buffer, int length);

extern char firmware_heap_start[];
extern char firmware_heap_end[];

void _exit(int status)
{
    semihosting_exit(status);
}

int _write(int file, const char *buffer, int length)
{
    (void)file;
    for (int i = 0; i < length; i++) {
        semihosting_put_char(buffer[i]);
    }
    return length;
}

void *_sbrk(ptrdiff_t increment)
{
    static char *end = firmware_heap_start;
    char *start = end;

    if (increment > firmware_heap_end - end) {
        errno = ENOMEM;
        return (void *)-1;
    }
    end += increment;
    return start;
}

int _isatty(int file)
{
    (void)file;
    return 1;
}

int _fstat(int file, struct stat *status)
{
    (void)file;
    status->st_mode = S_IFCHR;
    return 0;
}

int _close(int file)
{
    (void)file;
    return -1;
}

int _lseek(int file, int offset, int whence)
{
    (void)file;
    (void)offset;
    (void)whence;
    return 0;
}

int _read(int file, char *buffer, int length)
{
    (void)file;
    (void)buffer;
    (void)length;
    return 0;
}

int _getpid(void)
{
    return 1;
}

int _kill(int process, int signal)
{
    (void)process;
    (void)signal;
    errno = EINVAL;
    return -1;
}
