/* SPDX-License-Identifier: MIT */
/** @file Parameter groups of J1939: messages of whose id only a part counts, and broadcasts of several packets. */
#include "canopy/transport.h"

#include <string.h>

#include "canopy/bus.h"
#include "unity.h"

#define ANY_SOURCE UINT32_C(0x03FFFF00)
#define ONE_SOURCE UINT32_C(0x03FFFFFF)
#define ANNOUNCEMENT UINT32_C(0x1CECFF00)
#define PACKET UINT32_C(0x1CEBFF00)

/* Parameter groups: 61444 (EEC1), 65226 (DM1, several packets), 65260 (VI), and 61184, which has a destination. */
enum { EEC1 = 0xF004, DM1 = 0xFECA, VI = 0xFEEC, PROPRIETARY = 0xEF00, ENGINE = 0x00, BRAKES = 0x0B, ECU = 0x21 };
enum { EXACT, PLAIN, FROM_BRAKES, FROM_ANY, LONG, LONGER, FOR_US, MESSAGES };
enum { LONG_BYTES = 20, LONGER_BYTES = 14 };

static uint8_t taken[MESSAGES];
static uint8_t bytes[64];
static uint16_t age[MESSAGES];
static canopy_rx_state_t states[MESSAGES];
static canopy_transport_state_t transport_states[3];
static uint8_t transport_data[LONG_BYTES + LONGER_BYTES + 9];
static canopy_bus_state_t bus;

#define DECODER(name, place, length)                                 \
    static bool decode_##name(void *input, const uint8_t *data)      \
    {                                                                \
        (void)input;                                                 \
        taken[place]++;                                              \
        memcpy(bytes, data, length);                                 \
        return data[0] != 0xEEu;                                     \
    }                                                                \
    static void age_##name(void *input, bool fresh, uint16_t age_ms) \
    {                                                                \
        (void)input;                                                 \
        (void)fresh;                                                 \
        age[place] = age_ms;                                         \
    }
DECODER(exact, EXACT, 8)
DECODER(plain, PLAIN, 2)
DECODER(brakes, FROM_BRAKES, 8)
DECODER(any, FROM_ANY, 8)
DECODER(long, LONG, LONG_BYTES)
DECODER(longer, LONGER, LONGER_BYTES)
DECODER(us, FOR_US, 9)

