/* SPDX-License-Identifier: MIT */
/**
 * @file
 * An acceptance list for a controller that has few filters: as pairs of id and mask. Needs no operating system.
 *
 *     canopy_can_mask_t masks[8];
 *     bool exact;
 *     int count = canopy_can_acceptance_masks(nao_home_app.acceptance, masks, 8, &exact);
 *
 * No state; may be called from anywhere. For the start of a program: it costs O(ids * most^2) and, to see whether the
 * result is exact, O(ids^2).
 */
#ifndef CANOPY_CAN_ACCEPTANCE_MASKS_H
#define CANOPY_CAN_ACCEPTANCE_MASKS_H

#include <stdbool.h>
#include <stdint.h>

#include "canopy/acceptance.h"

/**
 * Finds masks that let every id of the list through, and as few others as it can. Each has bit 31 (the format) unless
 * `most` was 1 and both formats are listed: then the mask cannot tell them apart.
 *
 * @param acceptance the list, and those that it continues with
 * @param masks      room for `most` pairs
 * @param most       filters of the controller, >= 1. Where masks have to be merged, those are that let the least share of
 *                   their format's ids through.
 * @param exact      whether nothing else passes: then the driver may set canopy_can_t.is_filtered; if not, it checks each
 *                   frame with canopy_can_accepts() and may then set it, too. Not NULL.
 * @return how many pairs were written, 0..most; CANOPY_ERROR_ARGUMENT: a bad list, or no room
 */
int canopy_can_acceptance_masks(const canopy_can_acceptance_t *acceptance, canopy_can_mask_t *masks, uint16_t most,
                                bool *exact);

#endif
