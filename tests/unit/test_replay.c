/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A replay from memory: which frames a tick gets, when time moves, when it ends; and a run of nao_home that is recorded on
 * its bus and replayed bit for bit, on a target too.
 */
#include "canopy/clock/replay.h"

#include <string.h>

#include "in_process.h"
#include "nao_home_app.h"
#include "unity.h"

enum { SENSOR_ID = 0x100, FRAMES_MAX = 340, TICKS = 30 };

/* A record in memory, and what was sent. */
static struct {
    canopy_replay_item_t record[FRAMES_MAX];
    unsigned length;
    unsigned next;
    int end; /* what read says behind the last frame */
    canopy_can_frame_t sent[FRAMES_MAX];
    unsigned sent_count;
    int write_result;
} tape;

static canopy_replay_t replay;

static int read_tape(void *context, canopy_replay_item_t *item)
{
    TEST_ASSERT_EQUAL_PTR(&tape, context);
    if (tape.next == tape.length) {
        return tape.end;
    }
    *item = tape.record[tape.next++];
    return 1;
}

static int write_tape(void *context, const canopy_can_frame_t *frame)
{
    TEST_ASSERT_EQUAL_PTR(&tape, context);
    TEST_ASSERT_LESS_THAN_UINT(FRAMES_MAX, tape.sent_count);
    tape.sent[tape.sent_count++] = *frame;
    return tape.write_result;
}

static const canopy_replay_io_t io = {.context = &tape, .read = read_tape, .write = write_tape};

void setUp(void)
{
    tape.length = 0;
    tape.next = 0;
    tape.end = 0;
    tape.sent_count = 0;
    tape.write_result = 1;
}

void tearDown(void)
{
}

static void put(canopy_replay_item_t item)
{
    TEST_ASSERT_LESS_THAN_UINT(FRAMES_MAX, tape.length);
    tape.record[tape.length++] = item;
}

static void put_tick(canopy_time_t now)
{
    put((canopy_replay_item_t){.is_tick = true, .now = now});
}

static void put_old_sensor(uint8_t value, uint16_t age_ms)
{
    put((canopy_replay_item_t){.age = age_ms, .frame = {.id = SENSOR_ID, .length = 1, .data = {value}}});
}

static void put_sensor(uint8_t value)
{
    put_old_sensor(value, 0);
}

static canopy_time_t now(void)
{
    return replay.clock.now(replay.clock.context);
}

static bool wait_until(canopy_time_t deadline)
{
    return replay.clock.wait_until(replay.clock.context, deadline);
}

static void expect_sensor(uint8_t value)
{
    canopy_can_frame_t frame;

    TEST_ASSERT_EQUAL(1, replay.can.receive(replay.can.context, &frame));
    TEST_ASSERT_EQUAL_HEX32(SENSOR_ID, frame.id);
    TEST_ASSERT_EQUAL_UINT8(value, frame.data[0]);
}

static void expect_no_frame(void)
{
    canopy_can_frame_t frame;

    TEST_ASSERT_EQUAL(0, replay.can.receive(replay.can.context, &frame));
}

static void a_tick_gets_its_frames_at_its_time(void)
{
    canopy_can_stats_t stats;

    put_tick(UINT64_C(0xA1A2A3A4A5A6));
    put_sensor(1);
    put_sensor(2);
    put_tick(UINT64_C(0xA1A2A3A4A5A7));
    put_tick(UINT64_C(0xA1A2A3A4FFFF));
    put_sensor(3);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_replay_init(&replay, &io));
    TEST_ASSERT_TRUE(now() == UINT64_C(0xA1A2A3A4A5A6)); /* the loop's first deadline */
    expect_no_frame();
    TEST_ASSERT_TRUE(wait_until(now()));
    TEST_ASSERT_TRUE(now() == UINT64_C(0xA1A2A3A4A5A6));
    expect_sensor(1);
    expect_sensor(2);
    expect_no_frame();
    expect_no_frame();
    TEST_ASSERT_TRUE(wait_until(0)); /* whatever the deadline */
    TEST_ASSERT_TRUE(now() == UINT64_C(0xA1A2A3A4A5A7));
    expect_no_frame();
    TEST_ASSERT_TRUE(wait_until(UINT64_MAX));
    TEST_ASSERT_TRUE(now() == UINT64_C(0xA1A2A3A4FFFF));
    expect_sensor(3);
    expect_no_frame();
    TEST_ASSERT_FALSE(wait_until(0));
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_replay_error(&replay));
    replay.can.stats(replay.can.context, &stats);
    TEST_ASSERT_EQUAL_UINT32(3, stats.received);
    TEST_ASSERT_EQUAL_UINT32(0, stats.rx_dropped);
    TEST_ASSERT_NULL(replay.can.wait);
}

