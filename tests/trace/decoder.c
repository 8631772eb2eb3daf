/* SPDX-License-Identifier: MIT */
#include "decoder.h"

#include <string.h>

enum { TICK, INPUTS, ARRIVALS, SNAPSHOT, CHANGE, VALUE, HEALTH, MODEL, MESSAGES };
enum { SEQUENCES = 64, SNAPSHOT_NODES = 10, ENTRIES = 5, NO_NODE = 15 };
/** CanopyChange.More. */
enum { MORE_FOLLOW = 0, ALL_TOLD = 1, NODES_WAIT = 2 };

void decoder_init(decoder_t *self, const decoder_model_t *model, decoder_cell_t *nodes, decoder_cell_t *slots,
                  decoder_over_t over, void *context)
{
    memset(self, 0, sizeof *self);
    memset(nodes, 0, model->node_count * sizeof *nodes);
    if (model->slot_count > 0) {
        memset(slots, 0, model->slot_count * sizeof *slots);
    }
    self->model = model;
    self->nodes = nodes;
    self->slots = slots;
    self->over = over;
    self->context = context;
}

static void forget(decoder_cell_t *cells, uint32_t begin, uint32_t end)
{
    for (uint32_t i = begin; i < end; i++) {
        cells[i].is_known = false;
    }
}

/** A tick is over: what is certain of it, and since when. `all`: what has not been told has not changed. */
static void judge(const decoder_t *self, decoder_cell_t *cells, uint16_t count, bool all)
{
    for (uint32_t i = 0; i < count; i++) {
        decoder_cell_t *cell = &cells[i];
        bool was_certain = cell->is_certain;

        cell->is_certain = cell->is_known && (all || cell->marked == self->mark);
        if (cell->is_certain && !(was_certain && cell->shown == cell->told)) {
            cell->shown = cell->told;
            cell->since = self->tick.number;
            cell->is_since_exact = was_certain || self->tick.is_start;
        }
    }
}

static void end_tick(decoder_t *self)
{
    const decoder_tick_t *tick = &self->tick;
    bool has_tail = tick->has_changes ? tick->last_came : tick->snapshot_came || !tick->has_snapshot;
    bool is_complete = has_tail && !tick->broken && tick->snapshot_came == tick->has_snapshot;
    bool has_values = tick->values_came == tick->values;

    if (!self->is_at_hand) {
        return;
    }
    self->is_at_hand = false;
    judge(self, self->nodes, self->model->node_count, is_complete && !tick->nodes_wait);
    judge(self, self->slots, self->model->slot_count, has_values && !tick->slots_wait);
    if (self->over != NULL) {
        self->over(self->context, self);
    }
    if (!has_tail) {
        forget(self->nodes, 0, self->model->node_count);
    }
    for (uint32_t i = 0; !has_values && i < self->model->slot_count; i++) {
        self->slots[i].is_known = self->slots[i].is_known && self->slots[i].marked == self->mark;
    }
}

void decoder_silence(decoder_t *self)
{
    end_tick(self);
}

/** Ends the tick when nothing of it is awaited any more. */
static void end_if_complete(decoder_t *self)
{
    const decoder_tick_t *tick = &self->tick;

    if (self->is_at_hand && tick->inputs.came && !tick->arrivals_open && tick->snapshot_came == tick->has_snapshot &&
        tick->last_came == tick->has_changes && tick->values_came == tick->values) {
        end_tick(self);
    }
}

void decoder_stray(decoder_t *self)
{
    end_tick(self);
    forget(self->nodes, 0, self->model->node_count);
    self->strays++;
}

/** Everything is code 0 and value 0: the controller starts. */
static void know_start(decoder_cell_t *cells, uint16_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        cells[i].told = 0;
        cells[i].is_known = true;
    }
}

/** Nothing of the ticks before says anything of those that follow. */
static void start_again(decoder_t *self)
{
    forget(self->nodes, 0, self->model->node_count);
    forget(self->slots, 0, self->model->slot_count);
    for (uint32_t i = 0; i < self->model->node_count; i++) {
        self->nodes[i].is_certain = false;
    }
    for (uint32_t i = 0; i < self->model->slot_count; i++) {
        self->slots[i].is_certain = false;
    }
}

/** How many frames are missing between two CanopyTick frames: at least one of each tick that is, and as Sequence says. */
static uint64_t count_lost(const decoder_t *self, uint32_t ticks_missing, uint8_t sequence)
{
    uint32_t missing = ((uint32_t)sequence - self->first_seq - 1u - self->came) % SEQUENCES;

    return ticks_missing + (uint64_t)((missing - ticks_missing) % SEQUENCES);
}

