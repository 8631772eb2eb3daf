/* SPDX-License-Identifier: MIT */
/**
 * @file
 * An application (TEST_APP) on a bus on which others take 0, 30, 60 and 90 %, mostly all of higher priority: how old the
 * message is that a leaf sees (TEST_FIELD), how long commands wait, and how long it takes to the safe values when its
 * sender is cut off. Measured, printed, and compared with what is promised and with the compiler's bounds.
 */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include TEST_HEADER
#include "load_bounds.h"
#include "rig.h"
#include "unity.h"

enum {
    COMMANDS = sizeof load_bounds[0].wait / sizeof load_bounds[0].wait[0],
    BURST = 10,
    FRAME_US = 300,     /* the one on the wire at a deadline goes to its end; an interrupt has a latency */
    STAMPED_LENGTH = 7, /* a command of six.dbc: with the time of its tick */
    SECONDS = 20,
    CUTS = 20,
    SEED = 42,
    CUT_SEED = 1000
};

/** What is measured. */
typedef struct {
    uint32_t per_mille;
    uint8_t mailboxes;
    bool polled;
    bool mixed; /* half of the others' frames have a lower priority; else all have a higher one */
} case_t;

/** What one load does to an application. All times in us. */
typedef struct {
    uint32_t age_max; /* at the tick, since the end of the frame on the wire */
    uint64_t age_sum;
    uint32_t fresh;              /* ticks in which it was, before the cut */
    uint32_t wait_max[COMMANDS]; /* from the tick to the end of the command's frame */
    uint32_t expired;            /* or replaced */
    uint32_t sent;
    uint32_t decided_max; /* from the end of the last reading to the tick that decides for the safe values */
    uint32_t safe_max;    /* and to the end of the last of the six frames that bring them */
} result_t;

static rig_t rig;
static case_t given;
static result_t result;
static uint32_t timeout_us; /* of the message */
static uint32_t period_us;
static nanoseconds_t tick_at; /* the last one */
static nanoseconds_t cut_at;
static nanoseconds_t decided_at;
static nanoseconds_t safe_at[COMMANDS];

void setUp(void)
{
}

void tearDown(void)
{
    if (Unity.CurrentTestFailed != 0) {
        printf("at %" PRIu32 " per mille, seed %" PRIu32 "\n", given.per_mille, rig.traffic.config.seed);
    }
}

/** When a command was decided: as its frame says, else in the last tick; 0: it was not. */
static nanoseconds_t decision_of(const canopy_can_frame_t *frame)
{
    if (frame->length != (uint8_t)STAMPED_LENGTH) {
        return tick_at;
    }
    return ((nanoseconds_t)frame->data[2] | ((nanoseconds_t)frame->data[3] << 8) |
            ((nanoseconds_t)frame->data[4] << 16) | ((nanoseconds_t)frame->data[5] << 24)) *
           NS_PER_US;
}

static void see(rig_t *self, const canopy_can_frame_t *frame, nanoseconds_t end)
{
    int command = rig_command_of(self, frame);
    nanoseconds_t decided = decision_of(frame);

    if (command < 0) {
        return;
    }
    if (frame->data[frame->length - 1u] == 0u && end > cut_at && safe_at[command] == 0u) {
        safe_at[command] = end;
    }
    if (decided != 0u && end <= self->end) { /* else it is of the stop */
        uint32_t wait = (uint32_t)((end - decided + NS_PER_US - 1u) / NS_PER_US);

        result.wait_max[command] = wait > result.wait_max[command] ? wait : result.wait_max[command];
    }
}

/** After a tick: is what the leaf was told true? */
static void after(rig_t *self)
{
    const uint16_t number = (uint16_t)TEST_INPUT->TEST_FIELD.TEST_NUMBER;
    const uint32_t told_us = TEST_INPUT->TEST_FIELD.age_ms * 1000u;
    nanoseconds_t end;
    uint32_t age;

    tick_at = TEST_INPUT->now * NS_PER_US;
    if (!TEST_INPUT->TEST_FIELD.fresh) {
        TEST_ASSERT_EQUAL_UINT16(CANOPY_AGE_MAX, TEST_INPUT->TEST_FIELD.age_ms);
        decided_at = decided_at == 0u && tick_at > cut_at ? tick_at : decided_at;
        return;
    }
    end = self->peer.on_wire_at[number % (unsigned)PEER_NUMBERS];
    age = tick_at > end ? (uint32_t)((tick_at - end) / NS_PER_US) : 0u; /* it came in its last bit */
    TEST_ASSERT_LESS_THAN_UINT32_MESSAGE(timeout_us, age, "old data was called fresh");
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32_MESSAGE(age, told_us, "data is older than the leaf was told");
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(age + 2000u, told_us); /* rounded up, once or twice */
    if (tick_at <= cut_at) {
        result.fresh++;
        result.age_max = age > result.age_max ? age : result.age_max;
        result.age_sum += age;
    }
}

