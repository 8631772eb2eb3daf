/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The nodes' statuses in the trace: what has changed since it was told last, and snapshots.
 *
 * Statuses are compared four at a time, and marked as old in the same pass: what the next tick stores has no such mark, so
 * a node that it does not tick differs from one that it ticks with the same result.
 */
#include <stddef.h>

#include "trace_parts.h"

enum { WORD = 4, SNAPSHOT_NODES = 10, BLOCK = 16, ENTRIES = 5, FILLER = 0xFF };
enum { SKIP = 15, SKIP_BLOCKS_MAX = 14, TICK_AT = 4 };
enum { MORE_FOLLOW = 0x00, LAST = 0x40, LAST_AND_WAITING = 0x80 };

#define OLD_WORD (CANOPY_STATUS_OLD * UINT32_C(0x01010101))

/** Is this node's code another than the one told last? Where only bytes differ that have one code, they count as told. */
static bool has_changed(canopy_trace_state_t *state, const canopy_tree_instance_t *tree, uint16_t node)
{
    uint8_t status = tree->status[node];

    if (status == state->sent[node]) {
        return false;
    }
    if (canopy_status_code(status) != canopy_status_code(state->sent[node])) {
        return true;
    }
    state->sent[node] = status;
    return false;
}

/** Marks the words of nodes that are as told, from `node` on, a whole number of words. @return the node after them */
static uint32_t mark_words(const canopy_trace_state_t *state, const canopy_tree_instance_t *tree, uint32_t node,
                           uint32_t to)
{
    uint32_t *status = (uint32_t *)(void *)tree->status; /* they are declared as words: canopy_app_t.status */
    const uint32_t *sent = (const uint32_t *)(const void *)state->sent;
    uint32_t word = node / (uint32_t)WORD;
    const uint32_t end = to / (uint32_t)WORD;

    while (word < end && status[word] == sent[word]) {
        status[word] |= OLD_WORD;
        word++;
    }
    return word * (uint32_t)WORD;
}

/** The first node in [from, to) that has changed, or `to`. Marks those before it. */
static uint16_t next_change(canopy_trace_state_t *state, const canopy_tree_instance_t *tree, uint16_t from, uint16_t to)
{
    uint32_t node = from;

    while (node < to) {
        if (node % (uint32_t)WORD == 0u) {
            node = mark_words(state, tree, node, to);
        }
        if (node >= to || has_changed(state, tree, (uint16_t)node)) {
            break;
        }
        tree->status[node] |= (uint8_t)CANOPY_STATUS_OLD;
        node++;
    }
    return (uint16_t)node;
}

uint16_t canopy_trace_first_change(canopy_trace_state_t *state, const canopy_tree_instance_t *tree)
{
    return next_change(state, tree, 0, tree->tree->node_count);
}

/** CanopyChange frames of a tick. */
typedef struct {
    const canopy_trace_sink_t *sink;
    canopy_tx_trace_data_t data;
    uint32_t position; /* the next node that an entry without a gap names */
    uint8_t filled;    /* entries of the frame at hand */
    uint8_t frames;    /* begun */
} changes_t;

static void end_frame(changes_t *self, unsigned more)
{
    self->data.byte[0] = (uint8_t)(canopy_trace_number(self->sink->state) | more);
    for (unsigned entry = self->filled; entry < (unsigned)ENTRIES; entry++) {
        self->data.byte[3u + entry] = (uint8_t)FILLER;
    }
    canopy_trace_post(self->sink, CANOPY_TRACE_CHANGE, &self->data);
}

static void begin_frame(changes_t *self, uint16_t node)
{
    unsigned block = node / (unsigned)BLOCK;

    canopy_trace_put16(&self->data.byte[1], block | ((self->sink->tick & 15u) << 12));
    self->position = block * (unsigned)BLOCK;
    self->filled = 0;
    self->frames++;
}

/** How many entries this node takes in the frame at hand, skips included; more than a frame has: it cannot be there. */
static unsigned entries_for(const changes_t *self, uint16_t node)
{
    if (self->frames == 0u || node < self->position) {
        return ENTRIES + 1;
    }
    return 1u +
           ((node - self->position) / (unsigned)BLOCK + (unsigned)SKIP_BLOCKS_MAX - 1u) / (unsigned)SKIP_BLOCKS_MAX;
}