#define MESSAGE(number, bits, size, name) \
    {.id = (number),                      \
     .mask = (bits),                      \
     .length = (size),                    \
     .flags = CANOPY_CAN_EXTENDED,        \
     .data_id = CANOPY_E2E_NONE,          \
     .decode = decode_##name,             \
     .set_age = age_##name}

static const canopy_rx_message_t rx[MESSAGES] = {
    {.id = 0x100, .length = 2, .more = 3, .data_id = CANOPY_E2E_NONE, .decode = decode_plain, .set_age = age_plain},
    MESSAGE(((uint32_t)3 << 26) | ((uint32_t)EEC1 << 8) | ENGINE, 0, 8, exact),
    MESSAGE(((uint32_t)EEC1 << 8) | BRAKES, ONE_SOURCE, 8, brakes),
    MESSAGE((uint32_t)EEC1 << 8, ANY_SOURCE, 8, any),
    MESSAGE((uint32_t)DM1 << 8, ANY_SOURCE, LONG_BYTES, long),
    MESSAGE((uint32_t)VI << 8, ANY_SOURCE, LONGER_BYTES, longer),
    MESSAGE((uint32_t)PROPRIETARY << 8, UINT32_C(0x03FF0000), 9, us),
};
static const canopy_transport_t transports[] = {{4, 0}, {5, LONG_BYTES}, {6, LONG_BYTES + LONGER_BYTES}};
static const canopy_bus_t tables = {
    .rx = rx, .transports = transports, .rx_count = MESSAGES, .rx_masked = MESSAGES - 2, .transport_count = 3};
static const canopy_bus_t no_transports = {.rx = rx, .rx_count = MESSAGES, .rx_masked = MESSAGES - 2};
static const canopy_bus_t exact_only = {.rx = rx, .rx_count = 2};

void setUp(void)
{
    memset(taken, 0, sizeof taken);
    memset(bytes, 0, sizeof bytes);
    memset(states, 0, sizeof states);
    memset(transport_states, 0, sizeof transport_states);
    memset(transport_data, 0xA5, sizeof transport_data);
    bus = (canopy_bus_state_t){
        .bus = &tables, .rx = states, .transports = transport_states, .transport_data = transport_data};
}

void tearDown(void)
{
}

static void receive(uint32_t id, const uint8_t *data, uint8_t length, canopy_time_t time)
{
    canopy_can_frame_t frame = {.time = time, .id = id, .flags = CANOPY_CAN_EXTENDED, .length = length};

    memcpy(frame.data, data, length);
    canopy_bus_receive(&bus, &frame, time);
}

static void receive_group(unsigned priority, uint32_t group, uint8_t source)
{
    static const uint8_t data[8] = {1};

    receive((priority << 26) | (group << 8) | source, data, 8, 0);
}

static void announce(uint32_t group, uint8_t source, uint16_t size, canopy_time_t time)
{
    const uint8_t data[8] = {32,
                             (uint8_t)(size & 0xFFu),
                             (uint8_t)(size >> 8),
                             (uint8_t)((size + 6u) / 7u),
                             0xFF,
                             (uint8_t)(group & 0xFFu),
                             (uint8_t)((group >> 8) & 0xFFu),
                             (uint8_t)(group >> 16)};

    receive(ANNOUNCEMENT | source, data, 8, time);
}

/** Packet `number` of a content that counts up from 1. */
static void packet(uint8_t source, uint8_t number, canopy_time_t time)
{
    uint8_t data[8] = {number};

    for (uint8_t byte = 1; byte < 8u; byte++) {
        data[byte] = (uint8_t)(7u * (number - 1u) + byte);
    }
    receive(PACKET | source, data, 8, time);
}

static void a_group_is_taken_whatever_its_priority_and_source(void)
{
    for (unsigned priority = 0; priority < 8u; priority++) {
        receive_group(priority, EEC1, (uint8_t)(priority * 31u + 1u));
    }
    TEST_ASSERT_EQUAL_UINT8(8, taken[FROM_ANY]);
    TEST_ASSERT_EQUAL_UINT32(8, bus.counters.accepted);
    receive_group(3, EEC1 + 1, ECU);
    receive_group(3, EEC1 + 0x10000, ECU); /* the other data page */
    TEST_ASSERT_EQUAL_UINT32(2, bus.counters.unknown_id);
}

static void what_is_told_more_closely_comes_first(void)
{
    receive_group(3, EEC1, ENGINE); /* every bit of the id */
    receive_group(6, EEC1, ENGINE);
    receive_group(3, EEC1, BRAKES);
    TEST_ASSERT_EQUAL_UINT8(1, taken[EXACT]);
    TEST_ASSERT_EQUAL_UINT8(1, taken[FROM_ANY]);
    TEST_ASSERT_EQUAL_UINT8(1, taken[FROM_BRAKES]);
    TEST_ASSERT_TRUE(states[2].taken && states[3].taken);
}

static void a_standard_id_is_of_no_group(void)
{
    canopy_can_frame_t frame = {.id = 0, .length = 8};

    canopy_bus_receive(&bus, &frame, 0);
    frame.flags = CANOPY_CAN_EXTENDED | CANOPY_CAN_ERROR;
    frame.id = (uint32_t)EEC1 << 8;
    canopy_bus_receive(&bus, &frame, 0);
    TEST_ASSERT_EQUAL_UINT32(2, bus.counters.unknown_id);
    bus.bus = &exact_only;
    receive_group(6, EEC1, ENGINE);
    TEST_ASSERT_EQUAL_UINT32(3, bus.counters.unknown_id);
}

static void a_frame_may_be_longer_where_the_table_says_so(void)
{
    canopy_can_frame_t frame = {.id = 0x100};

    for (uint8_t length = 0; length <= 8u; length++) {
        frame.length = length;
        canopy_bus_receive(&bus, &frame, 0);
    }
    TEST_ASSERT_EQUAL_UINT8(4, taken[PLAIN]); /* 2 to 5 bytes */
    TEST_ASSERT_EQUAL_UINT32(5, bus.counters.wrong_form);
}

static void packets_make_a_message(void)
{
    static const uint8_t wanted[LONG_BYTES] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20};

    announce(DM1, ENGINE, LONG_BYTES, 1000);
    packet(ENGINE, 1, 51000);
    packet(ENGINE, 2, 101000);
    TEST_ASSERT_EQUAL_UINT8(0, bus.taken);
    packet(ENGINE, 3, 151000);
    TEST_ASSERT_EQUAL_UINT8(1, taken[LONG]);
    TEST_ASSERT_EQUAL_UINT8_ARRAY(wanted, bytes, LONG_BYTES);
    TEST_ASSERT_EQUAL_UINT8(1, bus.taken);
    TEST_ASSERT_EQUAL_HEX8(canopy_bus_check(0, ENGINE, wanted, LONG_BYTES), bus.check);
    TEST_ASSERT_EQUAL_UINT32(1, bus.counters.accepted);
    TEST_ASSERT_EQUAL_UINT16(150, states[4].age_ms); /* since it was announced */
    TEST_ASSERT_EQUAL_HEX8(0xA5, transport_data[LONG_BYTES]);
    packet(ENGINE, 4, 200000); /* nobody waits for it */
    TEST_ASSERT_EQUAL_UINT32(1, bus.counters.unknown_id);
}

static void sources_send_at_the_same_time(void)
{
    announce(DM1, ENGINE, LONG_BYTES, 0);
    announce(VI, BRAKES, LONGER_BYTES, 0);
    packet(BRAKES, 1, 10);
    packet(ENGINE, 1, 20);
    packet(ENGINE, 2, 30);
    packet(BRAKES, 2, 40);
    packet(ENGINE, 3, 50);
    TEST_ASSERT_EQUAL_UINT8(1, taken[LONG]);
    TEST_ASSERT_EQUAL_UINT8(1, taken[LONGER]);
    TEST_ASSERT_EQUAL_UINT32(2, bus.counters.accepted);
}

