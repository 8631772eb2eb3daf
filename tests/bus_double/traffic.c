/* SPDX-License-Identifier: MIT */
/** @file What others send; the contract is in traffic.h. */
#include "traffic.h"

#include "frame_bits.h"

enum { PER_MILLE = 1000 };

#define MAILBOXES 3u

static void load(void *context)
{
    traffic_t *self = context;

    for (uint8_t mailbox = 0; mailbox < MAILBOXES; mailbox++) {
        controller_release(&self->controller, mailbox);
        if (self->waiting > 0u && controller_send(&self->controller, mailbox, &self->backlog[self->first])) {
            self->first = (self->first + 1u) % (uint32_t)TRAFFIC_BACKLOG;
            self->waiting--;
        }
    }
}

static canopy_can_frame_t make(traffic_t *self)
{
    canopy_can_frame_t frame = {
        .id = random_between(&self->random, self->config.lowest_id, self->config.highest_id),
        .length = (uint8_t)random_between(&self->random, self->config.shortest, 8),
    };

    if (self->config.mixed && random_between(&self->random, 0, 1) == 0u) {
        frame.id = 0x700u | (frame.id & 0xFFu);
    }
    for (unsigned byte = 0; byte < frame.length; byte++) {
        frame.data[byte] = (uint8_t)(random_next(&self->random) >> 24);
    }
    return frame;
}

static void push(traffic_t *self, const canopy_can_frame_t *frame)
{
    if (self->waiting == (uint32_t)TRAFFIC_BACKLOG) {
        self->lost++;
        return;
    }
    self->backlog[(self->first + self->waiting) % (uint32_t)TRAFFIC_BACKLOG] = *frame;
    self->waiting++;
}

/** Sets when enough is saved up for a part of the burst. */
static void save_up(traffic_t *self)
{
    uint64_t longest = (uint64_t)TRAFFIC_FRAME_BITS * self->controller.wire->bit_ns * PER_MILLE;
    uint64_t target = longest * random_between(&self->random, 1, self->config.burst);
    uint64_t missing = target > self->saved_ns ? target - self->saved_ns : 0u;

    self->actor.due = self->saved_at + (missing + self->config.per_mille - 1u) / self->config.per_mille;
}

static void burst(traffic_t *self)
{
    nanoseconds_t now = self->controller.world->now;

    self->saved_ns += (now - self->saved_at) * self->config.per_mille;
    self->saved_at = now;
    for (;;) {
        canopy_can_frame_t frame = make(self);
        uint64_t cost = (uint64_t)frame_length(&frame) * self->controller.wire->bit_ns * PER_MILLE;

        if (cost > self->saved_ns) {
            break; /* this one is not sent, the next one is another one */
        }
        self->saved_ns -= cost;
        push(self, &frame);
    }
    save_up(self);
}

static void act(void *context)
{
    traffic_t *self = context;

    if (self->config.per_second != 0u) {
        canopy_can_frame_t frame = make(self);

        push(self, &frame);
        self->actor.due = self->controller.world->now + NS_PER_S / self->config.per_second;
    } else {
        burst(self);
    }
    load(self);
}

void traffic_init(traffic_t *self, wire_t *wire, const traffic_config_t *config)
{
    const controller_config_t sender = {.mailboxes = MAILBOXES, .depth = 1, .stamp_bits = 16, .stamp_ns = 2000};

    *self = (traffic_t){.config = *config, .random = config->seed, .saved_at = wire->world->now};
    controller_init(&self->controller, wire, "others", &sender);
    self->controller.isr = load;
    self->controller.isr_context = self;
    controller_filter(&self->controller, (controller_filter_t){.id = 0x7FF, .mask = 0x7FF}); /* hears nothing else */
    world_add(wire->world, &self->actor, act, self);
    if (config->per_second != 0u || config->per_mille != 0u) {
        self->actor.due = wire->world->now + random_between(&self->random, 0, NS_PER_MS);
    }
}