static void what_a_tick_does_not_take_is_not_for_the_next(void)
{
    canopy_can_stats_t stats;

    put_tick(1);
    put_sensor(1);
    put_sensor(2);
    put_tick(2);
    put_sensor(3);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_replay_init(&replay, &io));
    TEST_ASSERT_TRUE(wait_until(0));
    expect_sensor(1);
    TEST_ASSERT_TRUE(wait_until(0));
    expect_sensor(3);
    replay.can.stats(replay.can.context, &stats);
    TEST_ASSERT_EQUAL_UINT32(1, stats.rx_dropped);
}

static canopy_time_t take_time(void)
{
    canopy_can_frame_t frame;

    TEST_ASSERT_EQUAL(1, replay.can.receive(replay.can.context, &frame));
    return frame.time;
}

static void expect_conditions(unsigned can_state, bool overload, bool returning)
{
    canopy_can_conditions_t conditions;

    replay.can.conditions(replay.can.context, &conditions);
    TEST_ASSERT_EQUAL_UINT(can_state, conditions.can_state);
    TEST_ASSERT_EQUAL(overload, conditions.overload);
    TEST_ASSERT_EQUAL(returning, conditions.returning);
}

static void each_frame_is_as_old_as_it_was(void)
{
    put_tick(1000000);
    put_sensor(1);
    put_old_sensor(2, 7);
    put_old_sensor(3, UINT16_MAX);
    put_tick(2000000);
    put_sensor(5);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_replay_init(&replay, &io));
    TEST_ASSERT_TRUE(wait_until(0));
    TEST_ASSERT_TRUE(take_time() == 1000000);
    TEST_ASSERT_TRUE(take_time() == 993000);
    TEST_ASSERT_TRUE(take_time() == UINT64_C(1000000) - UINT64_C(65535000));
    expect_no_frame();
    TEST_ASSERT_TRUE(wait_until(0));
    TEST_ASSERT_TRUE(take_time() == 2000000);
}

static void the_bus_is_in_the_state_in_which_it_was(void)
{
    put((canopy_replay_item_t){.is_tick = true, .now = 1});
    put((canopy_replay_item_t){
        .is_tick = true, .now = 2, .conditions = {.can_state = CANOPY_CAN_BUS_OFF, .returning = true}});
    put_sensor(1);
    put((canopy_replay_item_t){
        .is_tick = true, .now = 3, .conditions = {.can_state = CANOPY_CAN_BLOCKED, .overload = true}});
    put_tick(4);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_replay_init(&replay, &io));
    TEST_ASSERT_TRUE(wait_until(0));
    expect_conditions(CANOPY_CAN_ERROR_ACTIVE, false, false);
    TEST_ASSERT_TRUE(wait_until(0));
    expect_conditions(CANOPY_CAN_BUS_OFF, false, true); /* also when the loop has not asked for a frame */
    expect_sensor(1);
    expect_no_frame();
    expect_conditions(CANOPY_CAN_BUS_OFF, false, true);
    TEST_ASSERT_TRUE(wait_until(0));
    expect_conditions(CANOPY_CAN_BLOCKED, true, false);
    TEST_ASSERT_TRUE(wait_until(0));
    expect_conditions(CANOPY_CAN_ERROR_ACTIVE, false, false);
    TEST_ASSERT_FALSE(wait_until(0));
}

