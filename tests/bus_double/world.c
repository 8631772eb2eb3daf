/* SPDX-License-Identifier: MIT */
/** @file Virtual time; the contract is in world.h. */
#include "world.h"

#include <stddef.h>

#include "unity.h"

void world_init(world_t *self)
{
    *self = (world_t){.now = 0};
}

void world_add(world_t *self, actor_t *actor, void (*act)(void *context), void *context)
{
    TEST_ASSERT_LESS_THAN_MESSAGE(WORLD_ACTORS_MAX, self->count, "raise WORLD_ACTORS_MAX");
    *actor = (actor_t){.due = NEVER, .act = act, .context = context};
    self->actors[self->count++] = actor;
}

void world_at(world_t *self, actor_t *actor, nanoseconds_t due, void (*act)(void *context), void *context)
{
    world_add(self, actor, act, context);
    actor->due = due;
}

static actor_t *next_of(const world_t *self)
{
    actor_t *next = NULL;

    for (unsigned index = 0; index < self->count; index++) {
        actor_t *actor = self->actors[index];

        if (next == NULL || actor->due < next->due || (actor->due == next->due && next->is_last && !actor->is_last)) {
            next = actor;
        }
    }
    return next;
}

void world_run(world_t *self, nanoseconds_t until)
{
    for (actor_t *next = next_of(self); next != NULL && next->due <= until; next = next_of(self)) {
        if (next->due > self->now) { /* what is past due happens now: time never goes back */
            self->now = next->due;
        }
        next->due = NEVER;
        next->act(next->context);
    }
    if (until > self->now) {
        self->now = until;
    }
}

uint32_t random_next(uint32_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 17;
    *state ^= *state << 5;
    return *state;
}

uint32_t random_between(uint32_t *state, uint32_t least, uint32_t most)
{
    return least + random_next(state) % (most - least + 1u);
}
