/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Tables that are wrong: the validator refuses each, and says which node. Of those that were never validated, one in which
 * a leaf has children ends in a fault.
 */
#include "canopy/node.h"
#include "scripted_leaves.h"

enum { TABLE_NODES = 14, TABLE_WORDS = 6, SCRIPTS_MAX = 1 };

/** A good tree with something of everything, and its tables, of which each test changes one thing. */
typedef struct {
    canopy_node_t nodes[TABLE_NODES];
    canopy_leaf_t leaves[2];
    canopy_control_t controls[1];
    canopy_script_t scripts[SCRIPTS_MAX];
    int32_t parameters[11];
    canopy_tree_t tree;
} tables_t;

static tables_t tables;

static int32_t script(void *application)
{
    (void)application;
    return 1;
}

static canopy_step_t first_child(canopy_tree_instance_t *self, uint16_t node)
{
    (void)self;
    return node + 1u;
}

static canopy_step_t as_child(canopy_tree_instance_t *self, uint16_t node, uint16_t child, canopy_status_t status)
{
    (void)self;
    (void)node;
    (void)child;
    return canopy_done(status);
}

static void make_good_tables(void)
{
    tables = (tables_t){.nodes = {INNER(SEQUENCE, 0, 14, 0, 0),
                                  {.type = CANOPY_NODE_CONDITION, .parent = 0, .end = 2},
                                  {.type = CANOPY_NODE_STATEFUL_ACTION, .parent = 0, .end = 3, .leaf = 1},
                                  INNER(ATTRIBUTES, 0, 5, 0, 0),
                                  INNER(ALWAYS_SUCCESS, 3, 5, 0, 0),
                                  INNER(PRECONDITION, 0, 8, 0, 8),
                                  INNER(USER_DECORATOR, 5, 8, 0, 0),
                                  {.type = CANOPY_NODE_SYNC_ACTION, .parent = 6, .end = 8},
                                  INNER(SWITCH, 0, 12, 1, 8),
                                  INNER(ALWAYS_SUCCESS, 8, 10, 0, 0),
                                  INNER(ALWAYS_FAILURE, 8, 11, 0, 0),
                                  INNER(ALWAYS_SUCCESS, 8, 12, 0, 0),
                                  INNER(TIMEOUT, 0, 14, 2, 10),
                                  INNER(ALWAYS_SUCCESS, 12, 14, 0, 0)},
                        .leaves = {{.tick = script_tick}, script_leaf},
                        .controls = {{.enter = first_child, .child = as_child}},
                        .scripts = {script},
                        .parameters = {0, -1, -1, -1, -1, -1, -1, -1, 0, CANOPY_FAILURE, 3}};
    tables.tree = (canopy_tree_t){.nodes = tables.nodes,
                                  .leaves = tables.leaves,
                                  .controls = tables.controls,
                                  .scripts = tables.scripts,
                                  .parameters = tables.parameters,
                                  .node_count = TABLE_NODES,
                                  .leaf_count = 2,
                                  .control_count = 1,
                                  .script_count = SCRIPTS_MAX,
                                  .parameter_count = 11,
                                  .word_count = TABLE_WORDS};
}

void setUp(void)
{
    make_good_tables();
}

void tearDown(void)
{
}

