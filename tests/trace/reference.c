/* SPDX-License-Identifier: MIT */
#include "reference.h"

static canopy_status_t tick(ref_tree_t *self, uint16_t index);

/** The parent resets a node: what runs below is halted first. One that was SKIPPED has nothing to forget. */
static void reset(ref_tree_t *self, uint16_t index)
{
    ref_node_t *node = &self->nodes[index];

    for (uint16_t child = (uint16_t)(index + 1u); child < node->end; child = self->nodes[child].end) {
        reset(self, child);
    }
    node->resume = 0;
    node->is_reset = node->result != CANOPY_IDLE && node->result != CANOPY_SKIPPED;
}

static void reset_from(ref_tree_t *self, uint16_t child, uint16_t end)
{
    for (; child < end; child = self->nodes[child].end) {
        reset(self, child);
    }
}

/** Done: all children are reset. */
static canopy_status_t done(ref_tree_t *self, uint16_t index, canopy_status_t status)
{
    reset_from(self, (uint16_t)(index + 1u), self->nodes[index].end);
    self->nodes[index].resume = 0;
    return status;
}

static bool all_skipped(const ref_tree_t *self, uint16_t index)
{
    bool all = true;

    for (uint16_t child = (uint16_t)(index + 1u); child < self->nodes[index].end; child = self->nodes[child].end) {
        all = all && self->nodes[child].result == CANOPY_SKIPPED;
    }
    return all;
}

/** The four that tick one child after the other, as long as each says `goes_on`. */
static canopy_status_t tick_in_order(ref_tree_t *self, uint16_t index, canopy_status_t goes_on, bool is_reactive)
{
    ref_node_t *node = &self->nodes[index];
    uint16_t child = node->resume != 0 ? node->resume : (uint16_t)(index + 1u);

    for (; child < node->end; child = self->nodes[child].end) {
        canopy_status_t status = tick(self, child);

        if (status == CANOPY_RUNNING) {
            node->resume = is_reactive ? 0 : child;
            if (is_reactive) {
                reset_from(self, self->nodes[child].end, node->end);
            }
            return CANOPY_RUNNING;
        }
        if (status != goes_on && status != CANOPY_SKIPPED) {
            return done(self, index, status);
        }
    }
    return done(self, index, all_skipped(self, index) ? CANOPY_SKIPPED : goes_on);
}

/** With max_failures 1. */
static canopy_status_t tick_parallel_all(ref_tree_t *self, uint16_t index)
{
    unsigned running = 0, failures = 0;

    for (uint16_t i = (uint16_t)(index + 1u); i < self->nodes[index].end; i = self->nodes[i].end) {
        ref_node_t *child = &self->nodes[i];
        bool is_remembered = !child->is_reset && (child->result == CANOPY_SUCCESS || child->result == CANOPY_FAILURE);
        canopy_status_t status = is_remembered ? child->result : tick(self, i);

        running += status == CANOPY_RUNNING ? 1u : 0u;
        failures += status == CANOPY_FAILURE ? 1u : 0u;
    }
    if (running > 0) {
        return CANOPY_RUNNING;
    }
    return done(self, index,
                all_skipped(self, index) ? CANOPY_SKIPPED
                : failures > 0           ? CANOPY_FAILURE
                                         : CANOPY_SUCCESS);
}

static bool is_running(const ref_node_t *node)
{
    return node->result == CANOPY_RUNNING && !node->is_reset;
}

static canopy_status_t tick_while_do_else(ref_tree_t *self, uint16_t index)
{
    uint16_t yes = self->nodes[index + 1u].end;
    uint16_t no = self->nodes[yes].end;
    canopy_status_t status = tick(self, (uint16_t)(index + 1u));
    uint16_t branch = status == CANOPY_SUCCESS ? yes : no;
    uint16_t other = status == CANOPY_SUCCESS ? no : yes;

    if (status == CANOPY_RUNNING) {
        return CANOPY_RUNNING;
    }
    if (status == CANOPY_SKIPPED) {
        return done(self, index, CANOPY_SKIPPED);
    }
    if (is_running(&self->nodes[other])) {
        reset(self, other);
    }
    status = tick(self, branch);
    return status == CANOPY_RUNNING ? CANOPY_RUNNING : done(self, index, status);
}

/** A decorator resets a child that is done. */
static canopy_status_t tick_decorator(ref_tree_t *self, uint16_t index, const canopy_status_t becomes[5])
{
    canopy_status_t status = tick(self, (uint16_t)(index + 1u));

    if (status != CANOPY_RUNNING) {
        reset(self, (uint16_t)(index + 1u));
    }
    return becomes[status];
}

