/* SPDX-License-Identifier: MIT */
/**
 * @file
 * What leaves are told of the bus, and the way back: warning and passive, bus-off with its back-off, a short circuit, an
 * interface that is down or gone; each told apart, and the safe values first when the bus is back.
 */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "rig.h"
#include "six/probe.h"
#include "six_app.h"
#include "unity.h"

enum { COMMANDS = 6, STATES = CANOPY_CAN_GONE + 1, ATTEMPTS_MAX = 32, PERIOD_MS = 10 };

static rig_t rig;
static uint32_t ticks_in[STATES]; /* as leaves saw it */
static canopy_can_state_t last_state;
static nanoseconds_t fault_at;
static nanoseconds_t mended_at;
static uint8_t first_power[COMMANDS]; /* of the first frame on the wire after the bus has been mended; 0xFF: none yet */
static nanoseconds_t first_at[COMMANDS];
static nanoseconds_t driving_at; /* first frame after that with another value than the safe one */
static nanoseconds_t attempts[ATTEMPTS_MAX];
static uint32_t attempt_count;
static actor_t fault_actor;
static actor_t mend_actor;

void setUp(void)
{
}

void tearDown(void)
{
}

static void see(rig_t *self, const canopy_can_frame_t *frame, nanoseconds_t end)
{
    int command = rig_command_of(self, frame);

    if (command < 0 || mended_at == 0u) {
        return;
    }
    if (first_at[command] == 0u) {
        first_power[command] = frame->data[6];
        first_at[command] = end;
    }
    if (frame->data[6] != 0u && driving_at == 0u) {
        driving_at = end;
    }
}

static void after(rig_t *self)
{
    ticks_in[six_probe.can_state]++;
    last_state = six_probe.can_state;
    if (self->loop.can_manager.restarts > attempt_count && attempt_count < (uint32_t)ATTEMPTS_MAX) {
        attempts[attempt_count++] = self->world.now;
    }
}

static void start(const rig_options_t *options)
{
    memset(ticks_in, 0, sizeof ticks_in);
    memset(first_power, 0xFF, sizeof first_power);
    memset(first_at, 0, sizeof first_at);
    fault_at = 0;
    mended_at = 0;
    driving_at = 0;
    attempt_count = 0;
    rig_init(&rig, options);
    rig.saw = see;
    rig.after = after;
}

/** Runs with a fault from 500 ms on, for `length`, and a second after it. */
static canopy_error_t run(void (*fault)(void *context), void (*mend)(void *context), nanoseconds_t length)
{
    nanoseconds_t begin = rig.world.now + 500u * NS_PER_MS;

    world_at(&rig.world, &fault_actor, begin, fault, NULL);
    world_at(&rig.world, &mend_actor, begin + length, mend, NULL);
    return rig_run(&rig, begin + length + 6u * NS_PER_S);
}

/** The safe values come first, and only when all of them are out what the tree wants. */
static void check_safe_first(void)
{
    for (unsigned command = 0; command < COMMANDS; command++) {
        TEST_ASSERT_EQUAL_HEX8_MESSAGE(0, first_power[command], "not the safe value was first");
        TEST_ASSERT_TRUE_MESSAGE(driving_at > first_at[command], "another value left before all safe ones");
        TEST_ASSERT_EQUAL_UINT32(0, rig.peer.commands[command].refused);
    }
    TEST_ASSERT_FALSE(rig.loop.returning);
}

static void check_safe_first_and_well_again(void)
{
    check_safe_first();
    TEST_ASSERT_EQUAL(CANOPY_CAN_ERROR_ACTIVE, last_state);
}

/* --- many errors ---------------------------------------------------------------------------------------------------- */

static void disturb(void *context)
{
    (void)context;
    fault_at = rig.world.now;
    wire_disturb(&rig.wire, 14); /* of the application's, one after the other: the counter is at 112 then */
}

static void disturb_more(void *context)
{
    (void)context;
    wire_disturb(&rig.wire, 18); /* 8 are 64 more, without what good frames took off */
}

