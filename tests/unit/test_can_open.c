/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Buses opened by name: which driver is taken, and that every refusal names the bus and the way out.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "canopy/can/open.h"
#include "unity.h"

static canopy_can_port_t port;
static char message[CANOPY_CAN_OPEN_MESSAGE];
static char base[64];

void setUp(void)
{
    message[0] = '\0';
    (void)snprintf(base, sizeof base, "/tmp/canopy-test-XXXXXX");
    TEST_ASSERT_NOT_NULL(mkdtemp(base));
    TEST_ASSERT_EQUAL(0, setenv("CANOPY_BUS_DIR", base, 1)); /* NOLINT(concurrency-mt-unsafe): no thread yet */
}

void tearDown(void)
{
    char folder[100];
    canopy_can_close(&port);
    (void)snprintf(folder, sizeof folder, "%s/bus0", base);
    (void)rmdir(folder);
    (void)rmdir(base);
}

static void expect_refused(canopy_error_t error, const char *spec, const char *way_out)
{
    TEST_ASSERT_EQUAL(error, canopy_can_open(&port, spec, CANOPY_CAN_ACCEPT_EVERYTHING, message, sizeof message));
    TEST_ASSERT_NULL(port.can);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(message, spec), message);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(message, way_out), message);
    TEST_ASSERT_LESS_THAN(sizeof message - 1u, strlen(message)); /* not shortened */
}

static void test_unixbus_is_opened_and_closed(void)
{
    const canopy_can_frame_t frame = {.id = 1};

    TEST_ASSERT_EQUAL(CANOPY_OK,
                      canopy_can_open(&port, "unixbus:bus0", CANOPY_CAN_ACCEPT_EVERYTHING, message, sizeof message));
    TEST_ASSERT_EQUAL_STRING("", message);
    TEST_ASSERT_EQUAL(CANOPY_CAN_OPEN_UNIXBUS, port.kind);
    TEST_ASSERT_NULL(canopy_can_advice(&port, 0)); /* it keeps all promises */
    TEST_ASSERT_EQUAL(1, port.can->send(port.can->context, 0, &frame));
    canopy_can_close(&port);
    TEST_ASSERT_NULL(port.can);
    canopy_can_close(&port);
    TEST_ASSERT_NULL(canopy_can_advice(&port, 0));
}

static void test_a_filter_must_be_given(void)
{
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_can_open(&port, "unixbus:bus0", NULL, message, sizeof message));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_can_open(&port, "socketcan:can0", NULL, message, sizeof message));
}

static void test_spec_of_no_known_form(void)
{
    expect_refused(CANOPY_ERROR_ARGUMENT, "vcan0", "socketcan:vcan0");
    expect_refused(CANOPY_ERROR_ARGUMENT, "unixbus", "unixbus:bus0");
    expect_refused(CANOPY_ERROR_ARGUMENT, "slcan:tty0", "socketcan:vcan0");
}

static void test_unixbus_that_cannot_be(void)
{
    expect_refused(CANOPY_ERROR_ARGUMENT, "unixbus:", "bus0");
    expect_refused(CANOPY_ERROR_NOT_FOUND, "unixbus:/nowhere/at/all", "CANOPY_BUS_DIR");
    expect_refused(CANOPY_ERROR_IO, "unixbus:/dev/null", "CANOPY_BUS_DIR");
    expect_refused(CANOPY_ERROR_ARGUMENT,
                   "unixbus:a_name_that_is_so_long_that_no_socket_of_this_bus_could_have_its_path_in_sun_path",
                   "CANOPY_BUS_DIR");
}

/* What the kernel says depends on whether it has CAN; where it has, tests/integration/rig/test_socketcan.py goes on. */
static void test_socketcan_interface_that_is_not_there(void)
{
    const canopy_error_t error =
        canopy_can_open(&port, "socketcan:nocan9", CANOPY_CAN_ACCEPT_EVERYTHING, message, sizeof message);

    TEST_ASSERT_TRUE(error == CANOPY_ERROR_NOT_FOUND || error == CANOPY_ERROR_UNSUPPORTED);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(message, error == CANOPY_ERROR_NOT_FOUND ? "ip link add" : "with-vcan"),
                                 message);
    expect_refused(CANOPY_ERROR_ARGUMENT, "socketcan:", "1 to 15 characters");
    expect_refused(CANOPY_ERROR_ARGUMENT, "socketcan:sixteencharacter", "1 to 15 characters");
}

static void test_long_message_is_shortened(void)
{
    char small[20];
    memset(small, 'x', sizeof small);

    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT,
                      canopy_can_open(&port, "?", CANOPY_CAN_ACCEPT_EVERYTHING, small, sizeof small - 1u));
    TEST_ASSERT_EQUAL_UINT(sizeof small - 2u, strlen(small));
    TEST_ASSERT_EQUAL_CHAR('x', small[sizeof small - 1u]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_unixbus_is_opened_and_closed);
    RUN_TEST(test_a_filter_must_be_given);
    RUN_TEST(test_spec_of_no_known_form);
    RUN_TEST(test_unixbus_that_cannot_be);
    RUN_TEST(test_socketcan_interface_that_is_not_there);
    RUN_TEST(test_long_message_is_shortened);
    return UNITY_END();
}