static void what_cannot_be_replayed_is_refused(void)
{
    const canopy_replay_io_t nothing = {.context = &tape};

    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_replay_init(NULL, &io));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_replay_init(&replay, NULL));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_replay_init(&replay, &nothing));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_NOT_FOUND, canopy_replay_init(&replay, &io)); /* empty */
    put_sensor(1);
    TEST_ASSERT_EQUAL(CANOPY_ERROR_NOT_FOUND, canopy_replay_init(&replay, &io));
    tape.end = CANOPY_ERROR_IO;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_IO, canopy_replay_init(&replay, &io));
}

static void an_error_ends_the_replay_and_is_told(void)
{
    const canopy_can_frame_t frame = {.id = 1};
    canopy_can_stats_t stats;

    put_tick(1);
    put_tick(2);
    tape.end = CANOPY_ERROR_IO;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_replay_init(&replay, &io));
    TEST_ASSERT_TRUE(wait_until(0));
    TEST_ASSERT_EQUAL(1, replay.can.send(replay.can.context, 0, &frame));
    TEST_ASSERT_TRUE(wait_until(0));
    expect_no_frame();
    TEST_ASSERT_FALSE(wait_until(0));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_IO, canopy_replay_error(&replay));

    setUp();
    put_tick(1);
    put_tick(2);
    tape.write_result = CANOPY_ERROR_BUS_DOWN;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_replay_init(&replay, &io));
    TEST_ASSERT_TRUE(wait_until(0));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_BUS_DOWN, replay.can.send(replay.can.context, 0, &frame));
    TEST_ASSERT_FALSE(wait_until(0));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_BUS_DOWN, canopy_replay_error(&replay));
    replay.can.stats(replay.can.context, &stats);
    TEST_ASSERT_EQUAL_UINT32(0, stats.sent);
    TEST_ASSERT_EQUAL_UINT32(1, stats.tx_dropped);
}

static void nobody_need_look_at_what_is_sent(void)
{
    const canopy_replay_io_t deaf = {.context = &tape, .read = read_tape};
    const canopy_can_frame_t frame = {.id = 1};

    put_tick(1);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_replay_init(&replay, &deaf));
    TEST_ASSERT_EQUAL(1, replay.can.send(replay.can.context, 0, &frame));
    TEST_ASSERT_EQUAL_UINT(0, tape.sent_count);
}

/* --- nao_home, recorded on its bus ---------------------------------------------------------------------------------- */

static nao_in_process_t run;
static canopy_can_frame_t recorded[FRAMES_MAX];

static canopy_can_frame_t taken[4]; /* of the tick at hand */
static unsigned taken_count;

/** Puts a tick and its frames on the tape, from its CanopyInputs: two ages have room in there, in the table's order. */
static void put_taken(const canopy_can_frame_t *inputs)
{
    const uint8_t *ages = &inputs->data[6];
    unsigned bytes = ((unsigned)inputs->data[5] >> 5) & 3u;
    bool both = bytes == 2u;
    canopy_time_t low =
        inputs->data[0] | ((canopy_time_t)inputs->data[1] << 8) | ((canopy_time_t)inputs->data[2] << 16);

    TEST_ASSERT_LESS_THAN_UINT(3, bytes);
    put((canopy_replay_item_t){.is_tick = true,
                               .now = run.host.now - ((run.host.now - low) & 0xFFFFFFu),
                               .conditions = {.can_state = inputs->data[5] & 7u,
                                              .overload = (inputs->data[5] & 0x08u) != 0,
                                              .returning = (inputs->data[5] & 0x10u) != 0}});
    for (unsigned place = 0; place < taken_count; place++) {
        unsigned index = both && taken[place].id == nao_home_bus.rx[1].id ? 1u : 0u;

        put((canopy_replay_item_t){.age = ages[index], .frame = taken[place]});
    }
    taken_count = 0;
}

