/* SPDX-License-Identifier: MIT */
/** @file Acceptance lists as masks: each id joins the set that it makes least larger; the contract is in the header. */
#include "canopy/can/acceptance_masks.h"

#include <stddef.h>

#include "canopy/status.h"

#define EXTENDED CANOPY_CAN_ACCEPT_EXTENDED
#define STANDARD_BITS UINT32_C(0x7FF)
#define EXTENDED_BITS UINT32_C(0x1FFFFFFF)

/* A standard id is as much of its format as so many extended ones of theirs. */
enum { STANDARD_WEIGHT = 18 };

/** Sets are compared by the share of the ids that they let through; what mixes the formats is worse than anything. */
#define MIXED (UINT32_C(1) << 30)

static uint32_t bits_of(uint32_t id)
{
    return (id & EXTENDED) != 0u ? EXTENDED_BITS : STANDARD_BITS;
}

/** Bits of the id that may be anything. */
static uint32_t free_bits(const canopy_can_mask_t *set)
{
    return bits_of(set->id) & ~set->mask;
}

static uint32_t size_of(const canopy_can_mask_t *set)
{
    uint32_t size = (set->id & EXTENDED) != 0u ? 1u : UINT32_C(1) << STANDARD_WEIGHT;

    if ((set->mask & EXTENDED) == 0u) {
        return MIXED;
    }
    for (uint32_t bits = free_bits(set); bits != 0u; bits &= bits - 1u) {
        size *= 2u;
    }
    return size;
}

static canopy_can_mask_t exactly(uint32_t id)
{
    return (canopy_can_mask_t){.id = id, .mask = bits_of(id) | EXTENDED};
}

static canopy_can_mask_t merge(const canopy_can_mask_t *a, const canopy_can_mask_t *b)
{
    canopy_can_mask_t set;

    set.mask = a->mask & b->mask & ~(a->id ^ b->id);
    set.id = a->id & set.mask;
    return set;
}

/** By how much a set of both is larger than the two. */
static uint32_t cost(const canopy_can_mask_t *a, const canopy_can_mask_t *b)
{
    const canopy_can_mask_t both = merge(a, b);
    uint32_t apart = size_of(a) + size_of(b);

    return size_of(&both) > apart ? size_of(&both) - apart : 0u;
}

/** Takes a set more among `most`, which are all used: merges the two that cost least, of all and the new one. */
static void squeeze(canopy_can_mask_t *masks, uint16_t most, const canopy_can_mask_t *more)
{
    uint16_t first = 0;
    uint16_t second = most; /* the new one */
    uint32_t least = UINT32_MAX;

    for (uint16_t a = 0; a < most; a++) {
        for (uint32_t b = a + 1u; b <= most; b++) {
            uint32_t more_ids = cost(&masks[a], b < most ? &masks[b] : more);

            if (more_ids < least) {
                least = more_ids;
                first = a;
                second = (uint16_t)b;
            }
        }
    }
    masks[first] = merge(&masks[first], second < most ? &masks[second] : more);
    if (second < most) {
        masks[second] = *more;
    }
}

static bool is_part_of(const canopy_can_mask_t *set, const canopy_can_mask_t *other)
{
    return (other->mask & ~set->mask) == 0u && ((set->id ^ other->id) & other->mask) == 0u;
}

/** Drops sets that lie within another one. @return how many are left */
static uint16_t tidy(canopy_can_mask_t *masks, uint16_t count)
{
    for (uint16_t a = 0; a < count; a++) {
        for (uint16_t b = 0; b < count; b++) {
            if (a != b && is_part_of(&masks[a], &masks[b])) {
                masks[a--] = masks[--count]; /* looked at next */
                break;
            }
        }
    }
    return count;
}

/** Is the set within one that the list has as it is? */
static bool is_listed_whole(const canopy_can_acceptance_t *acceptance, const canopy_can_mask_t *set)
{
    for (const canopy_can_acceptance_t *list = acceptance; list != NULL; list = list->next) {
        for (uint16_t index = 0; index < list->mask_count; index++) {
            if (is_part_of(set, &list->masks[index])) {
                return true;
            }
        }
    }
    return false;
}

/** Does a set let only listed ids through? */
static bool is_exact(const canopy_can_acceptance_t *acceptance, const canopy_can_mask_t *set)
{
    uint32_t bits = free_bits(set);
    uint32_t part = 0;
    uint32_t looked = 0;

    if ((set->mask & EXTENDED) == 0u) {
        return false;
    }
    if (is_listed_whole(acceptance, set)) {
        return true;
    }
    do { /* every value of the free bits */
        if (looked++ == CANOPY_CAN_ACCEPT_MAX || !canopy_can_is_listed(acceptance, set->id | part)) {
            return false;
        }
        part = (part - bits) & bits;
    } while (part != 0u);
    return true;
}

static uint16_t add(canopy_can_mask_t *masks, uint16_t count, uint16_t most, const canopy_can_mask_t *set)
{
    if (count < most) {
        masks[count++] = *set;
    } else {
        squeeze(masks, most, set);
    }
    return tidy(masks, count);
}

static int let_everything_through(canopy_can_mask_t *masks, uint16_t most, bool *exact)
{
    *exact = true;
    if (most == 1u) {
        masks[0] = (canopy_can_mask_t){0};
        return 1;
    }
    masks[0] = (canopy_can_mask_t){.id = 0, .mask = EXTENDED};
    masks[1] = (canopy_can_mask_t){.id = EXTENDED, .mask = EXTENDED};
    return 2;
}

int canopy_can_acceptance_masks(const canopy_can_acceptance_t *acceptance, canopy_can_mask_t *masks, uint16_t most,
                                bool *exact)
{
    uint16_t count = 0;

    if (!canopy_can_acceptance_is_valid(acceptance) || masks == NULL || most == 0u || exact == NULL) {
        return CANOPY_ERROR_ARGUMENT;
    }
    if (canopy_can_accepts_everything(acceptance)) {
        return let_everything_through(masks, most, exact);
    }
    for (const canopy_can_acceptance_t *list = acceptance; list != NULL; list = list->next) {
        for (uint16_t index = 0; index < list->count; index++) {
            const canopy_can_mask_t set = exactly(list->ids[index]);

            if (!canopy_can_masks_accept(masks, count, set.id)) {
                count = add(masks, count, most, &set);
            }
        }
        for (uint16_t index = 0; index < list->mask_count; index++) {
            count = add(masks, count, most, &list->masks[index]);
        }
    }
    *exact = true;
    for (uint16_t index = 0; index < count; index++) {
        *exact = *exact && is_exact(acceptance, &masks[index]);
    }
    return count;
}
