/* SPDX-License-Identifier: MIT */
/**
 * @file
 * For Frama-C: the loop, the bus and the trace with a generated application (nao_home), a CAN driver that receives any
 * frame, accepts any frame or fails in any way, and a clock that says anything.
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
    frame->id = Frama_C_unsigned_int_interval(0, UINT32_MAX);
    frame->flags = (uint8_t)Frama_C_unsigned_int_interval(0, UINT8_MAX);
    frame->length = (uint8_t)Frama_C_unsigned_int_interval(0, CANOPY_CAN_DATA_MAX);
    Frama_C_make_unknown((char *)frame->data, sizeof frame->data);
    return 1;
}

static int send(void *context, const canopy_can_frame_t *frame)
{
    (void)context;
    for (uint8_t byte = 0; byte < frame->length; byte++) {
        /*@ assert sent: \initialized(&frame->data[byte]); */
    }
    return Frama_C_interval(CANOPY_ERROR_NOT_FOUND, 1);
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
    const canopy_can_t can = {.receive = receive, .send = send};
    const canopy_clock_t clock = {.now = any_time, .wait_until = wait_until};
    const canopy_loop_config_t config = {.app = &nao_home_app,
                                         .can = &can,
                                         .clock = &clock,
                                         .rx_max = (uint16_t)Frama_C_unsigned_int_interval(0, UINT16_MAX),
                                         .kick_watchdog = any_bool() ? kick : NULL,
                                         .on_fault = any_bool() ? fault : NULL,
                                         .after_cycle = any_bool() ? after_cycle : NULL};
    canopy_loop_t loop;

    if (canopy_loop_init(&loop, &config) == CANOPY_OK) {
        canopy_loop_run(&loop);
    }
    return 0;
}
