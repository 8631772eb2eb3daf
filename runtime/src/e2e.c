/* SPDX-License-Identifier: MIT */
/** @file AUTOSAR E2E Profile 11. */
#include "canopy/e2e.h"

/**
 * The remainders of the 16 values of a half byte, shifted left by 8 bits and divided by J1850's polynomial
 * x^8 + x^4 + x^3 + x^2 + 1 (0x1D): four bits in one step. Constant, so in flash.
 */
static const uint8_t remainders[16] = {0x00, 0x1D, 0x3A, 0x27, 0x74, 0x69, 0x4E, 0x53,
                                       0xE8, 0xF5, 0xD2, 0xCF, 0x9C, 0x81, 0xA6, 0xBB};

static uint8_t crc8_j1850(uint8_t crc, uint8_t byte)
{
    unsigned rest = (unsigned)crc ^ byte;

    rest = ((rest << 4) & 0xF0u) ^ remainders[rest >> 4];
    rest = ((rest << 4) & 0xF0u) ^ remainders[rest >> 4];
    return (uint8_t)rest;
}

uint8_t canopy_e2e_crc(uint16_t data_id, const uint8_t *data, uint8_t length)
{
    uint8_t crc = 0;

    crc = crc8_j1850(crc, (uint8_t)(data_id & 0xFFu));
    crc = crc8_j1850(crc, (uint8_t)(data_id >> 8));
    for (uint8_t index = 1; index < length; index++) {
        crc = crc8_j1850(crc, data[index]);
    }
    return crc;
}

void canopy_e2e_protect(uint16_t data_id, uint8_t counter, uint8_t *data, uint8_t length)
{
    data[1] = (uint8_t)((data[1] & 0xF0u) | (counter & 0x0Fu));
    data[0] = canopy_e2e_crc(data_id, data, length);
}

canopy_e2e_result_t canopy_e2e_check(canopy_e2e_receiver_t *receiver, uint16_t data_id, const uint8_t *data,
                                     uint8_t length)
{
    uint8_t counter = data[1] & 0x0Fu;
    unsigned delta;
    bool first = !receiver->started;

    if (counter >= CANOPY_E2E_COUNTERS || data[0] != canopy_e2e_crc(data_id, data, length)) {
        return CANOPY_E2E_WRONG_CRC;
    }
    delta = ((unsigned)counter + CANOPY_E2E_COUNTERS - receiver->counter) % CANOPY_E2E_COUNTERS;
    receiver->counter = counter;
    receiver->started = true;
    if (first) {
        return CANOPY_E2E_OK;
    }
    if (delta == 0u) {
        return CANOPY_E2E_REPEATED;
    }
    return delta <= CANOPY_E2E_DELTA_MAX ? CANOPY_E2E_OK : CANOPY_E2E_WRONG_SEQUENCE;
}