static bool take_tick(decoder_t *self, const uint8_t *data)
{
    uint32_t number = decoder_u32(&data[2]);
    uint8_t sequence = data[6] & 0x3Fu;
    uint8_t root = data[7] & 7u;
    bool wraps = self->has_ticked && self->tick.number == UINT32_MAX && number == 0;
    bool goes_on = wraps || (self->has_ticked && number > self->tick.number);
    bool is_start = number == 0 && sequence == 0 && !wraps;

    if (data[1] >> 4 != DECODER_VERSION) {
        end_tick(self);
        self->stop = DECODER_OTHER_VERSION;
        return true;
    }
    if (root < 1u || root > 4u) {
        return false;
    }
    end_tick(self);
    if (goes_on) {
        self->lost += count_lost(self, number - self->tick.number - 1u, sequence);
        if (number - self->tick.number > 1u) {
            start_again(self);
        } else if (sequence != (self->sequence + 1u) % SEQUENCES) {
            forget(self->nodes, 0, self->model->node_count);
        }
    } else {
        self->starts += self->has_ticked || is_start ? 1u : 0u;
        self->health.pages = 0;
        self->has_upper = false;
        start_again(self);
    }
    if (is_start) {
        know_start(self->nodes, self->model->node_count);
        know_start(self->slots, self->model->slot_count);
    }
    memset(&self->tick, 0, sizeof self->tick);
    self->tick.number = number;
    self->tick.is_start = is_start;
    self->tick.root = root;
    self->tick.overruns = data[7] >> 6;
    self->tick.has_snapshot = (data[6] & 0x40u) != 0;
    self->tick.has_changes = (data[6] & 0x80u) != 0;
    self->tick.values = (data[7] >> 3) & 7u;
    self->is_at_hand = true;
    self->has_ticked = true;
    self->first_seq = self->sequence = sequence;
    self->came = 0;
    self->mark++;
    return true;
}

/** A frame with a Sequence has come. Returns whether it follows the one before. */
static bool follows(decoder_t *self, uint8_t sequence)
{
    bool is_next = sequence == (self->sequence + 1u) % SEQUENCES;

    self->sequence = sequence;
    self->came++;
    return is_next;
}

/**
 * How many frames with a Sequence behind the CanopyTick at hand a frame is. No real one of this tick is as far as what
 * comes behind the CanopyTick of another one, unless some 64 are missing.
 */
static unsigned place(const decoder_t *self, uint8_t sequence)
{
    return ((unsigned)sequence - self->first_seq) % SEQUENCES;
}

static void tell(const decoder_t *self, uint32_t node, uint8_t code)
{
    self->nodes[node].told = code;
    self->nodes[node].is_known = true;
    self->nodes[node].marked = self->mark;
}

static bool take_snapshot(decoder_t *self, const uint8_t *data)
{
    uint32_t first = (decoder_u16(&data[1]) & 0x1FFFu) * SNAPSHOT_NODES;
    uint8_t codes[SNAPSHOT_NODES];

    if (first >= self->model->node_count) {
        return false;
    }
    for (uint32_t i = 0; i < SNAPSHOT_NODES; i++) {
        codes[i] = i % 2u == 0 ? data[3u + i / 2u] & 15u : data[3u + i / 2u] >> 4;
        if ((codes[i] == NO_NODE) != (first + i >= self->model->node_count)) {
            return false;
        }
    }
    /* Nothing with a Sequence comes between a CanopyTick and its CanopySnapshot. */
    if (!follows(self, data[0] & 0x3Fu) || !self->is_at_hand || data[2] >> 5 != self->tick.number % 8u ||
        !self->tick.has_snapshot || self->tick.snapshot_came || self->tick.has_node || self->tick.values_came > 0) {
        decoder_stray(self);
        return true;
    }
    self->tick.snapshot_came = true;
    self->tick.inputs.is_sure = self->tick.inputs.came;
    for (uint32_t i = 0; i < SNAPSHOT_NODES && codes[i] != NO_NODE; i++) {
        tell(self, first + i, codes[i]);
    }
    return true;
}

/** The nodes that a CanopyChange names. */
typedef struct {
    uint8_t count;
    uint16_t node[ENTRIES];
    uint8_t code[ENTRIES];
} changes_t;

