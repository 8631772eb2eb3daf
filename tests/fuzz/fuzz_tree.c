/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Any table, any answers of leaves, scripts and control nodes: what canopy_tree_validate() accepts ticks, halts and resets
 * without leaving its memory, ticks no node twice and halts what was RUNNING and nothing else; what it does not accept is
 * refused with a node.
 *
 * Two kinds of input: raw tables, which mostly are refused, and tables that are built well-formed and may then be
 * damaged in one place, so that the search soon gets to the ticks.
 */
#include <string.h>

#include "canopy/node.h"
#include "canopy/trace.h"
#include "input.h"

enum { NODES = 40, WORDS = 80, PARAMETERS = 48, TICKS_MAX = 64, DEPTH_MAX = 8, GUARD = 0xA5 };

static input_t input;
static canopy_tree_instance_t *instance;
static uint8_t ticked[NODES];
static bool running[NODES];

/* --- leaves, scripts and control nodes that answer from the input; a leaf's parameter is its node ------------------- */

static canopy_status_t answer(uint16_t node)
{
    uint8_t byte = take8(&input);
    /* Mostly statuses, sometimes anything. */
    canopy_status_t status = (canopy_status_t)(byte < 240u ? 1u + byte % 4u : byte);

    EXPECT(node >= NODES || ++ticked[node] == 1u);
    return status;
}

static canopy_status_t leaf_start(void *application, uint16_t node)
{
    (void)application;
    EXPECT(node >= NODES || !running[node]);
    return answer(node);
}

static canopy_status_t action_start(void *application, uint16_t node)
{
    canopy_status_t status = leaf_start(application, node);

    if (node < NODES) {
        running[node] = status == CANOPY_RUNNING;
    }
    return status;
}

static canopy_status_t action_running(void *application, uint16_t node)
{
    canopy_status_t status = answer(node);

    (void)application;
    if (node < NODES) {
        EXPECT(running[node]);
        running[node] = status == CANOPY_RUNNING;
    }
    return status;
}

static void action_halted(void *application, uint16_t node)
{
    (void)application;
    if (node < NODES) {
        EXPECT(running[node]);
        running[node] = false;
    }
}

static const canopy_leaf_t leaves[] = {
    {.tick = leaf_start}, {.tick = action_start, .running = action_running, .halted = action_halted}, {.tick = NULL}};

static int32_t script(void *application)
{
    uint8_t byte = take8(&input);

    (void)application;
    return byte < 250u ? (int32_t)(byte % 8u) - 1 : (int32_t)take32(&input);
}

static const canopy_script_t scripts[] = {script, NULL, script};

/** Any step: of an own child most of the time. */
static canopy_step_t control_enter(canopy_tree_instance_t *self, uint16_t node)
{
    uint8_t byte = take8(&input);

    (void)self;
    return byte < 128u   ? node + 1u
           : byte < 224u ? canopy_done((canopy_status_t)(byte % 6u))
                         : take32(&input) % 0x10010u;
}

static canopy_step_t control_child(canopy_tree_instance_t *self, uint16_t node, uint16_t child, canopy_status_t status)
{
    uint8_t byte = take8(&input);

    (void)node;
    return byte < 96u    ? canopy_done(status)
           : byte < 192u ? self->tree->nodes[child].end
           : byte < 224u ? canopy_done((canopy_status_t)(byte % 6u))
                         : take32(&input) % 0x10010u;
}

static void control_halt(canopy_tree_instance_t *self, uint16_t node)
{
    EXPECT(canopy_resumes(self, node));
}

static const canopy_control_t controls[] = {{.enter = control_enter, .child = control_child, .halt = control_halt},
                                            {.enter = control_enter, .child = control_child},
                                            {.enter = NULL}};

/* --- tables --------------------------------------------------------------------------------------------------------- */

typedef struct {
    canopy_node_t nodes[NODES];
    int32_t parameters[PARAMETERS];
    canopy_tree_t tree;
    uint16_t words;
} tables_t;