/** Good tables, this change: refused at this node. */
#define REFUSED(node, change)                                                                            \
    do {                                                                                                 \
        uint16_t bad = UINT16_MAX;                                                                       \
        make_good_tables();                                                                              \
        TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_validate(&tables.tree, &bad));                          \
        change;                                                                                          \
        TEST_ASSERT_EQUAL_MESSAGE(CANOPY_ERROR_TREE, canopy_tree_validate(&tables.tree, &bad), #change); \
        TEST_ASSERT_EQUAL_UINT16_MESSAGE(node, bad, #change);                                            \
        TEST_ASSERT_EQUAL(CANOPY_ERROR_TREE, canopy_tree_validate(&tables.tree, NULL));                  \
    } while (false)

/** Good tables, this change: not even looked at. */
#define NO_TREE(change)                                                                                      \
    do {                                                                                                     \
        make_good_tables();                                                                                  \
        change;                                                                                              \
        TEST_ASSERT_EQUAL_MESSAGE(CANOPY_ERROR_ARGUMENT, canopy_tree_validate(&tables.tree, NULL), #change); \
    } while (false)

static void a_wrong_structure_is_refused(void)
{
    REFUSED(0, tables.nodes[0].parent = 1);
    REFUSED(0, tables.nodes[0].end = TABLE_NODES - 1);
    REFUSED(0, tables.nodes[0].end = TABLE_NODES + 1);
    REFUSED(0, tables.nodes[1].parent = 1);
    REFUSED(0, tables.nodes[2].end = 2);
    REFUSED(0, tables.nodes[12].end = TABLE_NODES + 1);
    REFUSED(1, tables.nodes[1].type = CANOPY_NODE_TYPES);
    REFUSED(1, tables.nodes[1].type = UINT8_MAX);
    REFUSED(0, tables.nodes[0].type = CANOPY_NODE_INVERTER);
    REFUSED(4, tables.nodes[4].type = CANOPY_NODE_INVERTER);
    REFUSED(8, (tables.nodes[8].type = CANOPY_NODE_IF_THEN_ELSE, tables.nodes[9].end = 12));
    REFUSED(12, tables.nodes[13].parent = 0);
}

static void parameters_that_scripts_give_are_looked_at(void)
{
    make_good_tables();
    tables.nodes[12].asks = 1;
    tables.parameters[10] = 0;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_validate(&tables.tree, NULL));
    REFUSED(12, tables.nodes[12].asks = 1); /* script 3 */
    REFUSED(12, (tables.nodes[12].asks = 1, tables.parameters[10] = -1));
    REFUSED(12, (tables.nodes[12].asks = 2, tables.parameters[10] = 0)); /* Timeout has one parameter */
    REFUSED(3, tables.nodes[3].asks = 1);
    REFUSED(5, tables.nodes[5].asks = 1);
    REFUSED(6, tables.nodes[6].asks = 1);
    REFUSED(8, tables.nodes[8].asks = 1);
}

static void functions_that_are_missing_are_refused(void)
{
    REFUSED(1, tables.nodes[1].leaf = 2);
    REFUSED(1, tables.leaves[0].tick = NULL);
    REFUSED(2, tables.leaves[1].running = NULL);
    REFUSED(2, tables.leaves[1].halted = NULL);
    REFUSED(6, tables.nodes[6].leaf = 1);
    REFUSED(6, tables.controls[0].enter = NULL);
    REFUSED(6, tables.controls[0].child = NULL);
    REFUSED(6, (tables.nodes[6].type = CANOPY_NODE_USER_CONTROL, tables.nodes[6].leaf = 1));
    REFUSED(7, tables.nodes[7].leaf = 2);
}

static void parameters_that_mean_nothing_are_refused(void)
{
    REFUSED(3, tables.parameters[0] = SCRIPTS_MAX);
    REFUSED(3, tables.parameters[0] = -2);
    REFUSED(3, tables.scripts[0] = NULL);
    REFUSED(3, (tables.tree.script_count = 0, tables.tree.scripts = NULL));
    REFUSED(3, (tables.tree.parameter_count = 0, tables.tree.parameters = NULL));
    REFUSED(5, tables.parameters[9] = CANOPY_IDLE);
    REFUSED(5, tables.parameters[9] = CANOPY_SKIPPED + 1);
    REFUSED(5, tables.parameters[8] = -1);
    REFUSED(5, (tables.nodes[5].type = CANOPY_NODE_LOOP, tables.parameters[8] = -1));
    REFUSED(8, tables.nodes[8].parameter = 1);
    REFUSED(12, tables.nodes[12].parameter = 11);
    for (uint8_t type = CANOPY_NODE_SKIP_UNLESS_UPDATED; type <= (uint8_t)CANOPY_NODE_WAIT_VALUE_UPDATE; type++) {
        REFUSED(12, (tables.nodes[12].type = type, tables.nodes[12].parameter = 1));
    }
    REFUSED(13, (tables.nodes[13].type = CANOPY_NODE_WAS_ENTRY_UPDATED, tables.nodes[12].type = CANOPY_NODE_INVERTER,
                 tables.nodes[13].state = 2, tables.nodes[13].parameter = 1));
}

/** A TryCatch of three: an action, a Sequence, and what is ticked when it is halted. */
static void a_handler_that_a_halt_cannot_tick_is_refused(void)
{
    static const int32_t parameters[] = {1, 0};
    canopy_node_t nodes[] = {INNER(TRY_CATCH, 0, 5, 0, 0), ACTION(0, 1, 0), INNER(SEQUENCE, 0, 4, 1, 0),
                             ACTION(2, 3, 0), ACTION(0, 4, 0)};

    nodes[1].leaf = 1;
    nodes[3].leaf = 1;
    nodes[4].leaf = 1;
    tables.tree.nodes = nodes;
    tables.tree.node_count = 5;
    tables.tree.parameters = parameters;
    tables.tree.parameter_count = 2;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_validate(&tables.tree, NULL));
    nodes[4].type = CANOPY_NODE_ALWAYS_SUCCESS;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_TREE, canopy_tree_validate(&tables.tree, NULL));
    nodes[0].parameter = 1; /* not ticked when it is halted */
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_validate(&tables.tree, NULL));
    nodes[0].asks = 1; /* a script may say so */
    TEST_ASSERT_EQUAL(CANOPY_ERROR_TREE, canopy_tree_validate(&tables.tree, NULL));
}