static void test_warning_and_passive_are_told(void)
{
    start(&(rig_options_t){.app = &six_app, .peer_phase = 5u * NS_PER_MS});
    TEST_ASSERT_EQUAL(CANOPY_OK, run(disturb, disturb_more, 100u * NS_PER_MS));
    TEST_ASSERT_GREATER_THAN_UINT32(0, ticks_in[CANOPY_CAN_ERROR_WARNING]);
    TEST_ASSERT_GREATER_THAN_UINT32(0, ticks_in[CANOPY_CAN_ERROR_PASSIVE]);
    TEST_ASSERT_EQUAL_UINT32(0, ticks_in[CANOPY_CAN_BLOCKED]);
    TEST_ASSERT_EQUAL_UINT32(0, ticks_in[CANOPY_CAN_BUS_OFF]);
    TEST_ASSERT_EQUAL(CANOPY_CAN_ERROR_ACTIVE, last_state);
    TEST_ASSERT_EQUAL_UINT32(0, rig.loop.can_manager.failures);
}

/* --- bus-off -------------------------------------------------------------------------------------------------------- */

static void break_transmitter(void *context)
{
    (void)context;
    fault_at = rig.world.now;
    rig.controller->cannot_drive = true;
}

static void mend_transmitter(void *context)
{
    (void)context;
    mended_at = rig.world.now;
    rig.controller->cannot_drive = false;
}

static void check_bus_off(nanoseconds_t length)
{
    nanoseconds_t pause = CANOPY_CAN_RESTART_FIRST_US * NS_PER_US;

    printf("bus-off for %" PRIu64 " ms: %" PRIu32 " bus-offs, %" PRIu32 " restarts, safe values %" PRIu64
           " ms after the mending, driving %" PRIu64 " ms\n",
           length / NS_PER_MS, rig.controller->bus_offs, rig.loop.can_manager.restarts,
           (first_at[COMMANDS - 1] - mended_at) / NS_PER_MS, (driving_at - mended_at) / NS_PER_MS);
    TEST_ASSERT_GREATER_THAN_UINT32(0, ticks_in[CANOPY_CAN_BUS_OFF]);
    TEST_ASSERT_EQUAL_UINT32(0, ticks_in[CANOPY_CAN_BLOCKED]);
    check_safe_first_and_well_again();
    TEST_ASSERT_GREATER_THAN_UINT32(1, attempt_count);
    for (uint32_t index = 1; index < attempt_count; index++) { /* each pause is twice the one before */
        pause = 2u * pause < CANOPY_CAN_RESTART_LONGEST_US * NS_PER_US ? 2u * pause
                                                                       : CANOPY_CAN_RESTART_LONGEST_US * NS_PER_US;
        TEST_ASSERT_GREATER_OR_EQUAL_UINT64(pause, attempts[index] - attempts[index - 1u] + NS_PER_MS);
        TEST_ASSERT_LESS_OR_EQUAL_UINT64(pause + 6u * (nanoseconds_t)PERIOD_MS * NS_PER_MS,
                                         attempts[index] - attempts[index - 1u]);
    }
}

static void test_bus_off_backs_off_and_returns_with_safe_values(void)
{
    start(&(rig_options_t){.app = &six_app});
    TEST_ASSERT_EQUAL(CANOPY_OK, run(break_transmitter, mend_transmitter, NS_PER_S));
    check_bus_off(NS_PER_S);
}

static void test_a_long_bus_off_does_not_disturb_others(void)
{
    start(&(rig_options_t){.app = &six_app, .mailboxes = 1});
    TEST_ASSERT_EQUAL(CANOPY_OK, run(break_transmitter, mend_transmitter, 20u * NS_PER_S));
    check_bus_off(20u * NS_PER_S);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(12, rig.controller->bus_offs); /* 50, 100, ... 5,000 ms: not hundreds */
}

/**
 * On a bus on which a tick's commands do not all get out in one tick, the way back takes more ticks, and ends.
 * @param frames how many of ours get out in a tick, about
 */
