/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Virtual time of the bus double: whatever happens is an actor that is due at a time in ns.
 *
 * Nothing runs by itself. A test (or a loop, through the rig's clock) lets the world run until a time; all actors that are
 * due until then act, in order of time. Of several that are due together the one that was added first acts first, but
 * wires act last: a frame that becomes ready at the very moment at which the bus is free takes part in the arbitration.
 */
#ifndef CANOPY_TESTS_WORLD_H
#define CANOPY_TESTS_WORLD_H

#include <stdbool.h>
#include <stdint.h>

/** A time, or a duration [ns]. */
typedef uint64_t nanoseconds_t;

#define NEVER UINT64_MAX
#define NS_PER_US UINT64_C(1000)
#define NS_PER_MS UINT64_C(1000000)
#define NS_PER_S UINT64_C(1000000000)

enum { WORLD_ACTORS_MAX = 64 };

/** Something that happens at a time. Kept by the one who adds it. */
typedef struct {
    nanoseconds_t due; /**< NEVER: not for the time being. */
    void (*act)(void *context);
    void *context;
    bool is_last; /**< Of those that are due together. */
} actor_t;

typedef struct {
    nanoseconds_t now;
    actor_t *actors[WORLD_ACTORS_MAX];
    unsigned count;
} world_t;

void world_init(world_t *self);

/** Adds an actor, which is due NEVER until somebody sets its `due`. */
void world_add(world_t *self, actor_t *actor, void (*act)(void *context), void *context);

/** Lets act, once, at a time. */
void world_at(world_t *self, actor_t *actor, nanoseconds_t due, void (*act)(void *context), void *context);

/** Runs up to a time, and past it never: now is `until` then. */
void world_run(world_t *self, nanoseconds_t until);

/** Random numbers that are the same on every machine (xorshift32). The seed must not be 0. */
uint32_t random_next(uint32_t *state);

/** A random number from `least` to `most`. */
uint32_t random_between(uint32_t *state, uint32_t least, uint32_t most);

#endif