static void start(uint32_t seed, nanoseconds_t phase)
{
    static controller_config_t controller;
    const rig_options_t options = {.app = &TEST_APP,
                                   .controller = &controller,
                                   .mailboxes = given.mailboxes,
                                   .polled = given.polled,
                                   .peer_phase = phase,
                                   .traffic = {.seed = seed,
                                               .per_mille = given.per_mille,
                                               .burst = BURST,
                                               .lowest_id = 0x001,
                                               .highest_id = 0x0FF,
                                               .mixed = given.mixed}};

    controller = CONTROLLER_COMMON;
    controller.depth = 8; /* polled, it holds what comes between two ticks: with jitter, two of each message and more */
    memset(safe_at, 0, sizeof safe_at);
    decided_at = 0;
    cut_at = NEVER;
    rig_init(&rig, &options);
    rig.saw = see;
    rig.after = after;
}

static void cut(void *context)
{
    (void)context;
    rig.peer.silent = true;
    cut_at = rig.world.now;
}

/** Cuts the sensor at some moment of a cycle, and notes how long it takes to the safe values. */
static void run_cut(uint32_t index)
{
    const nanoseconds_t period = period_us * NS_PER_US;
    actor_t cutter;
    nanoseconds_t begin;
    nanoseconds_t last;
    uint32_t decided;

    start((uint32_t)CUT_SEED + index, index * 7u % CUTS * period / CUTS);
    begin = rig.world.now;
    world_at(&rig.world, &cutter, begin + 30u * period + index * period / CUTS, cut, NULL);
    (void)rig_run(&rig, begin + 36u * period + timeout_us * NS_PER_US);
    last = rig.peer.last_on_wire;
    TEST_ASSERT_NOT_EQUAL_UINT64(0, decided_at);
    decided = decided_at > last ? (uint32_t)((decided_at - last) / NS_PER_US) : 0u;
    result.decided_max = decided > result.decided_max ? decided : result.decided_max;
    for (unsigned command = 0; command < COMMANDS; command++) {
        uint32_t safe;

        TEST_ASSERT_NOT_EQUAL_UINT64_MESSAGE(0, safe_at[command], "a safe value was never sent");
        safe = safe_at[command] > last ? (uint32_t)((safe_at[command] - last) / NS_PER_US) : 0u;
        result.safe_max = safe > result.safe_max ? safe : result.safe_max;
    }
}

/** @return the place of the load in load_bounds */
static unsigned bounds_of(uint32_t per_mille)
{
    unsigned index = 0;

    while (load_bounds[index].per_mille != per_mille) {
        index++;
        TEST_ASSERT_LESS_THAN(sizeof load_bounds / sizeof load_bounds[0], index);
    }
    return index;
}

static void print_time(uint32_t us)
{
    if (us == BOUND_NONE) {
        printf("      none");
    } else {
        printf(" %6" PRIu32 " us", us);
    }
}

static void print_result(void)
{
    static bool is_printed;
    const unsigned bounds = bounds_of(given.per_mille);
    const uint32_t columns[] = {(uint32_t)(result.age_sum / (result.fresh != 0u ? result.fresh : 1u)),
                                result.age_max,
                                load_bounds[bounds].age,
                                result.wait_max[0],
                                load_bounds[bounds].wait[0],
                                result.wait_max[COMMANDS - 1],
                                load_bounds[bounds].wait[COMMANDS - 1],
                                result.decided_max,
                                result.safe_max,
                                load_bounds[bounds].safe};

    if (!is_printed) {
        printf("load mailboxes %10s%10s%10s%10s%10s%10s%10s%10s%10s%10s%8s%8s\n", "age mean", "age max", "bound",
               "wait 1", "bound", "wait n", "bound", "decided", "safe", "bound", "sent", "not");
    }
    is_printed = true;
    printf("%3" PRIu32 "%% %9u ", given.per_mille / 10u, given.mailboxes);
    for (unsigned index = 0; index < sizeof columns / sizeof columns[0]; index++) {
        print_time(columns[index]);
    }
    printf("%8" PRIu32 "%8" PRIu32 "\n", result.sent, result.expired);
}

