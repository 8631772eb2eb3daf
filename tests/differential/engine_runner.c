/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Runs trees that tests/differential/engine.py packs, in the real engine, and writes what each tick showed.
 *
 * All numbers are little-endian. Input, once a tree:
 *   u16 nodes, leaves, parameters, scripts, words, ticks, halt_after (0xFFFF: the tree is never halted)
 *   nodes x { u8 type, u8 0, u16 parent, u16 end, u16 state, u16 kind of leaf, u16 parameter }
 *   parameters x i32, ticks x u64 now, scripts x { u8 operation, u8 entry, i16 value, u16 node },
 *   leaves x { u16 node, ticks x u8 answer }
 * Output, once a tree:
 *   i8 result of canopy_tree_validate(), u16 bad node, u16 nodes; when the result is 0:
 *   for each tick, and for the halt: u8 status of the root, u16 calls, calls x { u16 node, u8 kind }, nodes x u8 code,
 *   entries x i32
 *   u32 faults, u16 fault node
 */
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "canopy/tree.h"

enum { LIMIT = 0xFFFF, LEAVES_MAX = 1024, TICKS_MAX = 1024, START = 0, CONTINUE = 1, HALTED = 2, NO_HALT = 0xFFFF };
enum { SCRIPTS_MAX = 1024, ENTRIES = 3 };

/** In the order of OPERATIONS in tree.py. */
typedef enum { LESS, EQUAL, ASSIGN, ADD, VALUE, UPDATES, TAKE } operation_t;

typedef struct {
    uint16_t node;
    uint8_t answers[TICKS_MAX];
} leaf_t;

typedef struct {
    uint16_t node;
    uint8_t kind;
} call_t;

typedef struct {
    operation_t operation;
    uint8_t entry;
    int16_t value;
    uint16_t node;
    int16_t taken; /**< TAKE: items, since the node was not RUNNING. */
} script_t;

/** The tree under test; one at a time. */
static struct {
    canopy_node_t nodes[LIMIT];
    int32_t parameters[LIMIT];
    canopy_time_t times[TICKS_MAX];
    leaf_t leaves[LEAVES_MAX];
    uint8_t status[LIMIT];
    uint16_t words[LIMIT];
    script_t scripts[SCRIPTS_MAX];
    int32_t entries[ENTRIES];
    int32_t updates[ENTRIES];
    call_t calls[LIMIT];
    uint16_t call_count;
    uint16_t tick;
} run;

static void fail(const char *what)
{
    (void)fprintf(stderr, "engine_runner: %s\n", what);
    _Exit(EXIT_FAILURE);
}

static void read_bytes(void *bytes, size_t size)
{
    if (fread(bytes, 1, size, stdin) != size) {
        fail("the input ends in the middle of a tree");
    }
}

static uint64_t read_number(size_t size)
{
    uint8_t bytes[8];
    uint64_t value = 0;

    read_bytes(bytes, size);
    for (size_t i = 0; i < size; i++) {
        value |= (uint64_t)bytes[i] << (8u * i);
    }
    return value;
}

static void write_number(uint64_t value, size_t size)
{
    for (size_t i = 0; i < size; i++) {
        putchar((int)((value >> (8u * i)) & 0xFFu));
    }
}

static void log_call(uint16_t leaf, uint8_t kind)
{
    if (run.call_count == LIMIT) {
        fail("more leaf calls in a tick than a tree can have");
    }
    run.calls[run.call_count].node = run.leaves[leaf].node;
    run.calls[run.call_count].kind = kind;
    run.call_count++;
}

static canopy_status_t on_start(void *application, uint16_t leaf)
{
    (void)application;
    log_call(leaf, START);
    return (canopy_status_t)run.leaves[leaf].answers[run.tick];
}

static canopy_status_t on_running(void *application, uint16_t leaf)
{
    (void)application;
    log_call(leaf, CONTINUE);
    return (canopy_status_t)run.leaves[leaf].answers[run.tick];
}

static void on_halted(void *application, uint16_t leaf)
{
    (void)application;
    log_call(leaf, HALTED);
}