static void state_words_that_are_missing_or_shared_are_refused(void)
{
    REFUSED(0, tables.nodes[0].state = TABLE_WORDS);
    REFUSED(8, tables.nodes[8].state = 0);
    REFUSED(12, tables.nodes[12].state = 1);
    REFUSED(12, tables.nodes[12].state = 3);
    REFUSED(12, tables.nodes[12].state = UINT16_MAX);
}

static void what_is_no_tree_is_refused(void)
{
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_tree_validate(NULL, NULL));
    NO_TREE(tables.tree.nodes = NULL);
    NO_TREE(tables.tree.node_count = 0);
    NO_TREE(tables.tree.node_count = CANOPY_NODES_MAX + 1u);
    NO_TREE(tables.tree.leaves = NULL);
    NO_TREE(tables.tree.controls = NULL);
    NO_TREE(tables.tree.scripts = NULL);
    NO_TREE(tables.tree.parameters = NULL);
}

static void tables_that_are_not_needed_may_be_missing(void)
{
    static const canopy_node_t only[] = {INNER(ALWAYS_SUCCESS, 0, 1, 0, 0)};
    static const canopy_tree_t tree = {.nodes = only, .node_count = 1};

    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_validate(&tree, NULL));
}

static void init_refuses_what_it_cannot_use(void)
{
    canopy_tree_instance_t instance;
    uint8_t status[TABLE_NODES];
    uint16_t words[TABLE_WORDS];

    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_init(&instance, &tables.tree, status, words, NULL));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_tree_init(NULL, &tables.tree, status, words, NULL));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_tree_init(&instance, NULL, status, words, NULL));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_tree_init(&instance, &tables.tree, NULL, words, NULL));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_tree_init(&instance, &tables.tree, status, NULL, NULL));
    tables.tree.word_count = 0;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_init(&instance, &tables.tree, status, NULL, NULL));
    tables.tree.node_count = 0;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_tree_init(&instance, &tables.tree, status, words, NULL));
    tables.tree.node_count = CANOPY_NODES_MAX + 1u;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_tree_init(&instance, &tables.tree, status, words, NULL));
    tables.tree.nodes = NULL;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_tree_init(&instance, &tables.tree, status, words, NULL));
}

static void the_good_tables_tick(void)
{
    canopy_tree_instance_t instance;
    uint8_t status[TABLE_NODES];
    uint16_t words[TABLE_WORDS];
    script_t log = {.returns = {CANOPY_SUCCESS}};

    tables.parameters[0] = -1; /* no _failureIf */
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_init(&instance, &tables.tree, status, words, &log));
    TEST_ASSERT_EQUAL(CANOPY_FAILURE, canopy_tree_tick(&instance, 0)); /* the Switch's second case */
    TEST_ASSERT_EQUAL_STRING("aaa", log.log);
    TEST_ASSERT_EQUAL_UINT32(0, instance.faults);
}

