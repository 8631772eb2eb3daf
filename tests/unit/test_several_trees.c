/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Two trees of one program, two nodes of one DBC, at 10 ms and 40 ms, in one thread and on one CAN controller: each
 * ticks and sends at its own rate, and sees what the other sends.
 */
#include "canopy/can/loopback.h"
#include "driver_app.h"
#include "navigator_app.h"
#include "unity.h"

enum { QUEUE = 16, RUN_MS = 1200, ECHO_ID = 0x211 };
#define MS UINT64_C(1000)

/** What has gone to the wire with one id, before the end. */
typedef struct {
    uint32_t id;
    unsigned interval_ms; /* expected */
    unsigned count;
    canopy_time_t last;
} sent_t;

static sent_t sent[] = {
    {DRIVER_DRIVE_ID, 20, 0, 0}, {DRIVER_LAMP_ID, 40, 0, 0}, {NAVIGATOR_GOAL_ID, 40, 0, 0},
    {ECHO_ID, 120, 0, 0},        {0x600, 10, 0, 0},          {0x601, 10, 0, 0},
    {0x606, 200, 0, 0},          {0x610, 40, 0, 0},          {0x611, 40, 0, 0},
    {0x616, 200, 0, 0},
};
enum { KINDS = sizeof sent / sizeof sent[0] };

static canopy_time_t time_now;
static canopy_time_t next_wheels;
static uint8_t echoed;
static unsigned unexpected;
static unsigned off_beat;
static unsigned last_commands; /* frames sent after the end */
static unsigned unsafe;        /* those of them that had another value than the safe one */
static bool ended;

/* --- the controller: the wheels report every 10 ms ------------------------------------------------------------------ */

static int controller_receive(void *context, canopy_can_frame_t *frame)
{
    (void)context;
    if (time_now < next_wheels) {
        return 0;
    }
    *frame = (canopy_can_frame_t){
        .time = next_wheels, .id = DRIVER_WHEELS_ID, .length = DRIVER_WHEELS_LENGTH, .data = {100, 0, 0}};
    next_wheels += 10 * MS;
    return 1;
}

static int controller_send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    (void)context;
    (void)mailbox;
    if (ended) {
        last_commands++;
        unsafe += frame->data[0] != 0u ? 1u : 0u;
        return 1;
    }
    if (frame->id == ECHO_ID) {
        echoed = frame->data[0];
    }
    for (unsigned kind = 0; kind < (unsigned)KINDS; kind++) {
        if (sent[kind].id == frame->id) {
            if (sent[kind].count > 0u && time_now - sent[kind].last != sent[kind].interval_ms * MS) {
                off_beat++;
            }
            sent[kind].count++;
            sent[kind].last = time_now;
            return 1;
        }
    }
    /* Snapshots, changes and the model come when they come. */
    unexpected +=
        (frame->id >= 0x602u && frame->id <= 0x607u) || (frame->id >= 0x612u && frame->id <= 0x617u) ? 0u : 1u;
    return 1;
}

static const canopy_can_t controller = {.receive = controller_receive, .send = controller_send};

/* --- a clock that jumps to the next deadline ------------------------------------------------------------------------ */

static canopy_time_t now(void *context)
{
    (void)context;
    return time_now;
}

static bool wait_until(void *context, canopy_time_t deadline)
{
    (void)context;
    ended = deadline >= RUN_MS * MS;
    if (!ended) {
        TEST_ASSERT_TRUE(deadline >= time_now);
        time_now = deadline;
    }
    return !ended;
}

static const canopy_clock_t virtual_clock = {.now = now, .wait_until = wait_until};

static canopy_loopback_t bus;
static canopy_loopback_endpoint_t driver_end, navigator_end;
static canopy_can_frame_t driver_queue[QUEUE], navigator_queue[QUEUE];
static canopy_loop_t driver, navigator;
static canopy_loop_t *const loops[] = {&driver, &navigator};

static bool stop_after_three(void *context, canopy_status_t root)
{
    (void)context;
    (void)root;
    ended = driver.ticks == 3u;
    return !ended;
}

static canopy_loop_config_t driver_config = {.app = &driver_app, .can = &driver_end.can, .clock = &virtual_clock};
static const canopy_loop_config_t navigator_config = {
    .app = &navigator_app, .can = &navigator_end.can, .clock = &virtual_clock};

void setUp(void)
{
    time_now = 0;
    next_wheels = 0;
    echoed = 0;
    unexpected = off_beat = last_commands = unsafe = 0;
    ended = false;
    for (unsigned kind = 0; kind < (unsigned)KINDS; kind++) {
        sent[kind].count = 0;
    }
    bus = (canopy_loopback_t){.controller = &controller};
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loopback_join(&bus, &driver_end, driver_queue, QUEUE, driver_app.acceptance));
    TEST_ASSERT_EQUAL(CANOPY_OK,
                      canopy_loopback_join(&bus, &navigator_end, navigator_queue, QUEUE, navigator_app.acceptance));
    driver_config.after_cycle = NULL;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&driver, &driver_config));
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&navigator, &navigator_config));
}

