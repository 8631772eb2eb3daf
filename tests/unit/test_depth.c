/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The largest trees: a chain of 60,000 decorators and a Sequence of 60,000 leaves tick and halt with the same stack as
 * trees of 10. The leaf measures how deep the stack is when it is called.
 */
#include <stdlib.h>

#include "canopy/tree.h"
#include "unity.h"

enum { SMALL = 10, LARGE = 60000 };

typedef struct {
    canopy_status_t returns;
    uint32_t ticked;
    uint32_t halted;
    uintptr_t tick_lowest; /**< Lowest address of a leaf's frame. */
    uintptr_t halt_lowest;
} leaves_t;

typedef struct {
    canopy_node_t *nodes;
    uint8_t *status;
    uint16_t *words;
    canopy_tree_t tree;
    canopy_tree_instance_t instance;
    leaves_t leaves;
} bench_t;

static bench_t bench;
static const int32_t one_failure = 1;

static void note_stack(uintptr_t *lowest)
{
    uintptr_t here = (uintptr_t)__builtin_frame_address(0);

    *lowest = here < *lowest ? here : *lowest;
}

static canopy_status_t tick_leaf(void *application, uint16_t parameter)
{
    leaves_t *leaves = application;

    (void)parameter;
    leaves->ticked++;
    note_stack(&leaves->tick_lowest);
    return leaves->returns;
}

static void halt_leaf(void *application, uint16_t parameter)
{
    leaves_t *leaves = application;

    (void)parameter;
    leaves->halted++;
    note_stack(&leaves->halt_lowest);
}

static const canopy_leaf_t leaf = {.tick = tick_leaf, .running = tick_leaf, .halted = halt_leaf};

static void start(uint16_t count, uint16_t words)
{
    bench.status = malloc(count);
    bench.words = calloc(words + 1u, sizeof bench.words[0]);
    bench.tree = (canopy_tree_t){.nodes = bench.nodes,
                                 .leaves = &leaf,
                                 .parameters = &one_failure,
                                 .node_count = count,
                                 .leaf_count = 1,
                                 .parameter_count = 1,
                                 .word_count = words};
    bench.leaves = (leaves_t){.tick_lowest = UINTPTR_MAX, .halt_lowest = UINTPTR_MAX};
    TEST_ASSERT_NOT_NULL(bench.status);
    TEST_ASSERT_NOT_NULL(bench.words);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_validate(&bench.tree, NULL));
    TEST_ASSERT_EQUAL(CANOPY_OK,
                      canopy_tree_init(&bench.instance, &bench.tree, bench.status, bench.words, &bench.leaves));
}

/** `inner` decorators, one in the other, around a leaf. */
static void start_chain(uint16_t inner)
{
    bench.nodes = calloc(inner + 1u, sizeof bench.nodes[0]);
    TEST_ASSERT_NOT_NULL(bench.nodes);
    for (uint16_t node = 0; node <= inner; node++) {
        bench.nodes[node] =
            (canopy_node_t){.type = node < inner ? (uint8_t)CANOPY_NODE_INVERTER : (uint8_t)CANOPY_NODE_STATEFUL_ACTION,
                            .parent = node > 0u ? (uint16_t)(node - 1u) : 0u,
                            .end = (uint16_t)(inner + 1u)};
    }
    start((uint16_t)(inner + 1u), 0);
}

/** A control node with as many leaves. */
static void start_flat(canopy_node_type_t type, uint16_t children)
{
    bench.nodes = calloc(children + 1u, sizeof bench.nodes[0]);
    TEST_ASSERT_NOT_NULL(bench.nodes);
    bench.nodes[0] = (canopy_node_t){.type = (uint8_t)type, .end = (uint16_t)(children + 1u)};
    for (uint16_t node = 1; node <= children; node++) {
        bench.nodes[node] = (canopy_node_t){.type = CANOPY_NODE_STATEFUL_ACTION, .end = (uint16_t)(node + 1u)};
    }
    start((uint16_t)(children + 1u), 4);
}

