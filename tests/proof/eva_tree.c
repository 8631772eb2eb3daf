/* SPDX-License-Identifier: MIT */
/**
 * @file
 * For Frama-C: small trees, ticked, halted and reset in any order for ever, at any times, with leaves, scripts and
 * control nodes that answer anything. -DROOT=n gives the root's type, so that each root is a run of its own.
 *
 * The trees: the root with as many children as it may have, up to MOST; one of them, at any place, is a node of any type
 * (with two children if it may have them); the rest are leaves of your own, StatefulActions and SyncActions in turn.
 *
 * EVA keeps all states apart here, so it finds every state that the tree can get into; what is a plain number to the
 * engine (counters of attempts, times, counters of entries, parameters) may have any value in each tick.
 */
#include <stddef.h>

#include "__fc_builtin.h"
#include "canopy/node.h"
#include "canopy/tree.h"

/* A control node of your own can go on with any child: two of them already make many states. */
enum { MOST = ROOT == CANOPY_NODE_USER_CONTROL ? 2 : 3, NODES = 10, WORDS = 16, PARAMETERS = 16, ANY_SCRIPT = 0 };

/* One that keeps its place and one that keeps a time; -DALL: every type, which takes hours. */
#ifdef ALL
#define IS_INNER(type) true
#else
#define IS_INNER(type) ((type) == CANOPY_NODE_SEQUENCE || (type) == CANOPY_NODE_TIMEOUT)
#endif

typedef struct {
    uint8_t least;
    uint16_t most;
    uint8_t words;
    uint8_t parameters;
} shape_t;

