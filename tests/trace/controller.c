/* SPDX-License-Identifier: MIT */
#include "controller.h"

#include <stddef.h>
#include <string.h>

#include "check.h"

static canopy_status_t leaf_tick(void *application, uint16_t index)
{
    const controller_t *self = application;

    return self->ref.nodes[index].answer;
}

static void leaf_halted(void *application, uint16_t index)
{
    (void)application;
    (void)index;
}

static const canopy_leaf_t leaf = {.tick = leaf_tick, .running = leaf_tick, .halted = leaf_halted};

static const uint8_t engine_types[] = {
    [REF_LEAF] = CANOPY_NODE_STATEFUL_ACTION,
    [REF_CONDITION] = CANOPY_NODE_CONDITION,
    [REF_SEQUENCE] = CANOPY_NODE_SEQUENCE,
    [REF_FALLBACK] = CANOPY_NODE_FALLBACK,
    [REF_REACTIVE_SEQUENCE] = CANOPY_NODE_REACTIVE_SEQUENCE,
    [REF_REACTIVE_FALLBACK] = CANOPY_NODE_REACTIVE_FALLBACK,
    [REF_PARALLEL_ALL] = CANOPY_NODE_PARALLEL_ALL,
    [REF_WHILE_DO_ELSE] = CANOPY_NODE_WHILE_DO_ELSE,
    [REF_INVERTER] = CANOPY_NODE_INVERTER,
    [REF_KEEP_RUNNING] = CANOPY_NODE_KEEP_RUNNING_UNTIL_FAILURE,
};

/** The engine's tables of the reference's tree. */
static void make_tables(controller_t *self)
{
    uint16_t words = 0;

    for (uint16_t i = 0; i < self->ref.count; i++) {
        const ref_node_t *node = &self->ref.nodes[i];
        bool is_leaf = node->kind == REF_LEAF || node->kind == REF_CONDITION;

        self->nodes[i] = (canopy_node_t){.type = engine_types[node->kind],
                                         .parent = node->parent,
                                         .end = node->end,
                                         .state = words,
                                         .parameter = is_leaf ? i : 0u};
        words = (uint16_t)(words + (node->kind == REF_SEQUENCE || node->kind == REF_FALLBACK ? 1u : 0u));
    }
    self->parameters[0] = 1;
    self->tree = (canopy_tree_t){.nodes = self->nodes,
                                 .leaves = &leaf,
                                 .parameters = self->parameters,
                                 .node_count = self->ref.count,
                                 .leaf_count = 1,
                                 .parameter_count = 1,
                                 .word_count = words,
                                 .hash = 0xC0FFEE00u + self->ref.count};
    CHECK(canopy_tree_validate(&self->tree, NULL) == CANOPY_OK);
}

static unsigned bytes_of(canopy_trace_kind_t kind)
{
    switch (kind) {
    case CANOPY_TRACE_U8:
    case CANOPY_TRACE_I8:
        return 1;
    case CANOPY_TRACE_U16:
    case CANOPY_TRACE_I16:
        return 2;
    case CANOPY_TRACE_WORD:
    case CANOPY_TRACE_FLOAT:
        return 4;
    case CANOPY_TRACE_LOW:
    case CANOPY_TRACE_HIGH:
    case CANOPY_TRACE_DOUBLE_LOW:
    case CANOPY_TRACE_DOUBLE_HIGH:
        break;
    }
    return 8;
}

/** Entries of every type, and their slots. */
static void make_values(controller_t *self)
{
    static const canopy_trace_kind_t kinds[] = {CANOPY_TRACE_WORD, CANOPY_TRACE_U8,        CANOPY_TRACE_I8,
                                                CANOPY_TRACE_U16,  CANOPY_TRACE_I16,       CANOPY_TRACE_FLOAT,
                                                CANOPY_TRACE_LOW,  CANOPY_TRACE_DOUBLE_LOW};
    enum { OF_32_BITS = 6, ALL = sizeof kinds / sizeof kinds[0] };
    uint16_t slots = 0;
    uint16_t most = (uint16_t)random_below(&self->random, SLOTS_MAX);

    for (self->entry_count = 0; slots < most; self->entry_count++) {
        canopy_trace_kind_t kind = kinds[random_below(&self->random, slots + 1u < most ? ALL : OF_32_BITS)];
        uint32_t offset = (uint32_t)offsetof(controller_t, memory) + 8u * self->entry_count;

        self->entries[self->entry_count].kind = kind;
        self->values[slots++] = (canopy_trace_value_t){.offset = offset, .kind = (uint8_t)kind};
        if (bytes_of(kind) == 8u) {
            self->values[slots++] = (canopy_trace_value_t){.offset = offset, .kind = (uint8_t)(kind + 1)};
        }
    }
    self->config.value_count = slots;
    self->config.values = self->values;
    self->config.values_max = (uint8_t)(slots == 0 ? 0u : 1u + random_below(&self->random, CANOPY_TRACE_VALUES_MAX));
}