static const uint8_t least_children[CANOPY_NODE_TYPES] = {
#define CANOPY_NODE(id, name, category, least, most, words, count, parameters, text) [CANOPY_NODE_##id] = (least),
#include "canopy/nodes.def"
#undef CANOPY_NODE
};
static const uint16_t most_children[CANOPY_NODE_TYPES] = {
#define CANOPY_NODE(id, name, category, least, most, words, count, parameters, text) [CANOPY_NODE_##id] = (most),
#include "canopy/nodes.def"
#undef CANOPY_NODE
};
static const uint8_t word_counts[CANOPY_NODE_TYPES] = {
#define CANOPY_NODE(id, name, category, least, most, words, count, parameters, text) [CANOPY_NODE_##id] = (words),
#include "canopy/nodes.def"
#undef CANOPY_NODE
};

static void any_tables(tables_t *tables)
{
    tables->tree.node_count = take8(&input) % (NODES + 1u);
    for (uint16_t node = 0; node < tables->tree.node_count; node++) {
        tables->nodes[node] = (canopy_node_t){.type = take8(&input),
                                              .parent = take8(&input) % (NODES + 2u),
                                              .end = take8(&input) % (NODES + 2u),
                                              .state = take8(&input) % (WORDS + 2u),
                                              .leaf = take8(&input) % 4u,
                                              .parameter = take8(&input) % (PARAMETERS + 2u)};
    }
    tables->tree.word_count = take8(&input) % (WORDS + 1u);
    tables->tree.parameter_count = take8(&input) % (PARAMETERS + 1u);
}

/** One node and what is below it, depth first: types of the input, children as many as there may be. */
static uint16_t grow(tables_t *tables, uint16_t node, uint16_t parent, unsigned depth)
{
    uint8_t type =
        depth < (unsigned)DEPTH_MAX ? take8(&input) % CANOPY_NODE_TYPES : (uint8_t)CANOPY_NODE_STATEFUL_ACTION;
    uint16_t most = most_children[type] < 6u ? most_children[type] : 6u;
    uint16_t children = most > least_children[type]
                            ? (uint16_t)(least_children[type] + take8(&input) % (most + 1u - least_children[type]))
                            : most;
    uint16_t next = (uint16_t)(node + 1u);
    bool is_control = type == CANOPY_NODE_USER_CONTROL || type == CANOPY_NODE_USER_DECORATOR;
    bool is_leaf = type <= CANOPY_NODE_STATEFUL_ACTION;

    tables->nodes[node] = (canopy_node_t){.type = type, .parent = parent, .state = tables->words};
    tables->nodes[node].leaf = is_control ? take8(&input) % 2u : type == CANOPY_NODE_STATEFUL_ACTION ? 1u : 0u;
    tables->nodes[node].parameter = is_leaf ? node : take8(&input) % (PARAMETERS - 8u);
    tables->words = (uint16_t)(tables->words + word_counts[type]);
    for (uint16_t child = 0; child < children && next < NODES; child++) {
        next = grow(tables, next, node, depth + 1u);
    }
    tables->nodes[node].end = next;
    return next;
}

static void grown_tables(tables_t *tables)
{
    tables->tree.node_count = grow(tables, 0, 0, 0);
    tables->tree.word_count = tables->words < WORDS ? tables->words : WORDS;
    tables->tree.parameter_count = PARAMETERS;
    for (unsigned damage = take8(&input) % 4u; damage > 0u; damage--) {
        canopy_node_t *node = &tables->nodes[take8(&input) % tables->tree.node_count];
        uint16_t *const fields[] = {&node->parent, &node->end, &node->state, &node->leaf, &node->parameter};
        uint8_t field = take8(&input) % 8u;

        if (field < sizeof fields / sizeof fields[0]) {
            *fields[field] = take8(&input) % (NODES + 8u);
        } else if (field == 5u) {
            node->type = take8(&input);
        } else {
            node->state = tables->nodes[take8(&input) % tables->tree.node_count].state;
        }
    }
}

