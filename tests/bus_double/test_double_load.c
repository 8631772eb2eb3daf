/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Six commands at 10 ms on a bus on which others take 0, 30, 60 and 90 %, mostly all of higher priority: how old the reading is
 * that a leaf sees, how long commands wait, and how long it takes to the safe value when the sensor is cut. Measured,
 * printed, and compared with what is promised and with the compiler's bounds.
 */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "rig.h"
#include "six/probe.h"
#include "six_app.h"
#include "six_bounds.h"
#include "unity.h"

enum {
    COMMANDS = 6,
    BURST = 10,
    BIT_NS = 1000000000 / RIG_BIT_RATE,
    COMMAND_BITS = 125,  /* 7 bytes, 11-bit id, most stuff bits */
    LATENCY_US = 10,     /* CONTROLLER_COMMON: from a cause to its interrupt */
    TIMEOUT_US = 50000,  /* six.dbc */
    PERIOD_US = 10000,
    DEADLINE_US = 10000, /* the cycle time of each command */
    CUTS = 40
};

/** What is measured. */
typedef struct {
    uint32_t per_mille;
    uint8_t mailboxes;
    bool mixed; /* half of the others' frames have a lower priority; else all have a higher one */
} case_t;

/** What one load does to an application. All times in us. */
typedef struct {
    uint32_t age_max;   /* at the tick, since the end of the frame on the wire */
    uint64_t age_sum;
    uint32_t fresh;     /* ticks in which it was, before the cut */
    uint32_t wait_max[COMMANDS]; /* from the tick to the end of the command's frame */
    uint32_t expired; /* or replaced */
    uint32_t sent;
    uint32_t decided_max; /* from the end of the last reading to the tick that decides for the safe values */
    uint32_t safe_max;    /* and to the end of the last of the six frames that bring them */
} result_t;

static rig_t rig;
static case_t given;
static result_t result;
static nanoseconds_t cut_at;
static nanoseconds_t decided_at;
static nanoseconds_t safe_at[COMMANDS];

void setUp(void)
{
}

void tearDown(void)
{
}

static uint32_t us_since(nanoseconds_t from)
{
    return (uint32_t)((rig.world.now - from + NS_PER_US - 1u) / NS_PER_US);
}

static void see(rig_t *self, const canopy_can_frame_t *frame, nanoseconds_t end)
{
    int command = rig_command_of(self, frame);
    uint32_t stamp = (uint32_t)frame->data[2] | ((uint32_t)frame->data[3] << 8) | ((uint32_t)frame->data[4] << 16) |
                     ((uint32_t)frame->data[5] << 24);
    uint32_t wait;

    if (command < 0) {
        return;
    }
    if (frame->data[6] == 0u && end > cut_at && safe_at[command] == 0u) {
        safe_at[command] = end;
    }
    if (stamp != 0u) { /* else it is of the stop */
        wait = us_since((nanoseconds_t)stamp * NS_PER_US);
        result.wait_max[command] = wait > result.wait_max[command] ? wait : result.wait_max[command];
    }
}

/** After a tick: is what the leaf was told true? */
static void after(rig_t *self)
{
    nanoseconds_t tick = six_probe.now * NS_PER_US;
    uint32_t age;

    if (!six_probe.fresh) {
        TEST_ASSERT_EQUAL_UINT16(CANOPY_AGE_MAX, six_probe.age_ms);
        decided_at = decided_at == 0u && tick > cut_at ? tick : decided_at;
        return;
    }
    age = (uint32_t)((tick - self->peer.on_wire_at[six_probe.number % (unsigned)PEER_NUMBERS]) / NS_PER_US);
    TEST_ASSERT_LESS_THAN_UINT32_MESSAGE(TIMEOUT_US, age, "old data was called fresh");
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32_MESSAGE(age, six_probe.age_ms * 1000u, "data is older than the leaf was told");
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(age + 2000u, six_probe.age_ms * 1000u); /* rounded up, once or twice */
    if (tick <= cut_at) {
        result.fresh++;
        result.age_max = age > result.age_max ? age : result.age_max;
        result.age_sum += age;
    }
}