static void check_slow_return(const rig_options_t *options, const char *what)
{
    uint64_t ticks;

    start(options);
    (void)run(break_transmitter, mend_transmitter, NS_PER_S);
    TEST_ASSERT_NOT_EQUAL_UINT64_MESSAGE(0, first_at[COMMANDS - 1], "a safe value was never sent");
    ticks = (first_at[COMMANDS - 1] - first_at[0]) / (PERIOD_MS * NS_PER_MS);
    printf("%s: all safe values within %" PRIu64 " ms, driving %" PRIu64 " ms after the first of them\n", what,
           (first_at[COMMANDS - 1] - first_at[0]) / NS_PER_MS, (driving_at - first_at[0]) / NS_PER_MS);
    TEST_ASSERT_GREATER_THAN_UINT64_MESSAGE(0, ticks, "they all left in one tick: this tests nothing");
    TEST_ASSERT_GREATER_THAN_UINT32(0, ticks_in[CANOPY_CAN_BUS_OFF]);
    check_safe_first();
}

static void test_a_slow_bus_gives_control_back(void)
{
    for (uint8_t mailboxes = 1; mailboxes <= 3u; mailboxes += 2u) {
        check_slow_return(
            &(rig_options_t){
                .app = &six_app, .mailboxes = mailboxes, .bit_rate = 50000, .peer_period = 20u * NS_PER_MS},
            "50 kbit/s, some 3 commands a tick");
        check_slow_return(
            &(rig_options_t){
                .app = &six_app, .mailboxes = mailboxes, .bit_rate = 10000, .peer_period = 40u * NS_PER_MS},
            "10 kbit/s, less than one command a tick");
    }
}

static void test_a_loaded_bus_gives_control_back(void)
{
    for (uint8_t mailboxes = 1; mailboxes <= 3u; mailboxes += 2u) {
        check_slow_return(
            &(rig_options_t){.app = &six_app,
                             .mailboxes = mailboxes,
                             .traffic = {.per_mille = 930, .burst = 10, .lowest_id = 0x001, .highest_id = 0x0FF}},
            "93 % by others");
    }
}

static void test_a_controller_that_forgets_at_bus_off(void)
{
    controller_config_t forgets = CONTROLLER_COMMON;

    forgets.keeps_at_bus_off = false;
    start(&(rig_options_t){.app = &six_app, .controller = &forgets});
    TEST_ASSERT_EQUAL(CANOPY_OK, run(break_transmitter, mend_transmitter, NS_PER_S));
    check_bus_off(NS_PER_S);
}

static void test_bus_off_polled(void)
{
    start(&(rig_options_t){.app = &six_app, .polled = true});
    TEST_ASSERT_EQUAL(CANOPY_OK, run(break_transmitter, mend_transmitter, NS_PER_S));
    check_bus_off(NS_PER_S);
}

static void test_bus_off_like_socketcan(void)
{
    start(&(rig_options_t){.app = &six_app, .queue = 10});
    TEST_ASSERT_EQUAL(CANOPY_OK, run(break_transmitter, mend_transmitter, NS_PER_S));
    TEST_ASSERT_GREATER_THAN_UINT32(0, ticks_in[CANOPY_CAN_BUS_OFF]);
    TEST_ASSERT_EQUAL(CANOPY_CAN_ERROR_ACTIVE, last_state);
    /* The one frame that the kernel had taken leaves first; all others are safe. */
    for (unsigned command = 1; command < COMMANDS; command++) {
        TEST_ASSERT_EQUAL_HEX8(0, first_power[command]);
    }
}

/* --- a short circuit ------------------------------------------------------------------------------------------------ */

static void hold(void *context)
{
    (void)context;
    fault_at = rig.world.now;
    wire_hold(&rig.wire, true);
}

static void let_go(void *context)
{
    (void)context;
    mended_at = rig.world.now;
    wire_hold(&rig.wire, false);
}

/* 5 ms after a tick nobody is sending: the controllers wait for a bus that never is idle. */
static void test_a_short_circuit_is_a_blocked_bus(void)
{
    start(&(rig_options_t){.app = &six_app, .peer_phase = 2u * NS_PER_MS});
    rig.world.now += 5u * NS_PER_MS;
    TEST_ASSERT_EQUAL(CANOPY_OK, run(hold, let_go, NS_PER_S));
    TEST_ASSERT_GREATER_THAN_UINT32(90, ticks_in[CANOPY_CAN_BLOCKED]);
    TEST_ASSERT_EQUAL_UINT32(0, ticks_in[CANOPY_CAN_BUS_OFF]);
    TEST_ASSERT_EQUAL(CANOPY_CAN_ERROR_ACTIVE, last_state);
}

