/* SPDX-License-Identifier: MIT */
#include "judge.h"

#include <inttypes.h>
#include <string.h>

#include "check.h"

uint32_t judge_known_within(const controller_t *controller)
{
    uint32_t parts = (controller->ref.count + 9u) / 10u;
    uint32_t nodes = parts * controller->config.snapshot_every;
    uint32_t values = (uint32_t)controller->config.value_count * controller->config.values_every;

    return nodes > values ? nodes : values;
}

/** The tick, counted like controller_t.ticks, of a number that was told in the tick at hand or before. */
static uint64_t absolute(const judge_t *self, uint32_t number)
{
    uint32_t ago = self->decoder.tick.number - number; /* modulo 2^32 */

    return self->tick - ago;
}

/** Nothing wrong is certain: what is, and since when. */
static void judge_cells(judge_t *self, const decoder_cell_t *cells, uint16_t count, const uint32_t *truth,
                        const uint64_t *since)
{
    for (uint16_t i = 0; i < count; i++) {
        if (cells[i].is_certain) {
            uint64_t told = absolute(self, cells[i].since);

            self->tally->wrong += cells[i].shown != truth[i] ? 1u : 0u;
            CHECK(self->only_counts || cells[i].shown == truth[i]);
            CHECK(self->only_counts || (cells[i].is_since_exact ? told == since[i] : told >= since[i]));
        }
    }
}

static void judge_inputs(const judge_t *self, const truth_t *truth)
{
    const decoder_inputs_t *inputs = &self->decoder.tick.inputs;
    bool is_free = self->controller->mood.bus_frames == 0 && !(self->has_lost && self->any_lost_in >= self->tick);

    CHECK(!is_free || (inputs->came && inputs->is_whole && inputs->age_bytes == truth->age_bytes));

    if (!inputs->came || !inputs->is_sure) {
        return;
    }
    CHECK(inputs->now == (truth->now & 0xFFFFFFu));
    CHECK(inputs->taken == (uint8_t)truth->taken && inputs->check == truth->check);
    CHECK(inputs->can_state == truth->can_state && inputs->overload == truth->overload);
    CHECK(inputs->returning == truth->returning && inputs->many == truth->many);
    CHECK(inputs->age_bytes <= truth->age_bytes);
    if (inputs->age_bytes == truth->age_bytes) {
        CHECK(memcmp(inputs->ages, truth->ages, truth->age_bytes) == 0);
    }
    self->tally->inputs++;
}

/** Counts them, and says whether all are certain. */
static bool count(const decoder_cell_t *cells, uint16_t number, uint64_t *certain, uint64_t *old, uint64_t *unknown)
{
    uint64_t before = *certain;

    for (uint16_t i = 0; i < number; i++) {
        *certain += cells[i].is_certain ? 1u : 0u;
        *old += !cells[i].is_certain && cells[i].is_known ? 1u : 0u;
        *unknown += !cells[i].is_certain && !cells[i].is_known ? 1u : 0u;
    }
    return *certain - before == number;
}

static bool all_known(const decoder_cell_t *cells, uint16_t number)
{
    bool all = true;

    for (uint16_t i = 0; i < number; i++) {
        all = all && cells[i].is_known;
    }
    return all;
}

/** What has not changed too much is certain, and what was lost is known again in time. */
static void judge_whole(judge_t *self, const truth_t *truth)
{
    const controller_t *controller = self->controller;
    tally_t *tally = self->tally;
    bool nodes =
        count(self->nodes, self->model.node_count, &tally->nodes_certain, &tally->nodes_old, &tally->nodes_unknown);
    bool slots =
        count(self->slots, self->model.slot_count, &tally->slots_certain, &tally->slots_old, &tally->slots_unknown);
    bool begins = self->tick == controller->first && truth->number == 0;
    bool follows = begins || (self->has_shown && self->last_shown + 1u == self->tick);
    uint64_t ago = self->tick > self->lost_in ? self->tick - self->lost_in : 0;

    if (!self->is_disturbed && follows) {
        /* One CanopyChange has room for one node at least, and for five that are close. One CanopyValue may be a slow one. */
        CHECK(nodes || !(begins || self->was_all_certain) || truth->changed_nodes > controller->config.changes_max);
        CHECK(slots || !(begins || self->were_slots_certain) || truth->changed_slots >= controller->config.values_max);
    }
    self->was_all_certain = nodes;
    self->were_slots_certain = slots;
    if (self->is_disturbed && ago > 0 && all_known(self->nodes, self->model.node_count) &&
        all_known(self->slots, self->model.slot_count)) {
        self->is_disturbed = false;
        if (ago > tally->known_after) {
            tally->known_after = (uint32_t)ago;
            tally->promised = judge_known_within(controller);
        }
    }
    /* Frames may be up to four periods behind their tick. */
    CHECK(!self->is_disturbed || ago <= judge_known_within(controller) + (controller->mood.bus_frames > 0 ? 5u : 0u));
}

