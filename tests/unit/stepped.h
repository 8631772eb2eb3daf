/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Every interleaving of two threads, for code whose atomics are the macros of <stdatomic.h>: the test includes this file
 * and then the code's .c files, whose accesses to memory become steps here. The two threads are coroutines, of which the
 * explorer lets one take its next step at a time; it goes through all orders.
 *
 * With store buffers, a store that is not sequentially consistent waits in its thread's buffer, and reaches the memory in
 * a step of its own, in order: as on x86 (TSO). With an interrupt, the second thread runs to its end once it has begun,
 * and may come several times: as on a microcontroller.
 */
#ifndef CANOPY_TESTS_STEPPED_H
#define CANOPY_TESTS_STEPPED_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <ucontext.h>

enum { FIRST = 0, SECOND = 1, OUTSIDE = 2, STACK = 65536, STORES_MAX = 16, STEPS_MAX = 256, SHARED_MAX = 8 };

typedef enum { IN_ORDER, STORE_BUFFERS, INTERRUPT } model_t;

typedef struct {
    volatile void *address;
    size_t size;
    uint32_t value;
} store_t;

typedef struct {
    ucontext_t context;
    void (*body)(void);
    bool is_done;
    unsigned runs; /* how often the body may still begin */
    store_t stores[STORES_MAX];
    unsigned store_count;
} thread_t;

/* --- what the test says ---------------------------------------------------------------------------------------------- */

/** Memory that both threads touch: only there does the order matter. */
static struct {
    const volatile void *address;
    size_t size;
} shared[SHARED_MAX];
static unsigned shared_count;

/** Changes what is done, to see that the exploration would find it. A store: true leaves it out. */
static bool (*leave_out_store)(int thread, const volatile void *address, uint32_t value);
static memory_order (*change_order)(int thread, const volatile void *address, memory_order order);
static uint32_t (*change_load)(int thread, const volatile void *address, uint32_t value);

/* --- steps ------------------------------------------------------------------------------------------------------------ */

static thread_t threads[2];
static char stacks[2][STACK];
static ucontext_t explorer;
static int running = OUTSIDE;
static model_t model;

static bool is_shared(const volatile void *address)
{
    for (unsigned place = 0; place < shared_count; place++) {
        if ((uintptr_t)address - (uintptr_t)shared[place].address < shared[place].size) {
            return true;
        }
    }
    return false;
}

static void step(const volatile void *address)
{
    if (running != OUTSIDE && is_shared(address)) {
        (void)swapcontext(&threads[running].context, &explorer);
    }
}

static void write_memory(const store_t *store)
{
    if (store->size == 1u) {
        *(volatile uint8_t *)store->address = (uint8_t)store->value;
    } else {
        *(volatile uint32_t *)store->address = store->value;
    }
}

static void flush_one(thread_t *thread)
{
    write_memory(&thread->stores[0]);
    thread->store_count--;
    memmove(&thread->stores[0], &thread->stores[1], thread->store_count * sizeof thread->stores[0]);
}

static void stepped_store(volatile void *address, size_t size, uint32_t value, memory_order order)
{
    const store_t store = {address, size, value};
    thread_t *thread;

    step(address);
    if (leave_out_store != NULL && leave_out_store(running, address, value)) {
        return;
    }
    order = change_order != NULL ? change_order(running, address, order) : order;
    if (running == OUTSIDE || model != STORE_BUFFERS || !is_shared(address)) {
        write_memory(&store);
        return;
    }
    thread = &threads[running];
    thread->stores[thread->store_count++] = store;
    while (order == memory_order_seq_cst && thread->store_count > 0u) {
        flush_one(thread);
    }
}

static uint32_t stepped_load(const volatile void *address, size_t size, memory_order order)
{
    uint32_t value;

    (void)order;
    step(address);
    value = size == 1u ? *(const volatile uint8_t *)address : *(const volatile uint32_t *)address;
    for (unsigned place = 0; running != OUTSIDE && place < threads[running].store_count; place++) {
        const store_t *own = &threads[running].stores[place];

        value = own->address == address ? own->value : value;
    }
    return change_load != NULL ? change_load(running, address, value) : value;
}