static const shape_t shapes[CANOPY_NODE_TYPES] = {
#define CANOPY_NODE(id, name, category, least, most, words, count, parameters, text) \
    [CANOPY_NODE_##id] = {(least), (most), (words), (count)},
#include "canopy/nodes.def"
#undef CANOPY_NODE
};

static canopy_tree_instance_t instance;
static canopy_tree_t tree;
/* What a trace leaves on each node between ticks; a run with and a run without (MARKED). */
#ifdef MARKED
#define MARK CANOPY_STATUS_OLD
#else
#define MARK 0u
#endif

static uint8_t any_idle; /* Any byte of a node that is IDLE. */
static uint8_t ticked[NODES];
static canopy_status_t acts[NODES]; /* What a StatefulAction knows of itself. */

/* --- leaves, scripts and control nodes; a leaf's parameter is its node ------------------------------------------- */

/** Each by itself, so that EVA keeps them apart. */
static canopy_status_t any_result(void)
{
    switch (Frama_C_interval(0, 3)) {
    case 0:
        return CANOPY_RUNNING;
    case 1:
        return CANOPY_SUCCESS;
    case 2:
        return CANOPY_FAILURE;
    default:
        return CANOPY_SKIPPED;
    }
}

static canopy_status_t any_status(void)
{
    if (Frama_C_interval(0, 1) != 0) {
        return any_result();
    }
    return Frama_C_interval(0, 1) != 0 ? CANOPY_IDLE : (canopy_status_t)Frama_C_unsigned_int_interval(5, UINT32_MAX);
}

static canopy_status_t leaf(void *application, uint16_t node)
{
    (void)application;
    /*@ assert once: ticked[node] == 0; */
    ticked[node] = 1;
    return any_status();
}

static canopy_status_t known(canopy_status_t status, uint16_t node)
{
    acts[node] = status == CANOPY_RUNNING ? CANOPY_RUNNING : CANOPY_IDLE;
    return status;
}

static canopy_status_t start(void *application, uint16_t node)
{
    /*@ assert not_twice: acts[node] != CANOPY_RUNNING; */
    return known(leaf(application, node), node);
}

static canopy_status_t go_on(void *application, uint16_t node)
{
    /*@ assert started: acts[node] == CANOPY_RUNNING; */
    return known(leaf(application, node), node);
}

static void halted(void *application, uint16_t node)
{
    (void)application;
    /*@ assert runs: acts[node] == CANOPY_RUNNING; */
    acts[node] = CANOPY_IDLE;
}

static int32_t any_script(void *application)
{
    (void)application;
    return Frama_C_interval(INT32_MIN, INT32_MAX);
}

/** Each node of the tree, each status, and what is neither. */
static uint32_t any_step(void)
{
    for (uint32_t step = 0; step < tree.node_count; step++) {
        if (Frama_C_interval(0, 1) != 0) {
            return step;
        }
    }
    if (Frama_C_interval(0, 1) != 0) {
        return CANOPY_STEP_DONE + (uint32_t)any_result();
    }
    return Frama_C_interval(0, 1) != 0 ? Frama_C_unsigned_int_interval(tree.node_count, CANOPY_STEP_DONE)
                                       : Frama_C_unsigned_int_interval(CANOPY_STEP_DONE + 5u, UINT32_MAX);
}

static uint32_t enter(canopy_tree_instance_t *self, uint16_t node)
{
    (void)self;
    (void)node;
    return any_step();
}

static uint32_t child_done(canopy_tree_instance_t *self, uint16_t node, uint16_t child, canopy_status_t status)
{
    (void)self;
    (void)node;
    (void)child;
    (void)status;
    return any_step();
}

static void halt(canopy_tree_instance_t *self, uint16_t node)
{
    /*@ assert control_runs: (self->status[node] & CANOPY_STATUS_RUNS) != 0; */
    (void)self;
    (void)node;
}

static const canopy_leaf_t leaves[] = {{.tick = leaf}, {.tick = start, .running = go_on, .halted = halted}};
static const canopy_control_t controls[] = {{.enter = enter, .child = child_done, .halt = halt}};
static const canopy_script_t scripts[] = {any_script};

/* --- the trees ---------------------------------------------------------------------------------------------------- */

static bool is_own_leaf(uint8_t type)
{
    return type <= (uint8_t)CANOPY_NODE_STATEFUL_ACTION;
}

/** Its fields but for `end`. */
static void add(canopy_node_t *nodes, int32_t *parameters, uint8_t type, uint16_t parent)
{
    uint16_t node = tree.node_count++;

    nodes[node] = (canopy_node_t){.type = type, .parent = parent, .state = tree.word_count};
    tree.word_count = (uint16_t)(tree.word_count + shapes[type].words);
    if (is_own_leaf(type)) {
        nodes[node].leaf = type == (uint8_t)CANOPY_NODE_STATEFUL_ACTION ? 1 : 0;
        nodes[node].parameter = node;
        return;
    }
    nodes[node].parameter = tree.parameter_count;
    for (uint8_t which = 0; which < shapes[type].parameters; which++) {
        parameters[tree.parameter_count++] = (int32_t)ANY_SCRIPT;
    }
    if (type == (uint8_t)CANOPY_NODE_PRECONDITION || type == (uint8_t)CANOPY_NODE_LOOP) {
        parameters[tree.parameter_count - 1u] = (int32_t)any_result();
    } else if (type == (uint8_t)CANOPY_NODE_TEST_NODE) {
        parameters[nodes[node].parameter] = (int32_t)any_result();
    } else if (type < (uint8_t)CANOPY_NODE_PRECONDITION || type > (uint8_t)CANOPY_NODE_SWITCH) {
        nodes[node].asks = (uint8_t)((1u << shapes[type].parameters) - 1u);
    }
}

static void add_leaf(canopy_node_t *nodes, int32_t *parameters, uint16_t parent, unsigned turn)
{
    uint16_t node = tree.node_count;

    add(nodes, parameters, (uint8_t)(turn % 2u == 0u ? CANOPY_NODE_STATEFUL_ACTION : CANOPY_NODE_SYNC_ACTION), parent);
    nodes[node].end = tree.node_count;
}

static void build(canopy_node_t *nodes, int32_t *parameters, uint8_t inner, unsigned children)
{
    unsigned place = children > 0u ? inner % children : 0u;
    unsigned turn = inner / 2u;

    add(nodes, parameters, ROOT, 0);
    for (unsigned child = 0; child < children; child++) {
        uint16_t top = tree.node_count;
        unsigned below = shapes[inner].least > 2u  ? shapes[inner].least
                         : shapes[inner].most < 2u ? shapes[inner].most
                                                   : 2u;

        if (child != place) {
            add_leaf(nodes, parameters, 0, turn + child);
            continue;
        }
        add(nodes, parameters, inner, 0);
        for (unsigned grandchild = 0; grandchild < below; grandchild++) {
            add_leaf(nodes, parameters, top, turn + grandchild);
        }
        nodes[top].end = tree.node_count;
    }
    nodes[0].end = tree.node_count;
}

/* --- the run ------------------------------------------------------------------------------------------------------- */

/** What the engine does not rely on any more may be anything. @return from which word on nothing is relied on */
static uint8_t words_in_use(uint8_t type, bool running)
{
    switch ((canopy_node_type_t)type) {
    case CANOPY_NODE_SEQUENCE_WITH_MEMORY:
    case CANOPY_NODE_RUN_ONCE:
        return 1;
    case CANOPY_NODE_SEQUENCE:
    case CANOPY_NODE_FALLBACK:
    case CANOPY_NODE_ASYNC_SEQUENCE:
    case CANOPY_NODE_ASYNC_FALLBACK:
    case CANOPY_NODE_IF_THEN_ELSE:
    case CANOPY_NODE_TRY_CATCH:
    case CANOPY_NODE_SWITCH:
        return running ? 1 : 0;
    case CANOPY_NODE_PARALLEL:
        return running ? 4 : 0;
    default:
        return 0;
    }
}

/** Makes the state more general than it is, so that there are fewer states. */
static void forget(const canopy_node_t *nodes, uint8_t *status, uint16_t *words)
{
    for (uint16_t node = 0; node < tree.node_count; node++) {
        uint8_t type = nodes[node].type;

        for (uint8_t word = words_in_use(type, canopy_status_runs(status[node])); word < shapes[type].words; word++) {
            words[nodes[node].state + word] = (uint16_t)Frama_C_unsigned_int_interval(0, UINT16_MAX);
        }
        if (canopy_status_now(status[node]) == CANOPY_IDLE) {
            status[node] = any_idle;
        } else {
            status[node] |= MARK;
        }
        ticked[node] = 0;
    }
    instance.faults = Frama_C_unsigned_int_interval(0, UINT32_MAX);
    instance.fault_node = (uint16_t)Frama_C_unsigned_int_interval(0, UINT16_MAX);
    instance.now = Frama_C_unsigned_long_long_interval(0, UINT64_MAX);
}

static void nothing_runs(void)
{
    for (uint16_t node = 0; node < tree.node_count; node++) {
        /*@ assert halted: (instance.status[node] & CANOPY_STATUS_RUNS) == 0 && acts[node] != CANOPY_RUNNING; */
    }
}

int main(void)
{
    /* Local, so that EVA sees a use of any entry beyond the tree's own. */
    canopy_node_t nodes[NODES];
    int32_t parameters[PARAMETERS];
    uint8_t status[NODES];
    uint16_t words[WORDS];
    unsigned least = shapes[ROOT].least;
    unsigned most = shapes[ROOT].most < MOST ? shapes[ROOT].most : MOST;
    unsigned children = Frama_C_unsigned_int_interval(least, most);
    unsigned inner = Frama_C_unsigned_int_interval(0, CANOPY_NODE_TYPES - 1);
    canopy_error_t error;

    /*@ split children; */
    /*@ split inner; */
    if (inner != (unsigned)CANOPY_NODE_STATEFUL_ACTION &&
        (!IS_INNER(inner) || children != (least > 2u || most < 2u ? least : 2u))) {
        return 0;
    }
    any_idle = (uint8_t)Frama_C_nondet(canopy_status_reset(canopy_status_stored(CANOPY_RUNNING)),
                                       Frama_C_interval(canopy_status_reset(canopy_status_stored(CANOPY_SUCCESS)),
                                                        canopy_status_reset(canopy_status_stored(CANOPY_SKIPPED))));
    any_idle = (uint8_t)Frama_C_nondet(CANOPY_STATUS_NEVER, Frama_C_nondet(CANOPY_STATUS_WAS, any_idle) | MARK);
    tree = (canopy_tree_t){.nodes = nodes,
                           .leaves = leaves,
                           .controls = controls,
                           .scripts = scripts,
                           .parameters = parameters,
                           .leaf_count = 2,
                           .control_count = 1,
                           .script_count = 1};
    build(nodes, parameters, (uint8_t)inner, children);
    error = canopy_tree_validate(&tree, NULL);
    /*@ assert accepted: error == CANOPY_OK; */
    error = canopy_tree_init(&instance, &tree, status, words, NULL);
    /*@ assert made: error == CANOPY_OK; */
    while (Frama_C_interval(0, 1) != 0) {
        forget(nodes, status, words);
        switch (Frama_C_interval(0, 2)) {
        case 0: {
            canopy_status_t root = canopy_tree_tick(&instance, Frama_C_unsigned_long_long_interval(0, UINT64_MAX));
            /*@ assert result: CANOPY_RUNNING <= root <= CANOPY_SKIPPED && instance.status[0] == root + CANOPY_STATUS_BASE; */
            break;
        }
        case 1:
            canopy_tree_halt(&instance);
            nothing_runs();
            break;
        default:
            canopy_tree_reset(&instance);
            nothing_runs();
            break;
        }
    }
    return 0;
}
