/* SPDX-License-Identifier: MIT */
/** @file AUTOSAR E2E Profile 11. */
#include "canopy/e2e.h"

static uint8_t crc8_j1850(uint8_t crc, uint8_t byte)
{
    crc ^= byte;
    for (unsigned bit = 0; bit < 8u; bit++) {
        crc = (uint8_t)((crc & 0x80u) != 0u ? ((unsigned)crc << 1) ^ 0x1Du : (unsigned)crc << 1);
    }
    return crc;
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
