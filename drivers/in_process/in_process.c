/* SPDX-License-Identifier: MIT */
/** @file An application in one program with what surrounds it; the contract is in in_process.h. */
#include "canopy/in_process.h"

#include <stddef.h>
#include <string.h>

#include "canopy/e2e.h"

static canopy_time_t virtual_now(void *context)
{
    return ((const canopy_in_process_t *)context)->now;
}

static bool never_wait(void *context, canopy_time_t deadline)
{
    (void)context;
    (void)deadline;
    return false;
}

static void tell(const canopy_in_process_t *self, const canopy_can_frame_t *frame)
{
    if (self->tap != NULL) {
        self->tap(self->tap_context, frame);
    }
}

static int receive(void *context, canopy_can_frame_t *frame)
{
    canopy_in_process_t *self = context;
    const canopy_rx_message_t *message;
    canopy_in_process_sensor_t *sensor;
    uint16_t index;

    if (self->taken == self->due) {
        return 0;
    }
    index = self->sensors[self->taken].queued;
    self->taken++;
    sensor = &self->sensors[index];
    message = &self->app.bus->rx[index];
    frame->time = self->now - sensor->age;
    frame->id = message->id;
    frame->flags = message->flags;
    frame->length = message->length;
    memcpy(frame->data, sensor->data, message->length);
    if (message->data_id != CANOPY_E2E_NONE) {
        canopy_e2e_protect((uint16_t)message->data_id, sensor->counter, frame->data, frame->length);
        sensor->counter = (uint8_t)(sensor->counter + 1u < CANOPY_E2E_COUNTERS ? sensor->counter + 1u : 0u);
    }
    sensor->is_due = false;
    tell(self, frame);
    return 1;
}

static int send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    const canopy_in_process_t *self = context;

    (void)mailbox;
    tell(self, frame);
    if (self->world != NULL && self->world->take != NULL) {
        self->world->take(self->world->context, frame);
    }
    return 1;
}

canopy_error_t canopy_in_process_init(canopy_in_process_t *self, const canopy_app_t *app,
                                      canopy_in_process_sensor_t *sensors, uint16_t count, const canopy_world_t *world,
                                      bool with_trace)
{
    if (self == NULL || app == NULL || app->bus == NULL || (sensors == NULL && app->bus->rx_count > 0u) ||
        count < app->bus->rx_count) {
        return CANOPY_ERROR_ARGUMENT;
    }
    *self = (canopy_in_process_t){.app = *app, .world = world, .sensors = sensors};
    for (uint16_t index = 0; index < app->bus->rx_count; index++) {
        sensors[index] = (canopy_in_process_sensor_t){0};
    }
    self->app.trace = NULL;
    self->can = (canopy_can_t){.context = self, .receive = receive, .send = send, .is_filtered = true};
    self->clock = (canopy_clock_t){.context = self, .now = virtual_now, .wait_until = never_wait};
    self->config = (canopy_loop_config_t){.app = with_trace ? app : &self->app,
                                          .can = &self->can,
                                          .clock = &self->clock,
                                          /* one more than can be due: a cycle that took all knows that it did */
                                          .rx_max = (uint32_t)app->bus->rx_count + 1u};
    return canopy_loop_init(&self->loop, &self->config);
}

uint16_t canopy_in_process_find(const canopy_in_process_t *self, uint32_t id, bool is_extended)
{
    for (uint16_t index = 0; index < self->app.bus->rx_count; index++) {
        const canopy_rx_message_t *message = &self->app.bus->rx[index];

        if (message->id == id && ((message->flags & (unsigned)CANOPY_CAN_EXTENDED) != 0u) == is_extended) {
            return index;
        }
    }
    return CANOPY_IN_PROCESS_NONE;
}

static void make_due(canopy_in_process_t *self, uint16_t message)
{
    if (!self->sensors[message].is_due) {
        self->sensors[message].is_due = true;
        self->sensors[self->due].queued = message;
        self->due++;
    }
}

void canopy_in_process_put(canopy_in_process_t *self, uint16_t message, const uint8_t *data, canopy_time_t age)
{
    memcpy(self->sensors[message].data, data, self->app.bus->rx[message].length);
    self->sensors[message].age = age;
    make_due(self, message);
}

void canopy_in_process_hold(canopy_in_process_t *self, uint16_t message, bool is_held)
{
    if (self->sensors[message].is_held != is_held) {
        self->sensors[message].is_held = is_held;
        self->held = (uint16_t)(is_held ? self->held + 1u : self->held - 1u);
    }
}

/** What each node has returned last: a bit a status. */
static void note_seen(const canopy_in_process_t *self)
{
    const canopy_tree_instance_t *tree = self->app.tree_instance;

    for (uint16_t node = 0; node < tree->tree->node_count; node++) {
        self->seen[node] = (uint8_t)(self->seen[node] | (1u << (unsigned)canopy_status_last(tree->status[node])));
    }
}

canopy_status_t canopy_in_process_tick(canopy_in_process_t *self)
{
    const canopy_world_t *world = self->world;

    if (world != NULL && world->sense != NULL) {
        world->sense(world->context, self);
    }
    for (uint16_t index = 0; self->held > 0u && index < self->app.bus->rx_count; index++) {
        if (self->sensors[index].is_held) {
            make_due(self, index);
        }
    }
    self->root = canopy_loop_cycle(&self->loop, self->now);
    self->due = 0;
    self->taken = 0;
    self->now += self->app.period;
    self->ticks++;
    if (self->seen != NULL) {
        note_seen(self);
    }
    self->has_ended = world != NULL && world->step != NULL && !world->step(world->context);
    return self->root;
}

uint64_t canopy_in_process_run(canopy_in_process_t *self, uint64_t ticks, uint32_t until)
{
    uint64_t made = 0;

    while (made < ticks) {
        canopy_status_t root = canopy_in_process_tick(self);

        made++;
        if (self->has_ended || ((until >> (unsigned)root) & 1u) != 0u) {
            break;
        }
    }
    return made;
}

void canopy_in_process_read(const canopy_in_process_t *self, uint16_t message, uint8_t *data)
{
    self->app.bus->tx[message].encode(self->app.output, data);
}
