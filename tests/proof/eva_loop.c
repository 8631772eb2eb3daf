/* SPDX-License-Identifier: MIT */
/**
 * @file
 * For Frama-C: the loop, the bus, the transmit side, the state of the bus and the trace with a generated application
 * (nao_home), a CAN driver that receives any frame at any time, has any number of mailboxes, accepts any frame, lets it
 * out, takes it back or fails in any way, and a clock that says anything.
 */
#include <stddef.h>

#include "__fc_builtin.h"
#include "canopy/loop.h"
#include "nao_home_app.h"

static canopy_time_t any_time(void *context)
{
    (void)context;
    return Frama_C_unsigned_long_long_interval(0, UINT64_MAX);
}

static bool any_bool(void)
{
    return Frama_C_interval(0, 1) != 0;
}

static bool wait_until(void *context, canopy_time_t deadline)
{
    (void)context;
    (void)deadline;
    return any_bool();
}

static int receive(void *context, canopy_can_frame_t *frame)
{
    (void)context;
    if (any_bool()) {
        return Frama_C_interval(CANOPY_ERROR_NOT_FOUND, 0);
    }
    frame->time = any_time(NULL);
    frame->id = Frama_C_unsigned_int_interval(0, UINT32_MAX);
    frame->flags = (uint8_t)Frama_C_unsigned_int_interval(0, UINT8_MAX);
    frame->length = (uint8_t)Frama_C_unsigned_int_interval(0, CANOPY_CAN_DATA_MAX);
    Frama_C_make_unknown((char *)frame->data, sizeof frame->data);
    return 1;
}

static int send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    (void)context;
    /*@ assert mailbox: mailbox < CANOPY_CAN_MAILBOXES_MAX; */
    for (uint8_t byte = 0; byte < frame->length; byte++) {
        /*@ assert sent: \initialized(&frame->data[byte]); */
    }
    return Frama_C_interval(CANOPY_ERROR_NOT_FOUND, 1);
}

static canopy_can_outcome_t outcome(void *context, uint8_t mailbox)
{
    (void)context;
    /*@ assert full: mailbox < CANOPY_CAN_MAILBOXES_MAX; */
    return (canopy_can_outcome_t)Frama_C_interval(CANOPY_CAN_PENDING, CANOPY_CAN_ABORTED);
}

static void take_back(void *context, uint8_t mailbox)
{
    (void)context;
    /*@ assert abort: mailbox < CANOPY_CAN_MAILBOXES_MAX; */
}

static void nothing(void *context)
{
    (void)context;
}

static canopy_can_controller_t state(void *context)
{
    (void)context;
    return (canopy_can_controller_t)Frama_C_interval(CANOPY_CAN_CONTROLLER_ACTIVE, CANOPY_CAN_CONTROLLER_GONE);
}

static int wait(void *context, uint32_t timeout_us)
{
    (void)context;
    (void)timeout_us;
    return Frama_C_interval(CANOPY_ERROR_NOT_FOUND, 1);
}

static void stats(void *context, canopy_can_stats_t *into)
{
    (void)context;
    into->rx_dropped = Frama_C_unsigned_int_interval(0, UINT32_MAX);
}

static void kick(void *context)
{
    (void)context;
}

static void fault(void *context, canopy_fault_t which, uint32_t detail)
{
    (void)context;
    (void)which;
    (void)detail;
}

static bool after_cycle(void *context, canopy_status_t root)
{
    (void)context;
    /*@ assert result: CANOPY_RUNNING <= root <= CANOPY_SKIPPED; */
    return any_bool();
}

int main(void)
{
    const canopy_can_t can = {.receive = receive,
                              .send = send,
#ifdef MAILBOXES
                              .outcome = outcome,
                              .abort = any_bool() ? take_back : NULL,
#endif
                              .request = any_bool() ? nothing : NULL,
                              .state = any_bool() ? state : NULL,
                              .restart = any_bool() ? nothing : NULL,
                              .wait = any_bool() ? wait : NULL,
                              .stats = any_bool() ? stats : NULL,
                              .mailboxes = (uint8_t)Frama_C_unsigned_int_interval(0, UINT8_MAX),
                              .is_filtered = any_bool()};
    const canopy_clock_t clock = {.now = any_time, .wait_until = wait_until};
    const canopy_loop_config_t config = {.app = &nao_home_app,
                                         .can = &can,
                                         .clock = &clock,
                                         .rx_max = Frama_C_unsigned_int_interval(0, UINT32_MAX),
                                         .stop_us = any_time(NULL),
                                         .kick_watchdog = any_bool() ? kick : NULL,
                                         .on_fault = any_bool() ? fault : NULL,
                                         .after_cycle = any_bool() ? after_cycle : NULL};
    canopy_loop_t loop;

    if (canopy_loop_init(&loop, &config) == CANOPY_OK) {
        (void)canopy_loop_run(&loop);
        canopy_tx_service(nao_home_app.tx, any_time(NULL)); /* of a transmit interrupt, for the driver with request() */
    }
    return 0;
}