/** Reads the entries. Returns whether they can be: one node at least, and only nodes that exist. */
static bool read_changes(const decoder_t *self, const uint8_t *data, changes_t *changes)
{
    uint32_t position = 16u * (decoder_u16(&data[1]) & 0xFFFu);

    changes->count = 0;
    for (uint32_t i = 0; i < ENTRIES; i++) {
        uint8_t code = data[3u + i] & 15u;
        uint8_t gap = data[3u + i] >> 4;

        if (code == NO_NODE && gap == 15u) {
            break;
        }
        if (code == NO_NODE && gap == 14u) {
            return false;
        }
        if (code == NO_NODE) {
            position += 16u * (gap + 1u);
            continue;
        }
        position += gap;
        if (position >= self->model->node_count) {
            return false;
        }
        changes->node[changes->count] = (uint16_t)position;
        changes->code[changes->count++] = code;
        position++;
    }
    return changes->count > 0;
}

/** The nodes of a tick go up, begin once more at 0 at most, and end before the first one. */
static bool goes_round(const decoder_tick_t *tick, const changes_t *changes)
{
    uint16_t begin = changes->node[0];
    uint16_t end = changes->node[changes->count - 1u];
    bool wraps = tick->has_node && begin <= tick->last;

    if (!tick->has_node) {
        return true;
    }
    return wraps ? !tick->has_wrapped && end < tick->first : !tick->has_wrapped || end < tick->first;
}

/** Of the nodes behind `from` and before `to`, going around: they have the codes told last, or else nobody knows. */
static void pass_over(const decoder_t *self, uint16_t from, uint16_t to, bool is_gap)
{
    uint32_t count = self->model->node_count;

    for (uint32_t node = (from + 1u) % count; node != to; node = (node + 1u) % count) {
        if (is_gap) {
            self->nodes[node].is_known = false;
        } else {
            self->nodes[node].marked = self->mark;
        }
    }
}

static void use_changes(decoder_t *self, const changes_t *changes, bool is_next)
{
    decoder_tick_t *tick = &self->tick;

    tick->broken = tick->broken || !is_next;
    if (tick->has_node) {
        tick->has_wrapped = tick->has_wrapped || changes->node[0] <= tick->last;
        pass_over(self, tick->last, changes->node[0], !is_next);
    } else {
        if (!is_next) {
            forget(self->nodes, 0, self->model->node_count);
        }
        tick->has_node = true;
        tick->first = changes->node[0];
    }
    for (uint32_t i = 0; i < changes->count; i++) {
        if (i > 0) {
            pass_over(self, changes->node[i - 1u], changes->node[i], false);
        }
        tell(self, changes->node[i], changes->code[i]);
    }
    tick->last = changes->node[changes->count - 1u];
}

static bool take_change(decoder_t *self, const uint8_t *data)
{
    decoder_tick_t *tick = &self->tick;
    uint8_t more = data[0] >> 6;
    changes_t changes;
    unsigned at = place(self, data[0] & 0x3Fu);
    bool is_here = self->is_at_hand && data[2] >> 4 == tick->number % 16u && tick->has_changes && !tick->last_came &&
                   tick->values_came == 0 && at > place(self, self->sequence) &&
                   at <= self->model->changes_max + (tick->has_snapshot ? 1u : 0u);

    if (more > NODES_WAIT || !read_changes(self, data, &changes) || (is_here && !goes_round(tick, &changes))) {
        return false;
    }
    if (!is_here) {
        (void)follows(self, data[0] & 0x3Fu);
        decoder_stray(self);
        return true;
    }
    use_changes(self, &changes, follows(self, data[0] & 0x3Fu));
    tick->inputs.is_sure = tick->inputs.came;
    tick->last_came = more != MORE_FOLLOW;
    tick->nodes_wait = more == NODES_WAIT;
    return true;
}

void decoder_take(decoder_t *self, const canopy_can_frame_t *frame)
{
    static bool (*const take[MESSAGES])(decoder_t *self, const uint8_t *data) = {
        [TICK] = take_tick,     [INPUTS] = decoder_inputs, [ARRIVALS] = decoder_arrivals, [SNAPSHOT] = take_snapshot,
        [CHANGE] = take_change, [VALUE] = decoder_value,   [HEALTH] = decoder_health,     [MODEL] = decoder_tree};
    uint32_t message = frame->id - self->model->base;
    bool is_extended = (frame->flags & CANOPY_CAN_EXTENDED) != 0;

    if (self->stop != DECODER_RUNS || (frame->flags & CANOPY_CAN_ERROR) != 0 || message >= MESSAGES ||
        is_extended != self->model->is_extended) {
        return;
    }
    if ((frame->flags & ~(unsigned)CANOPY_CAN_EXTENDED) != 0 || frame->length != 8u ||
        !take[message](self, frame->data)) {
        self->refused++;
        return;
    }
    self->tick.is_followed = message != TICK;
    end_if_complete(self);
}