/** What has changed of the cells since the tick shown before: for the other decoder. */
static void log_cells(const judge_t *self, const char *kind, const decoder_cell_t *cells, decoder_cell_t *logged,
                      uint16_t number)
{
    for (uint16_t i = 0; i < number; i++) {
        const decoder_cell_t *cell = &cells[i];

        if (cell->is_certain == logged[i].is_certain && cell->is_known == logged[i].is_known &&
            cell->told == logged[i].told && cell->shown == logged[i].shown && cell->since == logged[i].since &&
            cell->is_since_exact == logged[i].is_since_exact) {
            continue;
        }
        logged[i] = *cell;
        if (cell->is_certain) {
            (void)fprintf(self->log, " %s%u=%u,%u,%u", kind, (unsigned)i, (unsigned)cell->shown, (unsigned)cell->since,
                          cell->is_since_exact ? 1u : 0u);
        } else if (cell->is_known) {
            (void)fprintf(self->log, " %s%u=%u", kind, (unsigned)i, (unsigned)cell->told);
        } else {
            (void)fprintf(self->log, " %s%u=", kind, (unsigned)i);
        }
    }
}

static void log_tick(judge_t *self)
{
    if (self->log == NULL) {
        return;
    }
    (void)fprintf(self->log, "T %u", (unsigned)self->decoder.tick.number);
    log_cells(self, "", self->nodes, self->logged_nodes, self->model.node_count);
    log_cells(self, "v", self->slots, self->logged_slots, self->model.slot_count);
    (void)fputc('\n', self->log);
}

static void show(void *context, const decoder_t *decoder)
{
    judge_t *self = context;
    const truth_t *truth = controller_truth(self->controller, self->tick);
    uint32_t codes[NODES_MAX];

    if (self->channel->damaged > 0) {
        self->tally->shown++;
        log_tick(self);
        return;
    }
    CHECK(truth != NULL);
    CHECK(decoder->tick.number == truth->number);
    CHECK(decoder->tick.root == (uint8_t)truth->root);
    CHECK(decoder->tick.overruns == truth->number % 4u);
    for (uint16_t i = 0; i < self->model.node_count; i++) {
        codes[i] = truth->codes[i];
    }
    judge_cells(self, self->nodes, self->model.node_count, codes, truth->since);
    judge_cells(self, self->slots, self->model.slot_count, truth->values, truth->values_since);
    if (self->only_counts) {
        self->tally->shown++;
        return;
    }
    judge_inputs(self, truth);
    judge_whole(self, truth);
    self->has_shown = true;
    self->last_shown = self->tick;
    self->tally->shown++;
    log_tick(self);
}

void judge_start(judge_t *self, const controller_t *controller, const channel_t *channel, uint64_t seed, tally_t *tally,
                 FILE *log)
{
    *self = (judge_t){.controller = controller,
                      .channel = channel,
                      .random = random_seed(seed),
                      .is_disturbed = controller->number != 0,
                      .lost_in = controller->ticks,
                      .was_all_certain = true,
                      .were_slots_certain = true,
                      .has_clock = true,
                      .tally = tally,
                      .log = log};
    self->model = (decoder_model_t){.base = CONTROLLER_ID,
                                    .hash = controller->tree.hash,
                                    .node_count = controller->tree.node_count,
                                    .changes_max = controller->config.changes_max,
                                    .slot_count = controller->config.value_count};
    decoder_init(&self->decoder, &self->model, self->nodes, self->slots, show, self);
    if (log != NULL) {
        (void)fprintf(log, "M %08X %u %u %u %d\n", (unsigned)self->model.hash, (unsigned)self->model.node_count,
                      (unsigned)self->model.slot_count, (unsigned)self->model.changes_max,
                      (int)controller->config.data_id);
    }
}

static bool is_lost(judge_t *self)
{
    if (self->burst > 0) {
        self->burst--;
        return true;
    }
    if (random_chance(&self->random, self->channel->bursts)) {
        self->burst = random_below(&self->random, self->channel->burst_most);
        return true;
    }
    return random_chance(&self->random, self->channel->of_1000);
}

/** Flips a bit, but none of those that stop a decoder: CanopyModel, and Version in CanopyTick. */
static void damage(judge_t *self, canopy_can_frame_t *frame)
{
    uint32_t bit = random_below(&self->random, 64u);

    if (random_chance(&self->random, self->channel->damaged) && frame->id != CONTROLLER_ID + 7u &&
        !(frame->id == CONTROLLER_ID && bit / 4u == 3u)) {
        frame->data[bit / 8u] ^= (uint8_t)(1u << bit % 8u);
    }
}