static void put_entry(changes_t *self, unsigned gap, unsigned code)
{
    self->data.byte[3u + self->filled] = (uint8_t)(code | (gap << 4));
    self->filled++;
}

/** @return false: there is no room for this node in this tick */
static bool put_node(changes_t *self, uint16_t node)
{
    if (self->filled + entries_for(self, node) > (unsigned)ENTRIES) {
        if (self->frames == self->sink->config->changes_max) {
            return false;
        }
        if (self->frames > 0u) {
            end_frame(self, MORE_FOLLOW);
        }
        begin_frame(self, node);
    }
    for (unsigned blocks = (node - self->position) / (unsigned)BLOCK; blocks > 0u;) {
        unsigned skipped = blocks < (unsigned)SKIP_BLOCKS_MAX ? blocks : (unsigned)SKIP_BLOCKS_MAX;

        put_entry(self, skipped - 1u, SKIP);
        self->position += skipped * (unsigned)BLOCK;
        blocks -= skipped;
    }
    put_entry(self, node - self->position, canopy_status_code(self->sink->tree->status[node]));
    self->position = node + 1u;
    return true;
}

/** Tells and marks the nodes in [from, to). @return the first one for which there was no room, or `to` */
static uint16_t tell(changes_t *self, uint16_t from, uint16_t to)
{
    canopy_trace_state_t *state = self->sink->state;
    canopy_tree_instance_t *tree = self->sink->tree;
    uint16_t node = next_change(state, tree, from, to);

    while (node < to && put_node(self, node)) {
        state->sent[node] = tree->status[node];
        tree->status[node] |= (uint8_t)CANOPY_STATUS_OLD;
        node = next_change(state, tree, (uint16_t)(node + 1u), to);
    }
    return node;
}

static void mark(const canopy_tree_instance_t *tree, uint16_t from, uint16_t to)
{
    for (uint16_t node = from; node < to; node++) {
        tree->status[node] |= (uint8_t)CANOPY_STATUS_OLD;
    }
}

void canopy_trace_changes(const canopy_trace_sink_t *sink, uint16_t first)
{
    changes_t changes = {.sink = sink};
    uint16_t count = sink->tree->tree->node_count;
    uint16_t start = sink->state->next_node < count ? sink->state->next_node : 0u;
    uint16_t stopped;
    bool waiting;

    start = start > first ? start : first;
    stopped = tell(&changes, start, count);
    if (stopped == count) {
        stopped = tell(&changes, first, start);
        waiting = stopped < start;
        mark(sink->tree, stopped, start);
    } else {
        waiting = true;
        mark(sink->tree, stopped, count);
        mark(sink->tree, first, start);
    }
    sink->state->next_node = waiting ? stopped : 0u;
    end_frame(&changes, waiting ? LAST_AND_WAITING : LAST);
}

void canopy_trace_show(const canopy_trace_sink_t *sink, canopy_tx_trace_data_t *data)
{
    canopy_trace_state_t *state = sink->state;
    const canopy_tree_instance_t *tree = sink->tree;
    uint16_t count = tree->tree->node_count;
    uint32_t first = state->next_shown;

    canopy_trace_put16(&data->byte[1], first / (unsigned)SNAPSHOT_NODES | ((sink->tick & 7u) << 13));
    for (unsigned place = 0; place < (unsigned)SNAPSHOT_NODES; place++) {
        uint32_t node = first + place;
        unsigned code = CANOPY_CODE_NONE;

        if (node < count) {
            code = canopy_status_code(tree->status[node]);
            state->sent[node] = tree->status[node];
        }
        if (place % 2u == 0u) {
            data->byte[3u + place / 2u] = (uint8_t)code;
        } else {
            data->byte[3u + place / 2u] |= (uint8_t)(code << 4);
        }
    }
    state->next_shown = first + (uint32_t)SNAPSHOT_NODES < count ? (uint16_t)(first + (uint32_t)SNAPSHOT_NODES) : 0u;
}
