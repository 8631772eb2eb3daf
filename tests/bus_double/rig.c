/* SPDX-License-Identifier: MIT */
/** @file An application's loop on the double; the contract is in rig.h. */
#include "rig.h"

#include <stddef.h>

#include "unity.h"

enum { READ_NS = 100, RUNS_ON_MS = 200 };

static canopy_time_t now(void *context)
{
    rig_t *self = context;

    world_run(&self->world, self->world.now + READ_NS); /* a program that only looks at the clock lets time pass, too */
    return self->world.now / NS_PER_US;
}

static bool wait_until(void *context, canopy_time_t deadline)
{
    rig_t *self = context;
    nanoseconds_t until = deadline * NS_PER_US;

    world_run(&self->world, until < self->end ? until : self->end);
    return self->world.now < self->end;
}

static void on_fault(void *context, canopy_fault_t fault, uint32_t detail)
{
    rig_t *self = context;

    self->faults[fault].count++;
    self->faults[fault].last_detail = detail;
}

static bool after_cycle(void *context, canopy_status_t root)
{
    rig_t *self = context;

    (void)root;
    if (self->after != NULL) {
        self->after(self);
    }
    return true;
}

static void watch(void *context, const canopy_can_frame_t *frame, const controller_t *from, nanoseconds_t start,
                  nanoseconds_t end)
{
    rig_t *self = context;

    (void)start;
    if (from == &self->peer.controller) {
        peer_watch(&self->peer, frame, end);
    } else if (from == self->controller) {
        self->from_controller++;
        if (self->saw != NULL) {
            self->saw(self, frame, end);
        }
    }
}

static const canopy_can_acceptance_t everything = {.everything = true};

static void make_driver(rig_t *self, const rig_options_t *options)
{
    controller_config_t controller = options->controller != NULL ? *options->controller : CONTROLLER_COMMON;

    if (options->queue != 0u) {
        socket_init(&self->socket, &self->wire, options->queue, !options->no_echo,
                    options->unfiltered ? &everything : options->app->acceptance);
        self->controller = &self->socket.controller;
        self->config.can = &self->socket.can;
        return;
    }
    controller.mailboxes = options->mailboxes != 0u ? options->mailboxes : controller.mailboxes;
    port_init(&self->port, &self->wire, &controller,
              &(port_config_t){.kind = options->polled ? PORT_POLLED : PORT_INTERRUPT,
                               .can_abort = !options->cannot_abort,
                               .acceptance = options->unfiltered ? NULL : options->app->acceptance,
                               .fifos = options->fifos},
              options->app->tx);
    self->controller = &self->port.controller;
    self->config.can = &self->port.can;
}

void rig_init(rig_t *self, const rig_options_t *options)
{
    traffic_config_t traffic = options->traffic;
    const uint32_t bit_rate = options->bit_rate != 0u ? options->bit_rate : RIG_BIT_RATE;

    *self = (rig_t){.end = NEVER};
    world_init(&self->world);
    self->world.now = NS_PER_S; /* not 0: a time of 0 is an ordinary time, but in no test's expectation */
    wire_init(&self->wire, &self->world, bit_rate);
    wire_init(&self->nowhere, &self->world, bit_rate);
    wire_set_watch(&self->wire, watch, self);
    self->clock = (canopy_clock_t){.context = self, .now = now, .wait_until = wait_until};
    self->config = (canopy_loop_config_t){.context = self,
                                          .app = options->app,
                                          .clock = &self->clock,
                                          .rx_max = options->rx_max,
                                          .on_fault = on_fault,
                                          .after_cycle = after_cycle};
    make_driver(self, options);
    traffic.seed = traffic.seed != 0u ? traffic.seed : RIG_SEED;
    traffic_init(&self->traffic, &self->wire, &traffic);
    peer_init(&self->peer, &self->wire, options->app,
              options->peer_period != 0u ? options->peer_period : options->app->period * NS_PER_US);
    self->peer.timer.due += options->peer_phase;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&self->loop, &self->config));
}

canopy_error_t rig_run(rig_t *self, nanoseconds_t until)
{
    canopy_error_t error;

    self->end = until;
    error = canopy_loop_run(&self->loop);
    self->stopped_at = self->world.now;
    world_run(&self->world, self->world.now + RUNS_ON_MS * NS_PER_MS);
    return error;
}

void rig_unplug(rig_t *self)
{
    wire_plug(&self->nowhere, self->controller);
}

void rig_plug(rig_t *self)
{
    wire_plug(&self->wire, self->controller);
}

canopy_tx_counters_t rig_counters(const rig_t *self)
{
    canopy_tx_counters_t counters;

    canopy_tx_count(self->config.app->tx, &counters);
    return counters;
}

int rig_command_of(const rig_t *self, const canopy_can_frame_t *frame)
{
    for (uint16_t index = 0; index < self->config.app->bus->tx_count; index++) {
        if (frame->id == self->config.app->bus->tx[index].id) {
            return index;
        }
    }
    return -1;
}
