/* SPDX-License-Identifier: MIT */
/** @file The state of the CAN bus, and the way back; the contract is in can_state.h. */
#include "canopy/can_state.h"

#include <stddef.h>

#include "canopy/count.h"

static canopy_can_state_t look(const canopy_can_t *can, bool blocked)
{
    canopy_can_controller_t controller = can->state != NULL ? can->state(can->context) : CANOPY_CAN_CONTROLLER_ACTIVE;

    switch (controller) {
    case CANOPY_CAN_CONTROLLER_BUS_OFF:
        return CANOPY_CAN_BUS_OFF;
    case CANOPY_CAN_CONTROLLER_DOWN:
        return CANOPY_CAN_DOWN;
    case CANOPY_CAN_CONTROLLER_GONE:
        return CANOPY_CAN_GONE;
    case CANOPY_CAN_CONTROLLER_ACTIVE:
    case CANOPY_CAN_CONTROLLER_WARNING:
    case CANOPY_CAN_CONTROLLER_PASSIVE:
        break;
    }
    if (blocked) {
        return CANOPY_CAN_BLOCKED;
    }
    if (controller == CANOPY_CAN_CONTROLLER_PASSIVE) {
        return CANOPY_CAN_ERROR_PASSIVE;
    }
    return controller == CANOPY_CAN_CONTROLLER_WARNING ? CANOPY_CAN_ERROR_WARNING : CANOPY_CAN_ERROR_ACTIVE;
}

static canopy_time_t next_pause(canopy_time_t pause)
{
    return pause < CANOPY_CAN_RESTART_LONGEST_US / 2u ? 2u * pause : CANOPY_CAN_RESTART_LONGEST_US;
}

static void restart(canopy_can_manager_t *self, const canopy_can_t *can, canopy_time_t now)
{
    if (can->restart == NULL || !canopy_time_reached(now, self->next)) {
        return;
    }
    canopy_count(&self->restarts);
    self->pause = next_pause(self->pause);
    self->next = now + self->pause;
    can->restart(can->context);
}

canopy_can_state_t canopy_can_manager_step(canopy_can_manager_t *self, const canopy_can_t *can, bool blocked,
                                           canopy_time_t now)
{
    canopy_can_state_t before = self->state;

    /* What could not be handed over while the bus was unusable says nothing of the bus that has just come back. */
    self->state = look(can, blocked && !canopy_can_is_unusable(before));
    if (canopy_can_is_unusable(self->state) != canopy_can_is_unusable(before)) {
        self->since = now;
    }
    if (canopy_can_is_unusable(self->state)) {
        if (!canopy_can_is_unusable(before)) {
            canopy_count(&self->failures);
            self->pause = self->pause != 0u ? self->pause : CANOPY_CAN_RESTART_FIRST_US;
            self->next = now + self->pause;
        }
        restart(self, can, now);
    } else if (self->pause != 0u && canopy_time_reached(now, self->since + CANOPY_CAN_SETTLED_US)) {
        self->pause = 0;
    }
    return self->state;
}