static void write_entry(uint8_t entry, int32_t value)
{
    run.entries[entry] = value;
    run.updates[entry]++;
}

static int32_t take(script_t *script)
{
    if (!canopy_status_runs(run.status[script->node])) {
        script->taken = 0;
    }
    if (script->taken == script->value) {
        return 0;
    }
    script->taken++;
    write_entry(script->entry, script->taken);
    return 1;
}

static int32_t run_script(unsigned number)
{
    script_t *script = &run.scripts[number];
    int32_t entry = run.entries[script->entry];

    switch (script->operation) {
    case LESS:
        return entry < script->value;
    case EQUAL:
        return entry == script->value;
    case ASSIGN:
        write_entry(script->entry, script->value);
        return 1;
    case ADD:
        write_entry(script->entry, entry + script->value);
        return 1;
    case VALUE:
        return entry;
    case UPDATES:
        return run.updates[script->entry];
    case TAKE:
        return take(script);
    }
    fail("no such operation of a script");
    return 0;
}

/* The engine hands a script nothing that tells which one it is: one function each, 1024 of them. */
#define NUMBERED(number)                              \
    static int32_t script_##number(void *application) \
    {                                                 \
        (void)application;                            \
        return run_script(0##number);                 \
    }
#define NAMED(number) script_##number,
/* clang-format off */
#define EIGHT(each, n) each(n##0) each(n##1) each(n##2) each(n##3) each(n##4) each(n##5) each(n##6) each(n##7)
#define SIXTY_FOUR(each, n) \
    EIGHT(each, n##0) EIGHT(each, n##1) EIGHT(each, n##2) EIGHT(each, n##3) \
    EIGHT(each, n##4) EIGHT(each, n##5) EIGHT(each, n##6) EIGHT(each, n##7)
#define ALL(each) \
    SIXTY_FOUR(each, 00) SIXTY_FOUR(each, 01) SIXTY_FOUR(each, 02) SIXTY_FOUR(each, 03) \
    SIXTY_FOUR(each, 04) SIXTY_FOUR(each, 05) SIXTY_FOUR(each, 06) SIXTY_FOUR(each, 07) \
    SIXTY_FOUR(each, 10) SIXTY_FOUR(each, 11) SIXTY_FOUR(each, 12) SIXTY_FOUR(each, 13) \
    SIXTY_FOUR(each, 14) SIXTY_FOUR(each, 15) SIXTY_FOUR(each, 16) SIXTY_FOUR(each, 17)
/* clang-format on */
ALL(NUMBERED)
static const canopy_script_t scripts[SCRIPTS_MAX] = {ALL(NAMED)};

static canopy_status_t script_tick(void *application, uint16_t number)
{
    (void)application;
    (void)run_script(number);
    return CANOPY_SUCCESS;
}

static canopy_status_t script_condition_tick(void *application, uint16_t number)
{
    (void)application;
    return run_script(number) != 0 ? CANOPY_SUCCESS : CANOPY_FAILURE;
}

/** In the order of USER_LEAVES in tree.py; then Script, ScriptCondition. */
static const canopy_leaf_t kinds_of_leaves[] = {
    {.tick = on_start, .running = NULL, .halted = NULL},
    {.tick = on_start, .running = NULL, .halted = NULL},
    {.tick = on_start, .running = on_running, .halted = on_halted},
    {.tick = script_tick, .running = NULL, .halted = NULL},
    {.tick = script_condition_tick, .running = NULL, .halted = NULL},
};

static void read_leaves(uint16_t count, uint16_t ticks)
{
    for (uint16_t i = 0; i < count; i++) {
        run.leaves[i].node = (uint16_t)read_number(2);
        read_bytes(run.leaves[i].answers, ticks);
    }
}

static void read_scripts(uint16_t count)
{
    for (uint16_t i = 0; i < count; i++) {
        script_t *script = &run.scripts[i];

        script->operation = (operation_t)read_number(1);
        script->entry = (uint8_t)read_number(1);
        script->value = (int16_t)read_number(2);
        script->node = (uint16_t)read_number(2);
        script->taken = 0;
        if (script->entry >= ENTRIES) {
            fail("no such entry");
        }
    }
    memset(run.entries, 0, sizeof run.entries);
    memset(run.updates, 0, sizeof run.updates);
}

static void read_nodes(uint16_t count)
{
    for (uint16_t i = 0; i < count; i++) {
        canopy_node_t *node = &run.nodes[i];

        node->type = (uint8_t)read_number(1);
        node->asks = (uint8_t)read_number(1);
        node->parent = (uint16_t)read_number(2);
        node->end = (uint16_t)read_number(2);
        node->state = (uint16_t)read_number(2);
        node->leaf = (uint16_t)read_number(2);
        node->parameter = (uint16_t)read_number(2);
    }
}

static void write_outcome(uint8_t root, uint16_t nodes)
{
    write_number(root, 1);
    write_number(run.call_count, 2);
    for (uint16_t i = 0; i < run.call_count; i++) {
        write_number(run.calls[i].node, 2);
        write_number(run.calls[i].kind, 1);
    }
    if (fwrite(run.status, 1, nodes, stdout) != nodes) {
        fail("the output cannot be written");
    }
    for (unsigned entry = 0; entry < ENTRIES; entry++) {
        write_number((uint32_t)run.entries[entry], 4);
    }
    run.call_count = 0;
}

static void tick_all(canopy_tree_instance_t *instance, uint16_t ticks, uint16_t halt_after)
{
    uint16_t nodes = instance->tree->node_count;

    for (run.tick = 0; run.tick < ticks; run.tick++) {
        canopy_status_t root = canopy_tree_tick(instance, run.times[run.tick]);

        write_outcome((uint8_t)root, nodes);
        if (halt_after == run.tick + 1) {
            canopy_tree_halt(instance);
            write_outcome(0, nodes);
        }
    }
}

/** Reads and runs one tree. @return false at the end of the input. */
static bool run_one(void)
{
    int first = getchar();

    if (first == EOF) {
        return false;
    }
    if (ungetc(first, stdin) == EOF) {
        fail("the input cannot be read");
    }

    canopy_tree_t tree = {
        .nodes = run.nodes, .leaves = kinds_of_leaves, .scripts = scripts, .parameters = run.parameters};
    tree.node_count = (uint16_t)read_number(2);
    uint16_t leaves = (uint16_t)read_number(2);
    tree.leaf_count = sizeof(kinds_of_leaves) / sizeof(kinds_of_leaves[0]);
    tree.parameter_count = (uint16_t)read_number(2);
    tree.script_count = (uint16_t)read_number(2);
    tree.word_count = (uint16_t)read_number(2);
    uint16_t ticks = (uint16_t)read_number(2);
    uint16_t halt_after = (uint16_t)read_number(2);

    if (leaves > LEAVES_MAX || ticks > TICKS_MAX || tree.script_count > SCRIPTS_MAX) {
        fail("more leaves, ticks or scripts than there is room for");
    }
    read_nodes(tree.node_count);
    for (uint16_t i = 0; i < tree.parameter_count; i++) {
        run.parameters[i] = (int32_t)read_number(4);
    }
    for (uint16_t i = 0; i < ticks; i++) {
        run.times[i] = read_number(8);
    }
    read_scripts(tree.script_count);
    read_leaves(leaves, ticks);

    canopy_tree_instance_t instance;
    uint16_t bad_node = 0;
    canopy_error_t error = canopy_tree_validate(&tree, &bad_node);

    write_number((uint8_t)error, 1);
    write_number(bad_node, 2);
    write_number(tree.node_count, 2);
    if (error == CANOPY_OK) {
        if (canopy_tree_init(&instance, &tree, run.status, run.words, NULL) != CANOPY_OK) {
            fail("canopy_tree_init() refused a tree that canopy_tree_validate() accepts");
        }
        tick_all(&instance, ticks, halt_after);
        write_number(instance.faults, 4);
        write_number(instance.fault_node, 2);
    }
    return true;
}

int main(void)
{
    while (run_one()) {}
    if (fflush(stdout) != 0) {
        fail("the output cannot be written");
    }
    return EXIT_SUCCESS;
}