static void *stepped_copy(void *to, const void *from, size_t size)
{
    for (size_t byte = 0; byte < size; byte++) {
        ((uint8_t *)to)[byte] = (uint8_t)stepped_load((const uint8_t *)from + byte, 1, memory_order_relaxed);
    }
    return to;
}

/* --- all orders ------------------------------------------------------------------------------------------------------- */

static unsigned path[STEPS_MAX];  /* which of the possible steps was taken */
static unsigned width[STEPS_MAX]; /* how many were possible */
static unsigned depth;

static void run_body(void)
{
    threads[running].body();
    threads[running].is_done = true;
}

static void resume(int which)
{
    thread_t *thread = &threads[which];

    if (thread->is_done) {
        thread->is_done = false;
        thread->runs--;
        (void)getcontext(&thread->context);
        thread->context.uc_stack.ss_sp = stacks[which];
        thread->context.uc_stack.ss_size = STACK;
        thread->context.uc_link = &explorer;
        makecontext(&thread->context, run_body, 0);
    }
    running = which;
    (void)swapcontext(&explorer, &thread->context);
    running = OUTSIDE;
}

static bool can_run(int which)
{
    if (which == SECOND && model == INTERRUPT && threads[FIRST].is_done && threads[SECOND].is_done) {
        return false; /* what comes afterwards is not an interruption */
    }
    if (which == FIRST && model == INTERRUPT && !threads[SECOND].is_done) {
        return false;
    }
    return !threads[which].is_done || threads[which].runs > 0u;
}

/** Both threads, from their beginning to their end, by `path` as far as it goes and the first possible steps then. */
static void run_once(void (*first)(void), unsigned first_runs, void (*second)(void), unsigned second_runs,
                     unsigned prescribed)
{
    threads[FIRST] = (thread_t){.body = first, .is_done = true, .runs = first_runs};
    threads[SECOND] = (thread_t){.body = second, .is_done = true, .runs = second_runs};
    for (depth = 0; depth < (unsigned)STEPS_MAX; depth++) {
        int possible[4];
        unsigned count = 0;

        for (int which = 0; which < 2; which++) {
            if (can_run(which)) {
                possible[count++] = which;
            }
            if (threads[which].store_count > 0u) {
                possible[count++] = 2 + which;
            }
        }
        if (count == 0u) {
            return;
        }
        path[depth] = depth < prescribed ? path[depth] : 0u;
        width[depth] = count;
        if (possible[path[depth]] < 2) {
            resume(possible[path[depth]]);
        } else {
            flush_one(&threads[possible[path[depth]] - 2]);
        }
    }
}

/**
 * Goes through all orders of the steps of two threads.
 * @param before called before each run, `after` after it: false ends the exploration
 * @return how many orders there were
 */
static unsigned long explore(model_t which, void (*before)(void), void (*first)(void), unsigned first_runs,
                             void (*second)(void), unsigned second_runs, bool (*after)(void))
{
    unsigned long orders = 0;
    unsigned prescribed = 0;

    model = which;
    do {
        before();
        run_once(first, first_runs, second, second_runs, prescribed);
        orders++;
        if (depth == (unsigned)STEPS_MAX || !after()) {
            return orders;
        }
        while (depth > 0u && path[depth - 1u] + 1u == width[depth - 1u]) {
            depth--;
        }
        if (depth > 0u) {
            path[depth - 1u]++;
        }
        prescribed = depth;
    } while (prescribed > 0u);
    return orders;
}

/* NOLINTBEGIN(readability-identifier-naming): from here on the code's accesses are steps. */
#undef atomic_load
#undef atomic_load_explicit
#undef atomic_store
#undef atomic_store_explicit
#define atomic_load(object) stepped_load((object), sizeof *(object), memory_order_seq_cst)
#define atomic_load_explicit(object, order) stepped_load((object), sizeof *(object), (order))
#define atomic_store(object, value) stepped_store((object), sizeof *(object), (uint32_t)(value), memory_order_seq_cst)
#define atomic_store_explicit(object, value, order) \
    stepped_store((object), sizeof *(object), (uint32_t)(value), (order))
#undef memcpy
#define memcpy stepped_copy
/* NOLINTEND(readability-identifier-naming) */

#endif