/* --- tables that were never validated ------------------------------------------------------------------------------ */

/** A Sequence whose second node claims to be the child of the third one, which is of this type. */
static void ticks_to_a_fault(uint8_t type)
{
    canopy_node_t nodes[] = {INNER(SEQUENCE, 0, 3, 0, 0), INNER(ALWAYS_SUCCESS, 2, 2, 0, 0), {.parent = 0, .end = 3}};
    canopy_tree_t tree = {.nodes = nodes, .node_count = 3, .word_count = 1};
    canopy_tree_instance_t instance;
    uint8_t status[3];
    uint16_t words[1];

    nodes[2].type = type;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_TREE, canopy_tree_validate(&tree, NULL));
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_init(&instance, &tree, status, words, NULL));
    TEST_ASSERT_EQUAL(CANOPY_FAILURE, canopy_tree_tick(&instance, 0));
    TEST_ASSERT_EQUAL_UINT32(1, instance.faults);
    TEST_ASSERT_EQUAL_UINT16(2, instance.fault_node);
    instance.faults = UINT32_MAX;
    TEST_ASSERT_EQUAL(CANOPY_FAILURE, canopy_tree_tick(&instance, 0));
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, instance.faults);
}

static void a_leaf_that_has_children_is_a_fault(void)
{
    static const uint8_t types[] = {
        CANOPY_NODE_CONDITION,      CANOPY_NODE_SYNC_ACTION, CANOPY_NODE_STATEFUL_ACTION,   CANOPY_NODE_ALWAYS_SUCCESS,
        CANOPY_NODE_ALWAYS_FAILURE, CANOPY_NODE_SLEEP,       CANOPY_NODE_WAS_ENTRY_UPDATED, CANOPY_NODE_TEST_NODE};

    for (unsigned type = 0; type < sizeof types; type++) {
        ticks_to_a_fault(types[type]);
    }
}

/** A RUNNING node is halted whatever its type; only these have something to call or to forget. */
static void every_type_can_be_halted(void)
{
    static const canopy_control_t control = {.enter = first_child, .child = as_child};
    static const int32_t parameters[9] = {-1, -1, -1, -1, -1, -1, -1, -1, 0};
    script_t log = {.log = ""};

    for (unsigned type = 0; type <= UINT8_MAX; type++) {
        /* No script of an Attributes node; no handler of a TryCatch. */
        uint16_t parameter = type == CANOPY_NODE_TRY_CATCH ? 8u : 0u;
        canopy_node_t nodes[] = {{.type = (uint8_t)type, .end = 1, .parameter = parameter}};
        canopy_tree_t tree = {.nodes = nodes,
                              .leaves = &script_leaf,
                              .controls = &control,
                              .parameters = parameters,
                              .node_count = 1,
                              .word_count = TABLE_WORDS};
        canopy_tree_instance_t instance;
        uint8_t status[1];
        uint16_t words[TABLE_WORDS];

        TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_init(&instance, &tree, status, words, &log));
        status[0] = canopy_status_stored(CANOPY_RUNNING);
        canopy_tree_halt(&instance);
        TEST_ASSERT_EQUAL(CANOPY_CODE_RESET + CANOPY_RUNNING, canopy_tree_status_code(&instance, 0));
    }
    TEST_ASSERT_EQUAL_STRING("a!", log.log);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_wrong_structure_is_refused);
    RUN_TEST(parameters_that_scripts_give_are_looked_at);
    RUN_TEST(functions_that_are_missing_are_refused);
    RUN_TEST(parameters_that_mean_nothing_are_refused);
    RUN_TEST(a_handler_that_a_halt_cannot_tick_is_refused);
    RUN_TEST(state_words_that_are_missing_or_shared_are_refused);
    RUN_TEST(what_is_no_tree_is_refused);
    RUN_TEST(tables_that_are_not_needed_may_be_missing);
    RUN_TEST(init_refuses_what_it_cannot_use);
    RUN_TEST(the_good_tables_tick);
    RUN_TEST(a_leaf_that_has_children_is_a_fault);
    RUN_TEST(every_type_can_be_halted);
    return UNITY_END();
}