/* 200 us after a tick the application's frame is on the wire: it is the transmitter, and goes bus-off. */
static void test_a_short_circuit_while_sending_is_bus_off(void)
{
    start(&(rig_options_t){.app = &six_app, .peer_phase = 2u * NS_PER_MS});
    rig.loop.deadline -= 200; /* the ticks are that much earlier than the fault */
    TEST_ASSERT_EQUAL(CANOPY_OK, run(hold, let_go, NS_PER_S));
    TEST_ASSERT_GREATER_THAN_UINT32(90, ticks_in[CANOPY_CAN_BUS_OFF]);
    check_safe_first_and_well_again();
}

/* --- an interface ---------------------------------------------------------------------------------------------------- */

static void set_down(void *context)
{
    (void)context;
    fault_at = rig.world.now;
    socket_set_link(&rig.socket, SOCKET_DOWN);
}

static void set_gone(void *context)
{
    (void)context;
    fault_at = rig.world.now;
    socket_set_link(&rig.socket, SOCKET_GONE);
}

static void set_up(void *context)
{
    (void)context;
    mended_at = rig.world.now;
    socket_set_link(&rig.socket, SOCKET_UP);
}

static void check_interface(canopy_can_state_t told, bool has_echo)
{
    TEST_ASSERT_UINT32_WITHIN(1, 100, ticks_in[told]);
    for (unsigned state = CANOPY_CAN_BLOCKED; state < STATES; state++) {
        if (state != (unsigned)told) {
            TEST_ASSERT_EQUAL_UINT32(0, ticks_in[state]);
        }
    }
    TEST_ASSERT_EQUAL_UINT32((uint32_t)CANOPY_CAN_ERROR_ACTIVE, rig.faults[CANOPY_FAULT_CAN_STATE].last_detail);
    TEST_ASSERT_EQUAL_UINT32(2, rig.faults[CANOPY_FAULT_CAN_STATE].count);
    check_safe_first_and_well_again();
    TEST_ASSERT_TRUE(has_echo || driving_at > first_at[0]);
}

static void test_an_interface_that_is_down(void)
{
    start(&(rig_options_t){.app = &six_app, .queue = 10});
    TEST_ASSERT_EQUAL(CANOPY_OK, run(set_down, set_up, NS_PER_S));
    check_interface(CANOPY_CAN_DOWN, true);
}

static void test_an_interface_that_is_gone(void)
{
    start(&(rig_options_t){.app = &six_app, .queue = 10});
    TEST_ASSERT_EQUAL(CANOPY_OK, run(set_gone, set_up, NS_PER_S));
    check_interface(CANOPY_CAN_GONE, true);
}

static void test_an_interface_without_echo_that_is_down(void)
{
    start(&(rig_options_t){.app = &six_app, .queue = 10, .no_echo = true});
    TEST_ASSERT_EQUAL(CANOPY_OK, run(set_down, set_up, NS_PER_S));
    check_interface(CANOPY_CAN_DOWN, false);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_warning_and_passive_are_told);
    RUN_TEST(test_bus_off_backs_off_and_returns_with_safe_values);
    RUN_TEST(test_a_long_bus_off_does_not_disturb_others);
    RUN_TEST(test_a_slow_bus_gives_control_back);
    RUN_TEST(test_a_loaded_bus_gives_control_back);
    RUN_TEST(test_a_controller_that_forgets_at_bus_off);
    RUN_TEST(test_bus_off_polled);
    RUN_TEST(test_bus_off_like_socketcan);
    RUN_TEST(test_a_short_circuit_is_a_blocked_bus);
    RUN_TEST(test_a_short_circuit_while_sending_is_bus_off);
    RUN_TEST(test_an_interface_that_is_down);
    RUN_TEST(test_an_interface_that_is_gone);
    RUN_TEST(test_an_interface_without_echo_that_is_down);
    return UNITY_END();
}