static int take_out(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    controller_t *self = context;

    (void)mailbox;
    if (self->room == 0) {
        return 0;
    }
    self->room--;
    CHECK(self->out_count < OUT_MAX);
    self->out[self->out_count++] = *frame;
    return 1;
}

static int nothing_comes(void *context, canopy_can_frame_t *frame)
{
    (void)context;
    (void)frame;
    return 0;
}

void controller_make(controller_t *self, uint64_t seed, const controller_mood_t *mood, uint16_t flat)
{
    memset(self, 0, sizeof *self);
    self->mood = *mood;
    self->random = random_seed(seed);
    if (flat > 0) {
        ref_make_flat(&self->ref, flat);
    } else {
        ref_make(&self->ref, &self->random, random_chance(&self->random, 30) ? NODES_MAX : 200u);
    }
    make_tables(self);
    self->config = (canopy_trace_config_t){
        .id = CONTROLLER_ID,
        .changes_max = (uint8_t)(1u + random_below(&self->random, 8)),
        .data_id = random_chance(&self->random, 200) ? (int32_t)random_below(&self->random, 65536) : CANOPY_E2E_NONE,
        .snapshot_every = (uint16_t)(1u + random_below(&self->random, 4)),
        .values_every = (uint16_t)(1u + random_below(&self->random, 8)),
        .health_every = (uint16_t)(1u + random_below(&self->random, 8)),
        .model_every = (uint16_t)(1u + random_below(&self->random, 20))};
    make_values(self);
    self->can = (canopy_can_t){.context = self, .receive = nothing_comes, .send = take_out};
    self->bus =
        (canopy_bus_t){.rx = self->rx_messages, .rx_count = (uint16_t)random_below(&self->random, MESSAGES_MAX + 1u)};
    for (unsigned i = 0; i < MESSAGES_MAX; i++) {
        self->rx_messages[i] = (canopy_rx_message_t){.id = 0x100u + i, .length = 8, .data_id = CANOPY_E2E_NONE};
    }
}

void controller_start(controller_t *self, uint32_t number)
{
    const canopy_tx_memory_t memory = {.trace = self->ring, .trace_capacity = RING};

    ref_start(&self->ref);
    memset(&self->state, 0xA5, sizeof self->state); /* of the run before */
    memset(self->sent, 0xA5, sizeof self->sent);
    memset(self->told, 0xA5, sizeof self->told);
    memset(self->rx, 0, sizeof self->rx);
    self->state.sent = self->sent;
    self->state.told = self->told;
    self->bus_state = (canopy_bus_state_t){.bus = &self->bus, .rx = self->rx};
    CHECK(canopy_tree_init(&self->instance, &self->tree, self->status, self->words, self) == CANOPY_OK);
    CHECK(canopy_tx_init(&self->tx, NULL, 0, &memory, &self->can) == CANOPY_OK);
    canopy_trace_start(&self->config, &self->state, self->tree.node_count);
    self->number = number;
    self->ticks += self->ticks > 0 ? CANOPY_TRACE_PERIODS : 0;
    self->first = self->ticks;
}

static void answer(controller_t *self)
{
    for (uint16_t i = 0; i < self->ref.count; i++) {
        ref_node_t *node = &self->ref.nodes[i];

        if (random_chance(&self->random, self->mood.leaf_flips)) {
            uint32_t kinds = node->kind == REF_CONDITION ? 3u : 4u;
            static const canopy_status_t statuses[] = {CANOPY_SUCCESS, CANOPY_FAILURE, CANOPY_SKIPPED, CANOPY_RUNNING};

            node->answer = statuses[random_below(&self->random, kinds)];
        }
    }
}

/** A value in memory, as C has it. */
static void store(uint8_t *place, canopy_trace_kind_t kind, uint64_t value)
{
    switch (bytes_of(kind)) { /* of an object of that size: the order of the bytes is the machine's */
    case 1:
        *place = (uint8_t)value;
        break;
    case 2:
        memcpy(place, &(uint16_t){(uint16_t)value}, sizeof(uint16_t));
        break;
    case 4:
        memcpy(place, &(uint32_t){(uint32_t)value}, sizeof(uint32_t));
        break;
    default:
        memcpy(place, &value, sizeof value);
        break;
    }
}

/** Values change, in memory and in the truth. */
static void change_values(controller_t *self, truth_t *truth)
{
    uint16_t slot = 0;

    for (uint16_t i = 0; i < self->entry_count; i++) {
        canopy_trace_kind_t kind = self->entries[i].kind;
        unsigned bits = 8u * bytes_of(kind);
        uint64_t value = self->entries[i].value;

        if (random_chance(&self->random, self->mood.value_flips)) {
            value = random_bits(&self->random) | (uint64_t)random_bits(&self->random) << 32;
            if (random_chance(&self->random, 300)) {
                value = (uint64_t)0 - random_below(&self->random, 3u);
            }
            value &= UINT64_MAX >> (64u - bits);
            self->entries[i].value = value;
        }
        store(&self->memory[(size_t)8u * i], kind, value);
        if ((kind == CANOPY_TRACE_I8 || kind == CANOPY_TRACE_I16) && (value >> (bits - 1u) & 1u) != 0) {
            value |= UINT64_MAX << bits;
        }
        truth->values[slot++] = (uint32_t)value;
        if (bits == 64u) {
            truth->values[slot++] = (uint32_t)(value >> 32);
        }
    }
    CHECK(slot == self->config.value_count);
}

