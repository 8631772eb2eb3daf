/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Leaves for tests of the engine: each returns what the test says, and the calls are written down.
 *
 * Leaf number n is 'a' + n. The log has one item a call: "a" a tick or on_start, "a'" on_running, "a!" on_halted.
 */
#ifndef CANOPY_TESTS_SCRIPTED_LEAVES_H
#define CANOPY_TESTS_SCRIPTED_LEAVES_H

#include <stdint.h>
#include <string.h>

#include "canopy/tree.h"
#include "unity.h"

enum { LEAVES_MAX = 16, LOG_MAX = 256, NODES_MAX = 32 };

typedef struct {
    canopy_status_t returns[LEAVES_MAX];
    char log[LOG_MAX];
} script_t;

static inline void script_log(script_t *script, uint16_t leaf, const char *suffix)
{
    size_t length = strlen(script->log);

    TEST_ASSERT_LESS_THAN(LOG_MAX - 4, length);
    script->log[length] = (char)('a' + leaf);
    strcpy(&script->log[length + 1u], suffix);
}

static inline canopy_status_t script_tick(void *application, uint16_t leaf)
{
    script_log(application, leaf, "");
    return ((script_t *)application)->returns[leaf];
}

static inline canopy_status_t script_running(void *application, uint16_t leaf)
{
    script_log(application, leaf, "'");
    return ((script_t *)application)->returns[leaf];
}

static inline void script_halted(void *application, uint16_t leaf)
{
    script_log(application, leaf, "!");
}

static const canopy_leaf_t script_leaf = {.tick = script_tick, .running = script_running, .halted = script_halted};

/** A tree under test, with the memory of one instance. */
typedef struct {
    canopy_tree_t tree;
    canopy_tree_instance_t instance;
    uint8_t status[NODES_MAX];
    uint16_t words[64];
    script_t script;
} bench_t;

static inline void bench_start(bench_t *bench, const canopy_node_t *nodes, uint16_t count, const int32_t *parameters,
                               uint16_t parameter_count)
{
    *bench = (bench_t){.tree = {.nodes = nodes,
                                .leaves = &script_leaf,
                                .parameters = parameters,
                                .node_count = count,
                                .leaf_count = 1,
                                .parameter_count = parameter_count,
                                .word_count = 64}};
    TEST_ASSERT_LESS_OR_EQUAL(NODES_MAX, count);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_validate(&bench->tree, NULL));
    TEST_ASSERT_EQUAL(CANOPY_OK,
                      canopy_tree_init(&bench->instance, &bench->tree, bench->status, bench->words, &bench->script));
}

/** Ticks with these results of the leaves ("SFRK": success, failure, running, skipped), expects status and calls. */
static inline void bench_expect(bench_t *bench, canopy_time_t now, const char *results, canopy_status_t status,
                                const char *calls, unsigned line)
{
    for (unsigned leaf = 0; results[leaf] != '\0'; leaf++) {
        bench->script.returns[leaf] = results[leaf] == 'S'   ? CANOPY_SUCCESS
                                      : results[leaf] == 'F' ? CANOPY_FAILURE
                                      : results[leaf] == 'R' ? CANOPY_RUNNING
                                      : results[leaf] == 'K' ? CANOPY_SKIPPED
                                                             : CANOPY_IDLE;
    }
    bench->script.log[0] = '\0';
    UNITY_TEST_ASSERT_EQUAL_INT(status, canopy_tree_tick(&bench->instance, now), line, "status of the root");
    UNITY_TEST_ASSERT_EQUAL_STRING(calls, bench->script.log, line, "calls");
}

#define EXPECT_AT(now, results, status, calls) bench_expect(&bench, (now), (results), (status), (calls), __LINE__)
#define EXPECT(results, status, calls) EXPECT_AT(0, results, status, calls)

/** Rows of a node table. */
#define INNER(kind, up, after, word, number) \
    {.type = CANOPY_NODE_##kind, .parent = (up), .end = (after), .state = (word), .parameter = (number)}
#define ACTION(up, index, number) \
    {.type = CANOPY_NODE_STATEFUL_ACTION, .parent = (up), .end = (index) + 1, .parameter = (number)}
#define SYNC(up, index, number) \
    {.type = CANOPY_NODE_SYNC_ACTION, .parent = (up), .end = (index) + 1, .parameter = (number)}
#define CONDITION(up, index, number) \
    {.type = CANOPY_NODE_CONDITION, .parent = (up), .end = (index) + 1, .parameter = (number)}

#define START(nodes, parameters) \
    bench_start(&bench, nodes, sizeof(nodes) / sizeof(nodes)[0], parameters, sizeof(parameters) / sizeof(parameters)[0])

#endif
