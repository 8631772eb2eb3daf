/* SPDX-License-Identifier: MIT */
/** @file The other side of an application's bus; the contract is in peer.h. */
#include "peer.h"

#include <stddef.h>

#include "unity.h"

/** Where the number of a message of so many bytes is: behind the E2E header where there is room, else its first bytes. */
static unsigned number_at(uint8_t length)
{
    return length >= 4u ? 2u : 0u;
}

uint16_t peer_number(const canopy_can_frame_t *frame)
{
    unsigned at = number_at(frame->length);

    return (uint16_t)(frame->data[at] | ((unsigned)frame->data[at + 1u] << 8));
}

/** That it sends; peer_init() has checked that each has a mailbox. */
static uint8_t message_count(const peer_t *self)
{
    return (uint8_t)self->app->bus->rx_count;
}

static void note_sent(peer_t *self)
{
    for (uint8_t index = 0; index < message_count(self); index++) {
        if (self->loaded[index] && self->controller.mailboxes[index].state != MAILBOX_PENDING) {
            if (self->controller.mailboxes[index].state == MAILBOX_SENT) {
                self->counter[index] = (uint8_t)((self->counter[index] + 1u) % CANOPY_E2E_COUNTERS);
                self->sent++;
            }
            self->loaded[index] = false;
            controller_release(&self->controller, index);
        }
    }
}

static void take_command(peer_t *self, const canopy_can_frame_t *frame)
{
    for (uint16_t index = 0; index < self->app->bus->tx_count; index++) {
        const canopy_tx_message_t *message = &self->app->bus->tx[index];
        peer_command_t *command = &self->commands[index];

        if (frame->id != message->id ||
            (frame->flags & CANOPY_CAN_EXTENDED) != (message->flags & CANOPY_CAN_EXTENDED)) {
            continue;
        }
        if (message->data_id != CANOPY_E2E_NONE &&
            canopy_e2e_check(&command->e2e, (uint16_t)message->data_id, frame->data, frame->length) != CANOPY_E2E_OK) {
            command->refused++;
            continue;
        }
        command->accepted++;
        command->value = frame->data[frame->length - 1u];
    }
}

static void isr(void *context)
{
    peer_t *self = context;
    received_t received;

    note_sent(self);
    while (controller_receive(&self->controller, 0, &received)) {
        take_command(self, &received.frame);
    }
}

/** Each message once, with the value of now: one that is still waiting gives way. */
static void send(void *context)
{
    peer_t *self = context;

    self->timer.due = self->controller.world->now + self->period;
    for (uint8_t index = 0; !self->silent && index < message_count(self); index++) {
        const canopy_rx_message_t *message = &self->app->bus->rx[index];
        canopy_can_frame_t frame = {.id = message->id, .flags = message->flags, .length = (uint8_t)message->length};

        controller_abort(&self->controller, index);
        note_sent(self);
        if (self->loaded[index]) {
            continue; /* it is on the wire just now */
        }
        self->number = (uint16_t)(self->first_number + (self->number - self->first_number + 1u) % PEER_NUMBERS);
        frame.data[number_at(frame.length)] = (uint8_t)(self->number & 0xFFu);
        frame.data[number_at(frame.length) + 1u] = (uint8_t)(self->number >> 8);
        if (message->data_id != CANOPY_E2E_NONE) {
            canopy_e2e_protect((uint16_t)message->data_id, self->counter[index], frame.data, frame.length);
        }
        TEST_ASSERT_TRUE(controller_send(&self->controller, index, &frame));
        self->loaded[index] = true;
    }
}

void peer_watch(peer_t *self, const canopy_can_frame_t *frame, nanoseconds_t end)
{
    self->on_wire_at[peer_number(frame) % (unsigned)PEER_NUMBERS] = end;
    self->last_on_wire = end;
}

void peer_init(peer_t *self, wire_t *wire, const canopy_app_t *app, nanoseconds_t period)
{
    const controller_config_t config = {.mailboxes = CONTROLLER_MAILBOXES_MAX,
                                        .keeps_at_bus_off = true,
                                        .depth = CONTROLLER_FIFO_MAX,
                                        .stamp_bits = 32,
                                        .stamp_ns = 1000,
                                        .latency_ns = 1000};

    TEST_ASSERT_LESS_OR_EQUAL(PEER_MESSAGES_MAX, app->bus->tx_count);
    TEST_ASSERT_LESS_OR_EQUAL(CONTROLLER_MAILBOXES_MAX, app->bus->rx_count);
    *self = (peer_t){.app = app, .period = period};
    controller_init(&self->controller, wire, "robot", &config);
    for (uint16_t index = 0; index < app->bus->tx_count; index++) {
        controller_filter(&self->controller,
                          (controller_filter_t){.id = app->bus->tx[index].id,
                                                .mask = UINT32_C(0x1FFFFFFF),
                                                .extended = (app->bus->tx[index].flags & CANOPY_CAN_EXTENDED) != 0u});
    }
    self->controller.isr = isr;
    self->controller.isr_context = self;
    world_at(wire->world, &self->timer, wire->world->now, send, self);
}
