/* SPDX-License-Identifier: MIT */
/** @file The application "floating": floating-point signals in scripts and ports. */
#include <string.h>

#include "canopy/float_bits.h"
#include "fake_loop.h"
#include "floating_app.h"
#include "unity.h"

enum { LEVEL_ID = 0x100, FINE_ID = 0x101 };

void setUp(void)
{
    fake_loop_start(&floating_app);
}

void tearDown(void)
{
}

static void put(uint8_t *data, uint64_t bits, unsigned bytes)
{
    for (unsigned byte = 0; byte < bytes; byte++) {
        data[byte] = (uint8_t)(bits >> (8u * byte));
    }
}

/** One cycle with these raw values on the bus. */
static canopy_status_t cycle(float water, float slope, double pressure)
{
    uint64_t bits = canopy_float64_bits(pressure);

    fake.rx[0] = (canopy_can_frame_t){.id = LEVEL_ID, .length = 8};
    put(&fake.rx[0].data[0], canopy_float32_bits(water), 4);
    put(&fake.rx[0].data[4], canopy_float32_bits(slope), 4);
    fake.rx[1] = (canopy_can_frame_t){.id = FINE_ID, .length = 8};
    for (unsigned byte = 0; byte < 8u; byte++) {
        fake.rx[1].data[byte] = (uint8_t)(bits >> (8u * (7u - byte)));
    }
    return fake_loop_cycle(2);
}

static void scripts_and_ports_have_physical_values(void)
{
    /* Slope: 5 * 0.5 + 1 = 3.5. */
    TEST_ASSERT_EQUAL(CANOPY_SUCCESS, cycle(1.5F, 5.0F, 250000.0));
    TEST_ASSERT_TRUE(floating_entries->half == 0.75);
    TEST_ASSERT_TRUE(floating_entries->gain == 3.5F);
    TEST_ASSERT_EQUAL_INT16(15, floating_entries->tenths);
    /* 2.5 + 1.5 + 3: a script cuts a float that it stores in a whole number, towards zero. */
    TEST_ASSERT_TRUE(floating_entries->bar == 7.0);
    TEST_ASSERT_TRUE(floating_output->echo.pressure == 700000.0);
    /* Raw: (0.75 - 10) / 0.25. */
    TEST_ASSERT_TRUE(floating_output->pump.trim == -37.0F);
    /* The setter limits to what the DBC allows, as for every signal. */
    TEST_ASSERT_TRUE(floating_output->pump.power == 100.0F);
    TEST_ASSERT_EQUAL_UINT32(0, floating_entries->script_faults);
}

static void conditions_compare_physical_values(void)
{
    TEST_ASSERT_EQUAL(CANOPY_FAILURE, cycle(1.25F, 5.0F, 0.0));
    TEST_ASSERT_EQUAL(CANOPY_FAILURE, cycle(1.5F, 3.5F, 0.0));
    TEST_ASSERT_EQUAL(CANOPY_SUCCESS, cycle(1.5F, 4.0F, 0.0));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(scripts_and_ports_have_physical_values);
    RUN_TEST(conditions_compare_physical_values);
    return UNITY_END();
}