static void expect_all(canopy_status_t leaf_returns, canopy_status_t status, uint32_t ticked)
{
    bench.leaves.returns = leaf_returns;
    bench.leaves.ticked = 0;
    TEST_ASSERT_EQUAL(status, canopy_tree_tick(&bench.instance, 0));
    TEST_ASSERT_EQUAL_UINT32(ticked, bench.leaves.ticked);
}

static void expect_halted(uint32_t halted)
{
    bench.leaves.halted = 0;
    canopy_tree_halt(&bench.instance);
    TEST_ASSERT_EQUAL_UINT32(halted, bench.leaves.halted);
    for (uint16_t node = 0; node < bench.tree.node_count; node++) {
        TEST_ASSERT_EQUAL(CANOPY_IDLE, canopy_tree_status(&bench.instance, node));
    }
}

static void finish(void)
{
    free(bench.nodes);
    free(bench.status);
    free(bench.words);
    bench = (bench_t){0};
}

void setUp(void)
{
}

void tearDown(void)
{
    finish();
}

static leaves_t run_chain(uint16_t inner)
{
    leaves_t seen;

    start_chain(inner);
    expect_all(CANOPY_SUCCESS, inner % 2u == 0u ? CANOPY_SUCCESS : CANOPY_FAILURE, 1);
    expect_all(CANOPY_SKIPPED, CANOPY_SKIPPED, 1);
    expect_all(CANOPY_RUNNING, CANOPY_RUNNING, 1);
    TEST_ASSERT_EQUAL(CANOPY_RUNNING, canopy_tree_status(&bench.instance, inner));
    expect_halted(1);
    expect_halted(0);
    seen = bench.leaves;
    finish();
    return seen;
}

static leaves_t run_flat(canopy_node_type_t type, uint16_t children)
{
    bool parallel = type == CANOPY_NODE_PARALLEL_ALL;
    leaves_t seen;

    start_flat(type, children);
    expect_all(CANOPY_SUCCESS, CANOPY_SUCCESS, children);
    expect_all(CANOPY_SKIPPED, CANOPY_SKIPPED, children);
    expect_all(CANOPY_RUNNING, CANOPY_RUNNING, parallel ? children : 1);
    expect_halted(parallel ? children : 1);
    expect_halted(0);
    seen = bench.leaves;
    finish();
    return seen;
}

static const uint16_t sizes[] = {SMALL, LARGE};

static void expect_same_stack(const leaves_t seen[2])
{
    TEST_ASSERT_EQUAL_HEX64(seen[0].tick_lowest, seen[1].tick_lowest);
    TEST_ASSERT_EQUAL_HEX64(seen[0].halt_lowest, seen[1].halt_lowest);
}

/* Small and large trees are ticked out of the same line, so that the callers' stack is the same. */
static void sixty_thousand_nested_decorators_need_the_stack_of_ten(void)
{
    leaves_t seen[2];

    for (volatile unsigned size = 0; size < 2u; size++) {
        seen[size] = run_chain(sizes[size]);
    }
    expect_same_stack(seen);
}

static void sixty_thousand_children_need_the_stack_of_ten(void)
{
    static const canopy_node_type_t types[] = {CANOPY_NODE_SEQUENCE, CANOPY_NODE_PARALLEL_ALL};

    for (unsigned type = 0; type < sizeof types / sizeof types[0]; type++) {
        leaves_t seen[2];

        for (volatile unsigned size = 0; size < 2u; size++) {
            seen[size] = run_flat(types[type], sizes[size]);
        }
        expect_same_stack(seen);
    }
}

static void the_largest_tree_works_and_a_larger_one_is_refused(void)
{
    start_flat(CANOPY_NODE_SEQUENCE, CANOPY_NODES_MAX - 1u);
    expect_all(CANOPY_SUCCESS, CANOPY_SUCCESS, CANOPY_NODES_MAX - 1u);
    bench.tree.node_count = CANOPY_NODES_MAX + 1u;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_tree_validate(&bench.tree, NULL));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT,
                      canopy_tree_init(&bench.instance, &bench.tree, bench.status, bench.words, NULL));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(sixty_thousand_nested_decorators_need_the_stack_of_ten);
    RUN_TEST(sixty_thousand_children_need_the_stack_of_ten);
    RUN_TEST(the_largest_tree_works_and_a_larger_one_is_refused);
    return UNITY_END();
}