static void start(uint32_t seed, nanoseconds_t phase)
{
    const rig_options_t options = {.app = &six_app,
                                   .mailboxes = given.mailboxes,
                                   .peer_phase = phase,
                                   .traffic = {.seed = seed,
                                               .per_mille = given.per_mille,
                                               .burst = BURST,
                                               .lowest_id = 0x001,
                                               .highest_id = 0x0FF,
                                               .mixed = given.mixed}};

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
    actor_t cutter;
    nanoseconds_t last;
    uint32_t decided;

    start(1000u + index, (index * 7u % 10u) * NS_PER_MS + index * 13u * NS_PER_US);
    world_at(&rig.world, &cutter, rig.world.now + 300u * NS_PER_MS + index * (NS_PER_MS / 4u), cut, NULL);
    (void)rig_run(&rig, rig.world.now + 500u * NS_PER_MS);
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

/** @return the place of the load in six_bounds */
static unsigned bounds_of(uint32_t per_mille)
{
    unsigned index = 0;

    while (six_bounds[index].per_mille != per_mille) {
        index++;
        TEST_ASSERT_LESS_THAN(sizeof six_bounds / sizeof six_bounds[0], index);
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
                                six_bounds[bounds].age,
                                result.wait_max[0],
                                six_bounds[bounds].wait[0],
                                result.wait_max[COMMANDS - 1],
                                six_bounds[bounds].wait[COMMANDS - 1],
                                result.decided_max,
                                result.safe_max,
                                six_bounds[bounds].safe};

    if (!is_printed) {
        printf("load mailboxes %10s%10s%10s%10s%10s%10s%10s%10s%10s%10s%8s%8s\n", "age mean", "age max", "bound", "wait 1", "bound",
               "wait 6", "bound", "decided", "safe", "bound", "sent", "not");
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
    start(42, 3u * NS_PER_MS);
    (void)rig_run(&rig, rig.world.now + 20u * NS_PER_S + 5u * NS_PER_MS); /* not when a tick is due */
    result.sent = rig_counters(&rig).sent;
    result.expired = rig_counters(&rig).expired + rig_counters(&rig).replaced;
    /* Each is counted as one thing; what the stop could not get out in its time is in no counter yet. */
    TEST_ASSERT_UINT32_WITHIN(given.per_mille < 900u ? 0 : COMMANDS, (rig.loop.ticks + 1u) * COMMANDS,
                              result.sent + result.expired);
    for (uint32_t index = 0; index < CUTS; index++) {
        run_cut(index);
    }
    print_result();
}

/** What holds at any load: nothing stale is fresh (checked in each tick), nothing old leaves, receivers see no gap. */
static void check_any_load(void)
{
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(TIMEOUT_US + PERIOD_US, result.decided_max);
    for (unsigned command = 0; command < COMMANDS; command++) {
        /* The frame that is on the wire at the deadline goes to its end. */
        TEST_ASSERT_LESS_OR_EQUAL_UINT32(DEADLINE_US + COMMAND_BITS * BIT_NS / 1000 + LATENCY_US,
                                         result.wait_max[command]);
        TEST_ASSERT_EQUAL_UINT32(0, rig.peer.commands[command].refused);
    }
}

/** What the compiler says for this load, no more and no less: without a bound there is no promise. */
static void check_bounds(void)
{
    const unsigned bounds = bounds_of(given.per_mille);
    bool in_time = true;

    check_any_load();
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(six_bounds[bounds].age, result.age_max);
    for (unsigned command = 0; command < COMMANDS; command++) {
        TEST_ASSERT_LESS_OR_EQUAL_UINT32(six_bounds[bounds].wait[command], result.wait_max[command]);
        in_time = in_time && six_bounds[bounds].wait[command] <= DEADLINE_US;
    }
    if (in_time) {
        TEST_ASSERT_EQUAL_UINT32(0, result.expired);
        TEST_ASSERT_LESS_OR_EQUAL_UINT32(six_bounds[bounds].safe, result.safe_max);
    }
}

static void test_with(uint8_t mailboxes)
{
    static const uint32_t loads[] = {0, 300, 600, 900};

    for (unsigned index = 0; index < sizeof loads / sizeof loads[0]; index++) {
        measure((case_t){.per_mille = loads[index], .mailboxes = mailboxes});
        check_bounds();
    }
    /* At 90 % more is asked for than the bus can carry: what leaves is in time, and the rest is counted. */
    TEST_ASSERT_GREATER_THAN_UINT32(0, result.expired);
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

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_one_mailbox);
    RUN_TEST(test_three_mailboxes);
    RUN_TEST(test_mixed_priorities);
    return UNITY_END();
}
