/* SPDX-License-Identifier: MIT */
/** @file For Frama-C: the E2E check and protection of any frame, and the comparison of any two times. */
#include "__fc_builtin.h"
#include "canopy/clock.h"
#include "canopy/e2e.h"

static uint8_t frame[64];

static void any_frame(void)
{
    canopy_e2e_receiver_t receiver = {.counter = (uint8_t)Frama_C_unsigned_int_interval(0, CANOPY_E2E_COUNTERS - 1u),
                                      .started = Frama_C_interval(0, 1) != 0};

    for (unsigned byte = 0; byte < sizeof frame; byte++) {
        frame[byte] = (uint8_t)Frama_C_unsigned_int_interval(0, UINT8_MAX);
    }
    for (uint8_t length = 2; length <= sizeof frame; length++) {
        (void)canopy_e2e_check(&receiver, (uint16_t)Frama_C_unsigned_int_interval(0, UINT16_MAX), frame, length);
        canopy_e2e_protect((uint16_t)Frama_C_unsigned_int_interval(0, UINT16_MAX),
                           (uint8_t)Frama_C_unsigned_int_interval(0, CANOPY_E2E_COUNTERS - 1u), frame, length);
    }
}

int main(void)
{
    any_frame();
    (void)canopy_time_reached((canopy_time_t)Frama_C_unsigned_long_long_interval(0, UINT64_MAX),
                              (canopy_time_t)Frama_C_unsigned_long_long_interval(0, UINT64_MAX));
    return 0;
}