static void a_group_with_a_destination_can_be_for_all(void)
{
    announce(PROPRIETARY, ECU, 9, 0);
    packet(ECU, 1, 1);
    packet(ECU, 2, 2);
    TEST_ASSERT_EQUAL_UINT8(1, taken[FOR_US]);
}

static void what_is_not_whole_is_dropped_and_counted(void)
{
    announce(DM1, ENGINE, LONG_BYTES, 0);
    packet(ENGINE, 1, 1);
    packet(ENGINE, 3, 2); /* 2 is lost */
    packet(ENGINE, 2, 3);
    TEST_ASSERT_EQUAL_UINT32(1, bus.counters.wrong_sequence);
    TEST_ASSERT_EQUAL_UINT32(1, bus.counters.unknown_id);
    announce(DM1, ENGINE, LONG_BYTES, 0);
    packet(ENGINE, 1, CANOPY_TRANSPORT_GAP_US - 1u);
    packet(ENGINE, 2, 2u * CANOPY_TRANSPORT_GAP_US - 1u); /* late */
    TEST_ASSERT_EQUAL_UINT32(2, bus.counters.wrong_sequence);
    announce(DM1, ENGINE, LONG_BYTES, 0);
    packet(ENGINE, 1, 1);
    announce(VI, ENGINE, LONGER_BYTES, 2); /* instead */
    packet(ENGINE, 1, 3);
    packet(ENGINE, 2, 4);
    TEST_ASSERT_EQUAL_UINT32(3, bus.counters.wrong_sequence);
    TEST_ASSERT_EQUAL_UINT8(0, taken[LONG]);
    TEST_ASSERT_EQUAL_UINT8(1, taken[LONGER]);
}

static void an_announcement_must_be_of_a_message_and_fit_it(void)
{
    static const uint8_t request[8] = {16, LONG_BYTES, 0, 3, 0xFF, DM1 & 0xFF, DM1 >> 8, 0};
    static const uint8_t packets[8] = {32, LONG_BYTES, 0, 4, 0xFF, DM1 & 0xFF, DM1 >> 8, 0};

    announce(DM1 + 1, ENGINE, LONG_BYTES, 0);
    receive(ANNOUNCEMENT, request, 8, 0);
    TEST_ASSERT_EQUAL_UINT32(2, bus.counters.unknown_id);
    announce(DM1, ENGINE, LONG_BYTES + 1, 0);
    receive(ANNOUNCEMENT, packets, 8, 0);
    TEST_ASSERT_EQUAL_UINT32(2, bus.counters.wrong_form);
    packet(ENGINE, 1, 1);
    TEST_ASSERT_EQUAL_UINT32(3, bus.counters.unknown_id);
}

static void a_value_out_of_range_refuses_the_whole(void)
{
    uint8_t data[8] = {1, 0xEE};

    announce(PROPRIETARY, ECU, 9, 0);
    receive(PACKET | ECU, data, 8, 1);
    packet(ECU, 2, 2);
    TEST_ASSERT_EQUAL_UINT32(1, bus.counters.out_of_range);
}

static void only_frames_of_the_right_form_are_packets(void)
{
    canopy_can_frame_t frame = {.id = PACKET, .length = 8};

    canopy_bus_receive(&bus, &frame, 0); /* no extended id */
    frame.flags = CANOPY_CAN_EXTENDED;
    frame.length = 7;
    canopy_bus_receive(&bus, &frame, 0);
    frame.length = 8;
    frame.id = UINT32_C(0x1CEB2100); /* to one node */
    canopy_bus_receive(&bus, &frame, 0);
    TEST_ASSERT_EQUAL_UINT32(3, bus.counters.unknown_id);
    bus.bus = &no_transports;
    announce(DM1, ENGINE, LONG_BYTES, 0);
    TEST_ASSERT_EQUAL_UINT32(4, bus.counters.unknown_id);
    TEST_ASSERT_EQUAL_UINT16(0, transport_states[0].size);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_group_is_taken_whatever_its_priority_and_source);
    RUN_TEST(what_is_told_more_closely_comes_first);
    RUN_TEST(a_standard_id_is_of_no_group);
    RUN_TEST(a_frame_may_be_longer_where_the_table_says_so);
    RUN_TEST(packets_make_a_message);
    RUN_TEST(sources_send_at_the_same_time);
    RUN_TEST(a_group_with_a_destination_can_be_for_all);
    RUN_TEST(what_is_not_whole_is_dropped_and_counted);
    RUN_TEST(an_announcement_must_be_of_a_message_and_fit_it);
    RUN_TEST(a_value_out_of_range_refuses_the_whole);
    RUN_TEST(only_frames_of_the_right_form_are_packets);
    return UNITY_END();
}