static void make_tables(tables_t *tables)
{
    uint8_t kind = take8(&input);

    *tables = (tables_t){.tree = {.leaves = leaves,
                                  .controls = controls,
                                  .scripts = scripts,
                                  .leaf_count = 3,
                                  .control_count = 3,
                                  .script_count = 3}};
    tables->tree.nodes = tables->nodes;
    tables->tree.parameters = tables->parameters;
    for (unsigned which = 0; which < PARAMETERS; which++) {
        uint8_t byte = take8(&input);

        tables->parameters[which] = byte < 250u ? (int32_t)(byte % 9u) - 2 : (int32_t)take32(&input);
    }
    if (kind % 4u == 0u) {
        any_tables(tables);
    } else {
        grown_tables(tables);
    }
}

/* --- the run --------------------------------------------------------------------------------------------------------- */

static int take_frame(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    (void)context;
    (void)mailbox;
    EXPECT(frame->length == 8u);
    return take8(&input) % 3u == 0u ? 0 : 1;
}

/** Every stateful action is RUNNING for the engine when it thinks so itself, unless its table is shared by leaves. */
static void expect_same_view(void)
{
    for (uint16_t node = 0; node < instance->tree->node_count; node++) {
        const canopy_node_t *row = &instance->tree->nodes[node];

        EXPECT(canopy_tree_status_code(instance, node) < CANOPY_CODE_NONE);
        if (row->type == CANOPY_NODE_STATEFUL_ACTION && row->leaf == 1u && row->parameter == node) {
            EXPECT(running[node] == (canopy_tree_status(instance, node) == CANOPY_RUNNING));
        }
    }
}

static bool is_child(uint16_t node, uint16_t child)
{
    const canopy_node_t *nodes = instance->tree->nodes;

    return child > node && child < nodes[node].end && nodes[child].parent == node;
}

/** What the state words of a node may hold between two ticks. */
static void expect_good_words(uint16_t node, const canopy_node_t *row)
{
    const uint16_t *words = &instance->words[row->state];
    bool is_running = canopy_tree_status(instance, node) == CANOPY_RUNNING;

    switch (row->type) {
    case CANOPY_NODE_SEQUENCE:
    case CANOPY_NODE_FALLBACK:
    case CANOPY_NODE_IF_THEN_ELSE:
    case CANOPY_NODE_TRY_CATCH:
    case CANOPY_NODE_SWITCH:
        EXPECT(!is_running || is_child(node, words[0]));
        EXPECT(!is_running || canopy_tree_status(instance, words[0]) == CANOPY_RUNNING);
        break;
    case CANOPY_NODE_ASYNC_SEQUENCE:
    case CANOPY_NODE_ASYNC_FALLBACK:
        EXPECT(!is_running || is_child(node, words[0]));
        break;
    case CANOPY_NODE_SEQUENCE_WITH_MEMORY:
        EXPECT(words[0] == 0u || is_child(node, words[0]));
        break;
    case CANOPY_NODE_PARALLEL:
        EXPECT(!is_running || words[3] == canopy_count_children(instance, node));
        EXPECT(!is_running || words[0] + words[1] + words[2] <= words[3]);
        break;
    default:
        break;
    }
}

/** What the next tick builds on: between two ticks it holds for every node. */
static void expect_good_state(void)
{
    for (uint16_t node = 0; node < instance->tree->node_count; node++) {
        const canopy_node_t *row = &instance->tree->nodes[node];
        canopy_status_t parent = canopy_tree_status(instance, row->parent);

        /* A node that is not RUNNING has reset its children, so below it nothing is RUNNING. */
        EXPECT(node == 0u || parent == CANOPY_RUNNING || canopy_tree_status(instance, node) == CANOPY_IDLE);
        /* These two have ticked all their children, and take their statuses for an index. */
        if (node != 0u && parent == CANOPY_RUNNING &&
            (instance->tree->nodes[row->parent].type == CANOPY_NODE_PARALLEL_ALL ||
             instance->tree->nodes[row->parent].type == CANOPY_NODE_REACTIVE_PARALLEL)) {
            EXPECT(canopy_tree_status_code(instance, node) <= CANOPY_CODE_RESET); /* not reset */
        }
        expect_good_words(node, row);
    }
}