void tearDown(void)
{
}

static void each_tree_ticks_and_sends_at_its_own_rate(void)
{
    canopy_loop_run_all(loops, 2);
    TEST_ASSERT_EQUAL_UINT32(RUN_MS / 10, driver.ticks);
    TEST_ASSERT_EQUAL_UINT32(RUN_MS / 40, navigator.ticks);
    for (unsigned kind = 0; kind < (unsigned)KINDS; kind++) {
        TEST_ASSERT_EQUAL_UINT(RUN_MS / sent[kind].interval_ms, sent[kind].count);
    }
    TEST_ASSERT_EQUAL_UINT(0, off_beat);
    TEST_ASSERT_EQUAL_UINT(0, unexpected);
}

static void each_sees_the_wire_and_what_the_other_sends(void)
{
    canopy_can_stats_t stats;

    canopy_loop_run_all(loops, 2);
    TEST_ASSERT_EQUAL_UINT8(42, driver_input->goal.target);
    TEST_ASSERT_EQUAL_UINT8(42, navigator_input->drive.target);
    TEST_ASSERT_EQUAL_UINT8(42, echoed);
    TEST_ASSERT_EQUAL_INT16(100, driver_input->wheels.speed);
    TEST_ASSERT_EQUAL_INT16(100, navigator_input->wheels.speed);
    TEST_ASSERT_EQUAL_UINT8(CANOPY_CODE_RESET_BEFORE + CANOPY_SUCCESS,
                            canopy_tree_status_code(driver_app.tree_instance, 0));
    TEST_ASSERT_EQUAL_UINT8(CANOPY_CODE_RESET_BEFORE + CANOPY_SUCCESS,
                            canopy_tree_status_code(navigator_app.tree_instance, 0));
    for (unsigned end = 0; end < 2u; end++) {
        const canopy_can_t *can = end == 0u ? &driver_end.can : &navigator_end.can;

        can->stats(can->context, &stats);
        TEST_ASSERT_EQUAL_UINT32(0, stats.rx_dropped);
        TEST_ASSERT_EQUAL_UINT32(0, stats.tx_dropped);
    }
    TEST_ASSERT_EQUAL_UINT32(0, driver_app.bus_state->counters.timeouts);
    TEST_ASSERT_EQUAL_UINT32(0, navigator_app.bus_state->counters.timeouts);
}

static void one_that_says_stop_stops_all_and_all_send_safe_values(void)
{
    driver_config.after_cycle = stop_after_three;
    canopy_loop_run_all(loops, 2);
    TEST_ASSERT_EQUAL_UINT32(3, driver.ticks);
    TEST_ASSERT_EQUAL_UINT32(1, navigator.ticks);
    TEST_ASSERT_EQUAL_UINT(4, last_commands);
    TEST_ASSERT_EQUAL_UINT(0, unsafe);
    TEST_ASSERT_EQUAL_UINT8(CANOPY_CODE_RESET_BEFORE + CANOPY_SUCCESS,
                            canopy_tree_status_code(navigator_app.tree_instance, 0));
}

static void of_two_that_are_due_together_the_first_in_the_list_is_first(void)
{
    canopy_loop_t *const other_order[] = {&navigator, &driver};

    canopy_loop_run_all(other_order, 2);
    /* The driver's first tick saw the navigator's first goal already. */
    TEST_ASSERT_EQUAL_UINT(RUN_MS / 40 * 2, sent[0].count);
    TEST_ASSERT_EQUAL_UINT8(42, driver_input->goal.target);
    TEST_ASSERT_EQUAL_UINT32(RUN_MS / 10, driver.ticks);
}

static void a_phase_can_be_set_before_the_run(void)
{
    navigator.deadline += 5 * MS;
    canopy_loop_run_all(loops, 2);
    TEST_ASSERT_EQUAL_UINT64(RUN_MS * MS - 40 * MS + 5 * MS, sent[2].last);
    TEST_ASSERT_EQUAL_UINT(0, off_beat);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(each_tree_ticks_and_sends_at_its_own_rate);
    RUN_TEST(each_sees_the_wire_and_what_the_other_sends);
    RUN_TEST(one_that_says_stop_stops_all_and_all_send_safe_values);
    RUN_TEST(of_two_that_are_due_together_the_first_in_the_list_is_first);
    RUN_TEST(a_phase_can_be_set_before_the_run);
    return UNITY_END();
}