static canopy_status_t returns(ref_tree_t *self, uint16_t index)
{
    static const canopy_status_t inverted[] = {CANOPY_IDLE, CANOPY_RUNNING, CANOPY_FAILURE, CANOPY_SUCCESS,
                                               CANOPY_SKIPPED};
    static const canopy_status_t kept[] = {CANOPY_IDLE, CANOPY_RUNNING, CANOPY_RUNNING, CANOPY_FAILURE, CANOPY_SKIPPED};

    switch (self->nodes[index].kind) {
    case REF_SEQUENCE:
    case REF_REACTIVE_SEQUENCE:
        return tick_in_order(self, index, CANOPY_SUCCESS, self->nodes[index].kind == REF_REACTIVE_SEQUENCE);
    case REF_FALLBACK:
    case REF_REACTIVE_FALLBACK:
        return tick_in_order(self, index, CANOPY_FAILURE, self->nodes[index].kind == REF_REACTIVE_FALLBACK);
    case REF_PARALLEL_ALL:
        return tick_parallel_all(self, index);
    case REF_WHILE_DO_ELSE:
        return tick_while_do_else(self, index);
    case REF_INVERTER:
        return tick_decorator(self, index, inverted);
    case REF_KEEP_RUNNING:
        return tick_decorator(self, index, kept);
    case REF_LEAF:
    case REF_CONDITION:
        break;
    }
    return self->nodes[index].answer;
}

static canopy_status_t tick(ref_tree_t *self, uint16_t index)
{
    canopy_status_t status = returns(self, index);

    self->nodes[index].result = status;
    self->nodes[index].is_ticked = true;
    self->nodes[index].is_reset = false;
    return status;
}

canopy_status_t ref_tick(ref_tree_t *self)
{
    for (uint16_t i = 0; i < self->count; i++) {
        self->nodes[i].is_ticked = false;
    }
    return tick(self, 0);
}

void ref_start(ref_tree_t *self)
{
    for (uint16_t i = 0; i < self->count; i++) {
        ref_node_t *node = &self->nodes[i];

        *node = (ref_node_t){.kind = node->kind, .parent = node->parent, .end = node->end, .answer = node->answer};
    }
}

uint8_t ref_code(const ref_node_t *node)
{
    static const uint8_t kept = 4, reset_now = 8, reset_before = 11;
    uint8_t result = (uint8_t)node->result;

    if (node->result == CANOPY_IDLE) {
        return 0;
    }
    if (node->is_reset) {
        return (uint8_t)(result + (node->is_ticked ? reset_now : reset_before));
    }
    return (uint8_t)(result + (node->is_ticked ? 0u : kept));
}

/** Makes the subtree at the next free place, with at most `most` nodes. */
static void make(ref_tree_t *self, random_t *random, uint16_t parent, uint16_t most, unsigned depth)
{
    uint16_t index = self->count++;
    ref_node_t *node = &self->nodes[index];
    uint32_t kind = random_below(random, 8u);
    uint16_t left = (uint16_t)(most - 1u);
    uint32_t children = 1u + random_below(random, 6u);

    *node = (ref_node_t){.parent = parent, .answer = CANOPY_SUCCESS};
    node->kind = (ref_kind_t)(kind + REF_SEQUENCE);
    if (left == 0 || depth == DEPTH_MAX || (parent != index && random_chance(random, 100))) {
        node->kind = random_chance(random, 300) ? REF_CONDITION : REF_LEAF;
        children = 0;
    } else if (node->kind == REF_WHILE_DO_ELSE) {
        children = 3;
        node->kind = left < children ? REF_INVERTER : node->kind;
    }
    if (node->kind == REF_INVERTER || node->kind == REF_KEEP_RUNNING) {
        children = 1;
    }
    for (uint32_t i = 0; i < children && left > 0; i++) {
        uint32_t others = children - 1u - i; /* each wants one node */
        uint16_t share = (uint16_t)(others >= left       ? 1u
                                    : i + 1u == children ? left
                                                         : 1u + random_below(random, left - others));
        uint16_t before = self->count;

        make(self, random, index, share, depth + 1u);
        left = (uint16_t)(left - (self->count - before));
    }
    node->end = self->count;
}

void ref_make_flat(ref_tree_t *self, uint16_t count)
{
    self->count = count;
    self->nodes[0] = (ref_node_t){.kind = REF_PARALLEL_ALL, .end = count};
    for (uint16_t i = 1; i < count; i++) {
        self->nodes[i] = (ref_node_t){.kind = REF_LEAF, .end = (uint16_t)(i + 1u), .answer = CANOPY_RUNNING};
    }
}

void ref_make(ref_tree_t *self, random_t *random, uint16_t most)
{
    uint16_t count = (uint16_t)(1u + random_below(random, random_chance(random, 500) ? most : most / 8u + 1u));

    if (random_chance(random, 200)) {
        ref_make_flat(self, count < 2u ? 2u : count);
        return;
    }
    self->count = 0;
    make(self, random, 0, count, 0);
}