static void hear(judge_t *self, const canopy_can_frame_t *frame, uint64_t tick)
{
    bool is_tick = frame->id == CONTROLLER_ID;

    if (self->log != NULL) {
        (void)fprintf(self->log, "F %" PRIu32 " ", frame->id - CONTROLLER_ID);
        for (unsigned i = 0; i < frame->length; i++) {
            (void)fprintf(self->log, "%02X", frame->data[i]);
        }
        (void)fputc('\n', self->log);
    }
    if (is_tick) {
        uint32_t number = decoder_u32(&frame->data[2]);

        bool goes_on = number > self->decoder.tick.number || (number == 0 && self->decoder.tick.number == UINT32_MAX);

        self->lost_told += self->decoder.has_ticked && goes_on ? self->lost_since : 0;
        self->is_lost_less = self->is_lost_less || self->lost_since >= 64u;
        self->lost_since = 0;
    }
    decoder_take(&self->decoder, frame);
    if (is_tick) {
        uint32_t ago = self->controller->number - 1u - self->decoder.tick.number; /* modulo 2^32 */

        self->tick = tick - ago;
        self->came_in = tick;
    }
}

/** Each frame has the next Sequence, but for 0 together with Tick 0 where the number wraps around: that one is left out. */
static void judge_sequence(judge_t *self, const uint8_t *data, uint64_t tick)
{
    uint8_t sequence = *data & 0x3Fu;
    bool is_next = sequence == (self->sent + 1u) % 64u;

    if (tick == self->controller->first && !self->has_sent) {
        CHECK(sequence == 0);
    } else if (self->has_sent && !is_next) {
        CHECK(sequence == 1u && self->sent == 63u && self->controller->number == 1u);
        self->lost_since++;
    }
    self->has_sent = true;
    self->sent = sequence;
}

/** CanopyTick's E2E counter: 0 to 14, one more in each tick. (The CRC is looked at by the other decoder.) */
static void judge_guard(judge_t *self, const uint8_t *data)
{
    uint8_t counter = data[1] & 0x0Fu;

    if (self->controller->config.data_id == CANOPY_E2E_NONE) {
        CHECK(counter == 0 && data[0] == 0);
    } else {
        CHECK(self->has_sent ? counter == (self->counter + 1u) % 15u : counter < 15u);
    }
    self->counter = counter;
}

void judge_tick(judge_t *self)
{
    const controller_t *controller = self->controller;
    uint64_t tick = controller->ticks - 1u;
    uint32_t dropped = controller_dropped(controller);

    self->tally->ticks++;
    if (dropped != self->dropped ||
        (controller->number == 1u && tick != controller->first)) { /* see judge_sequence() */
        self->dropped = dropped;
        self->is_disturbed = true;
        self->lost_in = tick;
    }
    for (uint16_t i = 0; i < controller->out_count; i++) {
        canopy_can_frame_t frame = controller->out[i];
        uint32_t message = frame.id - CONTROLLER_ID;
        bool has_sequence = message == 0 || message == 3u || message == 4u;

        self->tally->frames++;
        for (unsigned byte = message == 2u ? 1u + (frame.data[0] >> 4 & 7u) : 8u; byte < 8u; byte++) {
            CHECK(frame.data[byte] == 0); /* not used by CanopyArrivals */
        }
        if (message == 0 && controller->mood.bus_frames == 0) {
            judge_guard(self, frame.data);
        }
        if (has_sequence && controller->mood.bus_frames == 0) {
            judge_sequence(self, &frame.data[message == 0 ? 6 : 0], tick);
        }
        if (self->has_clock && self->decoder.is_at_hand && tick - self->came_in >= CANOPY_TRACE_PERIODS) {
            if (self->log != NULL) {
                (void)fputs("S\n", self->log);
            }
            decoder_silence(&self->decoder);
        }
        if ((i >= self->silent_from && i < self->silent_to) || is_lost(self)) {
            self->tally->lost++;
            self->any_lost_in = tick;
            self->has_lost = true;
            self->lost_since += has_sequence ? 1u : 0u;
            if (has_sequence || message == 5u) {
                self->is_disturbed = true;
                self->lost_in = tick;
            }
        } else {
            damage(self, &frame);
            hear(self, &frame, tick);
        }
    }
    CHECK(self->decoder.stop == DECODER_RUNS);
    CHECK(self->only_counts || self->channel->damaged > 0 || self->decoder.refused == 0);
}

void judge_note_start(judge_t *self)
{
    self->dropped = 0;
    self->has_sent = false;
    self->lost_in = self->controller->ticks;
    self->is_disturbed = self->is_disturbed || self->controller->mood.bus_frames > 0;
}

void judge_end(judge_t *self)
{
    if (self->log != NULL) {
        (void)fputs("S\n", self->log);
    }
    if (self->controller->mood.bus_frames > 0) { /* what has not left yet is lost here */
        self->is_disturbed = true;
        self->lost_in = self->controller->ticks;
    }
    decoder_silence(&self->decoder);
    if (self->log != NULL) {
        (void)fprintf(self->log, "E %u\n", (unsigned)self->decoder.refused);
    }
    if (self->controller->mood.bus_frames == 0 && self->channel->damaged == 0) {
        CHECK(self->is_lost_less ? self->decoder.lost <= self->lost_told : self->decoder.lost == self->lost_told);
    }
}
