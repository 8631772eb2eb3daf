/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The Big BT with its robot in one program: people do to it what they like, and every action that was RUNNING is halted or
 * completes, once; an action that is not RUNNING is never halted, nor gone on with.
 *
 * Between the engine and the leaves stands a table of functions of its own, which keeps the books.
 */
#include "big_world.h"
#include "nao_big_app.h"
#include "unity.h"

/* The emulated target, which is slower, takes a shorter mission. */
#ifdef __arm__
enum { TICKS = 20000 };
#else
enum { TICKS = 200000 };
#endif
enum { KINDS_MAX = 32, USES_MAX = 8, PEOPLE_EVERY = 300 };

static big_world_t big;
static canopy_in_process_t host;
static canopy_in_process_sensor_t sensors[BIG_SENSORS];
static canopy_app_t app;
static canopy_tree_t tree;
static canopy_leaf_t leaves[KINDS_MAX];
static const canopy_leaf_t *inner;

static bool is_running[KINDS_MAX][USES_MAX];
static uint32_t begun, completed, halted, wrong;

static void note(bool is_right)
{
    wrong += is_right ? 0u : 1u;
}

static canopy_status_t account(unsigned kind, uint16_t use, bool was_running, canopy_status_t status)
{
    bool runs = status == CANOPY_RUNNING;

    if (use >= (uint16_t)USES_MAX) {
        wrong++;
        return status;
    }
    note(is_running[kind][use] == was_running);
    begun += runs && !was_running ? 1u : 0u;
    completed += !runs && was_running ? 1u : 0u;
    is_running[kind][use] = runs;
    return status;
}

static void account_halt(unsigned kind, uint16_t use)
{
    halted++;
    if (use >= (uint16_t)USES_MAX) {
        wrong++;
        return;
    }
    note(is_running[kind][use]);
    is_running[kind][use] = false;
}

#define KIND(n)                                                           \
    static canopy_status_t tick_##n(void *application, uint16_t use)      \
    {                                                                     \
        return account(n, use, false, inner[n].tick(application, use));   \
    }                                                                     \
    static canopy_status_t running_##n(void *application, uint16_t use)   \
    {                                                                     \
        return account(n, use, true, inner[n].running(application, use)); \
    }                                                                     \
    static void halted_##n(void *application, uint16_t use)               \
    {                                                                     \
        account_halt(n, use);                                             \
        inner[n].halted(application, use);                                \
    }
#define FIRST(X) X(0) X(1) X(2) X(3) X(4) X(5) X(6) X(7) X(8) X(9) X(10) X(11) X(12) X(13) X(14) X(15)
#define SECOND(X) X(16) X(17) X(18) X(19) X(20) X(21) X(22) X(23) X(24) X(25) X(26) X(27) X(28) X(29) X(30) X(31)
FIRST(KIND)
SECOND(KIND)
#define ENTRY(n) {.tick = tick_##n, .running = running_##n, .halted = halted_##n},
static const canopy_leaf_t books[KINDS_MAX] = {FIRST(ENTRY) SECOND(ENTRY)};

/** The application, with the books between its tree and its leaves. */
static void start(canopy_sim_profile_t profile)
{
    app = nao_big_app;
    tree = *nao_big_app.tree;
    inner = tree.leaves;
    TEST_ASSERT_LESS_OR_EQUAL_UINT16(KINDS_MAX, tree.leaf_count);
    for (unsigned kind = 0; kind < tree.leaf_count; kind++) {
        bool is_action = inner[kind].running != NULL;

        leaves[kind] = (canopy_leaf_t){.tick = is_action ? books[kind].tick : inner[kind].tick,
                                       .running = is_action ? books[kind].running : NULL,
                                       .halted = is_action ? books[kind].halted : NULL};
        for (unsigned use = 0; use < (unsigned)USES_MAX; use++) {
            is_running[kind][use] = false;
        }
    }
    tree.leaves = leaves;
    app.tree = &tree;
    begun = completed = halted = wrong = 0;
    TEST_ASSERT_EQUAL(
        CANOPY_OK, canopy_in_process_init(&host, &app, sensors, BIG_SENSORS, big_world_init(&big, profile, 1), false));
}

void setUp(void)
{
}

void tearDown(void)
{
}

/** @return actions that are RUNNING. */
static uint32_t count_running(void)
{
    uint32_t count = 0;

    for (unsigned kind = 0; kind < (unsigned)KINDS_MAX; kind++) {
        for (unsigned use = 0; use < (unsigned)USES_MAX; use++) {
            count += is_running[kind][use] ? 1u : 0u;
        }
    }
    return count;
}

static void run_mission(canopy_sim_profile_t profile)
{
    start(profile);
    big.people = UINT32_MAX;
    big.people_every = PEOPLE_EVERY;
    TEST_ASSERT_EQUAL_UINT64(TICKS, canopy_in_process_run(&host, TICKS, 0));
    TEST_ASSERT_GREATER_THAN_UINT32(TICKS / 2000, begun);
    TEST_ASSERT_GREATER_THAN_UINT32(0, completed);
    TEST_ASSERT_GREATER_THAN_UINT32(0, halted);
    TEST_ASSERT_EQUAL_UINT32(begun, completed + halted + count_running());
    canopy_tree_halt(app.tree_instance);
    TEST_ASSERT_EQUAL_UINT32(0, count_running());
    TEST_ASSERT_EQUAL_UINT32(begun, completed + halted);
    TEST_ASSERT_EQUAL_UINT32(0, wrong);
    TEST_ASSERT_EQUAL_UINT32(0, app.tree_instance->faults);
    TEST_ASSERT_EQUAL_UINT32(0, canopy_bus_rejected(&app.bus_state->counters));
}

static void every_running_action_ends_once_in_the_profile_nao(void)
{
    run_mission(CANOPY_SIM_PROFILE_NAO);
}

static void every_running_action_ends_once_in_the_profile_paper(void)
{
    run_mission(CANOPY_SIM_PROFILE_PAPER);
}

static void without_sensors_it_commands_nothing(void)
{
    start(CANOPY_SIM_PROFILE_NAO);
    TEST_ASSERT_EQUAL_UINT64(100, canopy_in_process_run(&host, 100, 0));
    TEST_ASSERT_EQUAL(CANOPY_SIM_SAY_WHAT_TO_DO, big.command.say);
    for (unsigned cycle = 0; cycle < 60u; cycle++) { /* 600 ms: every timeout is over */
        (void)canopy_loop_cycle(&host.loop, host.now);
        host.now += app.period;
    }
    TEST_ASSERT_EQUAL(NAO_BIG_UPPER_COMMAND_SAY_NOTHING, nao_big_output->upper_command.say);
    TEST_ASSERT_EQUAL(NAO_BIG_POWER_COMMAND_MODE_STOP, nao_big_output->power_command.mode);
    TEST_ASSERT_EQUAL(NAO_BIG_POSTURE_COMMAND_MODE_STOP, nao_big_output->posture_command.mode);
    TEST_ASSERT_EQUAL_UINT32(0, count_running());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(every_running_action_ends_once_in_the_profile_nao);
    RUN_TEST(every_running_action_ends_once_in_the_profile_paper);
    RUN_TEST(without_sensors_it_commands_nothing);
    return UNITY_END();
}