/** One cycle of the mission with a silent spell, late and once so late that its messages are stale. */
static void run_mission(unsigned tick)
{
    run.host.now += tick % 3u == 1u ? 777u : 0u;
    run.host.now += tick == 6u ? 600000u : 0u;
    run.nao.age = (canopy_time_t)(tick % 4u) * 1300u;
    if (tick == 6u) {
        (void)canopy_loop_cycle(&run.host.loop, run.host.now); /* the robot is silent */
        run.host.now += 50000u;
    } else {
        (void)nao_in_process_tick(&run);
    }
}

static unsigned kept;

/** Puts what came in on the tape, and keeps what went out. */
static void record(void *context, const canopy_can_frame_t *frame)
{
    (void)context;
    if (frame->id == nao_home_bus.rx[0].id || frame->id == nao_home_bus.rx[1].id) {
        TEST_ASSERT_LESS_THAN_UINT(4, taken_count);
        taken[taken_count++] = *frame;
        return;
    }
    TEST_ASSERT_LESS_THAN_UINT(FRAMES_MAX, kept);
    recorded[kept++] = *frame;
    if (frame->id == nao_home_app.trace->id + CANOPY_TRACE_INPUTS) {
        put_taken(frame);
    }
}

static void record_the_mission(void)
{
    TEST_ASSERT_EQUAL(CANOPY_OK, nao_in_process_init(&run, &nao_home_app));
    TEST_ASSERT_TRUE(canopy_sim_posture_set(&run.nao.robot.posture, 500, 0));
    kept = 0;
    run.host.tap = record;
    run.host.now = UINT64_C(123456789);
    for (unsigned tick = 0; tick < (unsigned)TICKS; tick++) {
        run_mission(tick);
    }
}

static void a_recorded_run_is_replayed_bit_for_bit(void)
{
    static canopy_loop_t loop;
    static canopy_loop_config_t config;

    record_the_mission();
    TEST_ASSERT_EQUAL_UINT32(1, nao_home_app.bus_state->counters.timeouts / 2u); /* both messages, once */
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_replay_init(&replay, &io));
    config = (canopy_loop_config_t){.app = &nao_home_app, .can = &replay.can, .clock = &replay.clock};
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &config));
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_run(&loop));
    TEST_ASSERT_EQUAL_UINT32(TICKS, loop.ticks);
    TEST_ASSERT_EQUAL_UINT(kept + 2u, tape.sent_count); /* the safe commands at the end */
    for (unsigned frame = 0; frame < kept; frame++) {
        TEST_ASSERT_EQUAL_HEX32(recorded[frame].id, tape.sent[frame].id);
        TEST_ASSERT_EQUAL_UINT8(recorded[frame].length, tape.sent[frame].length);
        if (recorded[frame].id == nao_home_app.trace->id) {
            TEST_ASSERT_EQUAL_HEX8(recorded[frame].data[7] & 0x3Fu, tape.sent[frame].data[7] & 0x3Fu);
            tape.sent[frame].data[7] = recorded[frame].data[7]; /* Overruns: a replay's clock measures nothing */
        }
        if (recorded[frame].id == nao_home_app.trace->id + CANOPY_TRACE_HEALTH) {
            continue; /* so with the longest cycle, and what the driver counts */
        }
        TEST_ASSERT_EQUAL_HEX8_ARRAY(recorded[frame].data, tape.sent[frame].data, recorded[frame].length);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_tick_gets_its_frames_at_its_time);
    RUN_TEST(what_a_tick_does_not_take_is_not_for_the_next);
    RUN_TEST(each_frame_is_as_old_as_it_was);
    RUN_TEST(the_bus_is_in_the_state_in_which_it_was);
    RUN_TEST(what_cannot_be_replayed_is_refused);
    RUN_TEST(an_error_ends_the_replay_and_is_told);
    RUN_TEST(nobody_need_look_at_what_is_sent);
    RUN_TEST(a_recorded_run_is_replayed_bit_for_bit);
    return UNITY_END();
}