static void measure(case_t what)
{
    given = what;
    result = (result_t){0};
    start(SEED, period_us * NS_PER_US / 3u);
    (void)rig_run(&rig, rig.world.now + SECONDS * NS_PER_S + period_us * NS_PER_US / 2u); /* not when a tick is due */
    result.sent = rig_counters(&rig).sent;
    result.expired = rig_counters(&rig).expired + rig_counters(&rig).replaced;
    /* Each is counted as one thing; what the stop could not get out in its time is in no counter yet. */
    TEST_ASSERT_UINT32_WITHIN(given.per_mille < 900u ? 0 : COMMANDS, (rig.loop.ticks + 1u) * (uint32_t)COMMANDS,
                              result.sent + result.expired);
    for (uint32_t index = 0; index < CUTS; index++) {
        run_cut(index);
    }
    print_result();
}

/** What holds at any load: nothing stale is fresh (checked in each tick), nothing old leaves, receivers see no gap. */
static void check_any_load(void)
{
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(timeout_us + period_us, result.decided_max);
    for (unsigned command = 0; command < COMMANDS; command++) {
        /* The frame that is on the wire at the deadline goes to its end. */
        TEST_ASSERT_LESS_OR_EQUAL_UINT32(TEST_APP.bus->tx[command].deadline + FRAME_US, result.wait_max[command]);
        TEST_ASSERT_EQUAL_UINT32(0, rig.peer.commands[command].refused);
    }
}

/** What the compiler says for this load, no more and no less: without a bound there is no promise. */
static void check_bounds(void)
{
    const unsigned bounds = bounds_of(given.per_mille);
    bool in_time = true;

    check_any_load();
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(load_bounds[bounds].age, result.age_max);
    for (unsigned command = 0; command < COMMANDS; command++) {
        TEST_ASSERT_LESS_OR_EQUAL_UINT32(load_bounds[bounds].wait[command], result.wait_max[command]);
        in_time = in_time && load_bounds[bounds].wait[command] <= TEST_APP.bus->tx[command].deadline;
    }
    if (in_time) {
        TEST_ASSERT_EQUAL_UINT32(0, result.expired);
        TEST_ASSERT_LESS_OR_EQUAL_UINT32(load_bounds[bounds].safe, result.safe_max);
    }
}

static void test_with(uint8_t mailboxes)
{
    static const uint32_t loads[] = {0, 300, 600, 900};

    for (unsigned index = 0; index < sizeof loads / sizeof loads[0]; index++) {
        measure((case_t){.per_mille = loads[index], .mailboxes = mailboxes});
        check_bounds();
    }
    if (COMMANDS >
        2) { /* at 90 % the six are more than the bus can carry: what leaves is in time, the rest is counted */
        TEST_ASSERT_GREATER_THAN_UINT32(0, result.expired);
    }
}

static void test_one_mailbox(void)
{
    test_with(1);
}

static void test_three_mailboxes(void)
{
    test_with(3);
}

/* Some of the others' frames are less urgent: one that is on the wire still goes to its end. */
static void test_mixed_priorities(void)
{
    measure((case_t){.per_mille = 600, .mailboxes = 1, .mixed = true});
    check_bounds();
}

/* The loop looks for free mailboxes as often as a frame takes, so others get in between; nothing old leaves for that. */
static void test_polled(void)
{
    measure((case_t){.per_mille = 600, .mailboxes = 3, .polled = true});
    check_any_load();
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(load_bounds[bounds_of(600)].age, result.age_max);
    measure((case_t){.per_mille = 900, .mailboxes = 1, .polled = true});
    check_any_load();
}

int main(void)
{
    period_us = (uint32_t)TEST_APP.period;
    timeout_us = (uint32_t)TEST_APP.bus->rx[TEST_APP.bus->rx_count - 1u].timeout; /* all have the same */
    printf("%s, %s; seeds %d, and of the cuts %d to %d\n", TEST_APP.name, TEST_RECEIVED, SEED, CUT_SEED,
           CUT_SEED + CUTS - 1);
    UNITY_BEGIN();
    RUN_TEST(test_one_mailbox);
    RUN_TEST(test_three_mailboxes);
    RUN_TEST(test_mixed_priorities);
    RUN_TEST(test_polled);
    return UNITY_END();
}