/** In a damaged or raw table two leaves may have one number; then the leaves cannot tell who was ticked. */
static bool numbers_are_own(const canopy_tree_t *tree)
{
    for (uint16_t node = 0; node < tree->node_count; node++) {
        const canopy_node_t *row = &tree->nodes[node];

        if (row->type <= CANOPY_NODE_STATEFUL_ACTION &&
            (row->parameter != node || row->leaf != (row->type == CANOPY_NODE_STATEFUL_ACTION ? 1u : 0u))) {
            return false;
        }
    }
    return true;
}

static void run(tables_t *tables)
{
    static uint32_t status_words[NODES / 4 + 1];
    static uint32_t sent_words[NODES / 4 + 1];
    uint8_t *const status = (uint8_t *)status_words;
    static uint16_t words[WORDS + 1];
    static canopy_tree_instance_t self;
    const canopy_can_t can = {.send = take_frame};
    const canopy_trace_config_t config = {.data_id = CANOPY_E2E_NONE,
                                          .snapshot_every = 5,
                                          .health_every = 3,
                                          .model_every = 2,
                                          .changes_max = (uint8_t)(1u + take8(&input) % CANOPY_TRACE_CHANGES_MAX)};
    static const canopy_bus_t no_messages;
    const canopy_bus_state_t bus = {.bus = &no_messages, .counters.unknown_id = take32(&input)};
    canopy_tx_trace_t waiting[64];
    canopy_tx_t tx;
    canopy_trace_state_t trace = {.sent = (uint8_t *)sent_words};
    canopy_time_t now = take32(&input) * UINT64_C(0xFFFFFFFF);
    uint16_t count = tables->tree.node_count;

    for (uint16_t node = 0; node < count && !numbers_are_own(&tables->tree); node++) {
        tables->nodes[node].parameter =
            tables->nodes[node].type <= CANOPY_NODE_STATEFUL_ACTION ? (uint16_t)NODES : tables->nodes[node].parameter;
    }
    canopy_trace_start(&config, &trace, count);
    memset(running, 0, sizeof running);
    status[count] = GUARD;
    words[tables->tree.word_count] = GUARD;
    instance = &self;
    EXPECT(canopy_tx_init(&tx, NULL, 0, &(canopy_tx_memory_t){.trace = waiting, .trace_capacity = 64}, &can) ==
           CANOPY_OK);
    EXPECT(canopy_tree_init(&self, &tables->tree, status, words, NULL) == CANOPY_OK);
    for (unsigned tick = 0; tick < (unsigned)TICKS_MAX && input.next != input.end; tick++) {
        uint8_t what = take8(&input);

        memset(ticked, 0, sizeof ticked);
        if (what < 224u) {
            canopy_status_t root = canopy_tree_tick(&self, now);

            EXPECT(root > CANOPY_IDLE && root <= CANOPY_SKIPPED);
            EXPECT(canopy_tree_status(&self, 0) == root);
            canopy_trace_send(&config, &trace, &self, &tx,
                              &(canopy_trace_tick_t){.tick = tick,
                                                     .root = root,
                                                     .overruns = what,
                                                     .cycle = &(canopy_cycle_t){.now = now},
                                                     .bus = &bus,
                                                     .until = now + 1u});
            canopy_tx_service(&tx, now);
        } else if (what < 248u) {
            canopy_tree_halt(&self);
        } else {
            canopy_tree_reset(&self);
        }
        if (what >= 224u) {
            for (uint16_t node = 0; node < count; node++) {
                EXPECT(canopy_tree_status(&self, node) != CANOPY_RUNNING);
            }
        }
        expect_same_view();
        expect_good_state();
        now += what % 8u == 0u ? take32(&input) : what * UINT64_C(100);
    }
    EXPECT(status[count] == GUARD && words[tables->tree.word_count] == GUARD);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static tables_t tables;
    uint16_t bad = UINT16_MAX;
    canopy_error_t error;

    input = (input_t){.next = data, .end = data + size};
    make_tables(&tables);
    error = canopy_tree_validate(&tables.tree, &bad);
    if (error == CANOPY_OK) {
        run(&tables);
    } else {
        EXPECT(error == CANOPY_ERROR_ARGUMENT || bad < tables.tree.node_count);
    }
    return 0;
}