static void add_age(truth_t *truth, uint16_t age)
{
    if (age < 255u) {
        truth->ages[truth->age_bytes++] = (uint8_t)age;
    } else {
        truth->ages[truth->age_bytes++] = 255u;
        truth->ages[truth->age_bytes++] = (uint8_t)age;
        truth->ages[truth->age_bytes++] = (uint8_t)(age >> 8);
    }
}

/** Frames that were taken: as the bus's state has it, and as docs/trace.md has it. */
static void take_frames(controller_t *self, truth_t *truth)
{
    uint32_t often = random_below(&self->random, 1001u);
    uint32_t frames = 0;

    truth->age_bytes = 0;
    for (uint16_t i = 0; i < self->bus.rx_count; i++) {
        self->rx[i].taken_then = random_chance(&self->random, often);
        if (self->rx[i].taken_then) {
            frames += random_chance(&self->random, 20) ? 1u + random_below(&self->random, 500) : 1u;
            self->rx[i].age_ms =
                (uint16_t)random_below(&self->random, random_chance(&self->random, 300) ? 65536u : 300u);
        }
    }
    truth->many = frames >= 256u;
    for (unsigned i = 0; truth->many && i < 4u; i++) {
        truth->ages[truth->age_bytes++] = (uint8_t)(frames >> (8u * i));
    }
    for (uint16_t i = 0; i < self->bus.rx_count; i++) {
        if (self->rx[i].taken_then) {
            add_age(truth, self->rx[i].age_ms);
        }
    }
    self->bus_state.taken += frames;
    self->bus_state.check = (uint8_t)random_below(&self->random, 256u);
    truth->taken = self->bus_state.taken;
    truth->check = self->bus_state.check;
}

/** Compares with the tick before: since when each code and value is. */
static void note_changes(const controller_t *self, truth_t *truth)
{
    const truth_t *before = self->ticks == self->first ? NULL : controller_truth(self, self->ticks - 1u);

    truth->changed_nodes = truth->changed_slots = 0;
    for (uint16_t i = 0; i < self->ref.count; i++) {
        truth->codes[i] = ref_code(&self->ref.nodes[i]);
        if (before != NULL && before->codes[i] == truth->codes[i]) {
            truth->since[i] = before->since[i];
        } else {
            truth->since[i] = self->ticks;
            truth->changed_nodes++;
        }
    }
    for (uint16_t i = 0; i < self->config.value_count; i++) {
        if (before != NULL && before->values[i] == truth->values[i]) {
            truth->values_since[i] = before->values_since[i];
        } else {
            truth->values_since[i] = self->ticks;
            truth->changed_slots++;
        }
    }
}

void controller_tick(controller_t *self)
{
    truth_t *truth = &self->truth[self->ticks % HISTORY];
    canopy_cycle_t cycle = {.now = 5u + self->ticks * CONTROLLER_PERIOD_US};
    canopy_trace_tick_t sent = {.tick = self->number,
                                .overruns = self->number,
                                .cycle = &cycle,
                                .bus = &self->bus_state,
                                .until = cycle.now + (canopy_time_t)CANOPY_TRACE_PERIODS * CONTROLLER_PERIOD_US,
                                .returning = random_chance(&self->random, 100)};

    cycle.can_state = (canopy_can_state_t)random_below(&self->random, 7u);
    cycle.overload = random_chance(&self->random, 100);
    truth->number = self->number;
    truth->now = cycle.now;
    truth->can_state = (uint8_t)cycle.can_state;
    truth->overload = cycle.overload;
    truth->returning = sent.returning;
    answer(self);
    truth->root = ref_tick(&self->ref);
    change_values(self, truth);
    take_frames(self, truth);
    note_changes(self, truth);
    sent.root = canopy_tree_tick(&self->instance, cycle.now);
    CHECK(sent.root == truth->root);
    canopy_trace_send(&self->config, &self->state, &self->instance, &self->tx, &sent);
    self->out_count = 0;
    self->room = self->mood.bus_frames == 0 ? OUT_MAX : self->mood.bus_frames;
    canopy_tx_service(&self->tx, cycle.now);
    self->ticks++;
    self->number++;
}

const truth_t *controller_truth(const controller_t *self, uint64_t tick)
{
    const truth_t *truth = &self->truth[tick % HISTORY];

    return tick > self->ticks || self->ticks - tick >= HISTORY ? NULL : truth;
}

uint32_t controller_dropped(const controller_t *self)
{
    canopy_tx_counters_t counters;

    canopy_tx_count(&self->tx, &counters);
    return counters.trace_dropped;
}
