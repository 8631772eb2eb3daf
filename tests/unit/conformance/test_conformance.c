/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The engine against the conformance table: every path of three rows from the start of every node, halts and resets
 * included, and every row at least once. The table is constant data, so this runs on a target without files.
 *
 * Each child is a StatefulAction, and in further walks a Condition, in every mixture; a Condition is never RUNNING, so such
 * a walk leaves out the rows in which it would be.
 */
#include <string.h>

#include "canopy/tree.h"
#include "unity.h"

enum { CHILDREN_MAX = 3, PARAMETERS_MAX = 2, WORDS = 8, STATES_MAX = 256, ROWS_MAX = 1024, CALLS_MAX = 24, DEPTH = 3 };

static const char *const table[] = {
#include "conformance_table.inc"
};

#define TABLE_ROWS (sizeof table / sizeof table[0])

static const char *const names[CANOPY_NODE_TYPES] = {
#define CANOPY_NODE(id, name, category, least, most, words, count, parameters, text) [CANOPY_NODE_##id] = (name),
#include "canopy/nodes.def"
#undef CANOPY_NODE
};

/** What the row of the table says. */
typedef struct {
    char operation; /**< t tick, h halt, r reset. */
    canopy_status_t returns[CHILDREN_MAX];
    canopy_status_t status;
    char calls[CALLS_MAX];
    unsigned next;
    const char *text;
} row_t;

/** The instance under test, copied to come back to a state. */
typedef struct {
    canopy_tree_instance_t instance;
    uint8_t status[CHILDREN_MAX + 1];
    uint16_t words[WORDS];
    canopy_time_t now;
} engine_t;

static row_t rows[ROWS_MAX];
static unsigned row_count;
static unsigned first_row[STATES_MAX + 1]; /* rows of a state lie together */
static unsigned state_count;
static unsigned children;
static uint64_t rows_walked;

static canopy_node_t nodes[CHILDREN_MAX + 1];
static int32_t parameters[PARAMETERS_MAX + 1];
static canopy_tree_t tree;
static const row_t *current;
static char calls[CALLS_MAX];

static void note(uint16_t leaf, const char *suffix)
{
    size_t length = strlen(calls);

    TEST_ASSERT_LESS_THAN_MESSAGE(CALLS_MAX - 3, length, current->text);
    calls[length] = (char)('a' + leaf);
    strcpy(&calls[length + 1u], suffix);
}

static canopy_status_t leaf_start(void *application, uint16_t leaf)
{
    (void)application;
    note(leaf, "");
    return current->returns[leaf];
}

static canopy_status_t leaf_running(void *application, uint16_t leaf)
{
    (void)application;
    note(leaf, "'");
    return current->returns[leaf];
}

static void leaf_halted(void *application, uint16_t leaf)
{
    (void)application;
    note(leaf, "!");
}

static const canopy_leaf_t leaf = {.tick = leaf_start, .running = leaf_running, .halted = leaf_halted};
static unsigned conditions; /* bit of a child: it is a Condition */

void setUp(void)
{
}

void tearDown(void)
{
}

static canopy_status_t status_of(char letter)
{
    switch (letter) {
    case 'S':
        return CANOPY_SUCCESS;
    case 'F':
        return CANOPY_FAILURE;
    case 'R':
        return CANOPY_RUNNING;
    case 'K':
        return CANOPY_SKIPPED;
    default:
        return CANOPY_IDLE; /* of a child that is not to be asked: it would be a fault */
    }
}

/** Length of the word that begins here. Text is read with what a target without a C library has, too. */
static size_t word_length(const char *text)
{
    size_t length = 0;

    while (text[length] != '\0' && text[length] != ' ') {
        length++;
    }
    return length;
}

/* NOLINTBEGIN(clang-analyzer-security.ArrayBound): it guesses lengths of words that the table's lines do not have. */
/** Reads a whole number, after blanks. @return what follows it */
static const char *read_number(const char *text, int32_t *number)
{
    bool negative = false;

    while (*text == ' ') {
        text++;
    }
    if (*text == '-') {
        negative = true;
        text++;
    }
    *number = 0;
    while (*text >= '0' && *text <= '9') {
        *number = (*number * 10) + (*text - '0');
        text++;
    }
    if (negative) {
        *number = -*number;
    }
    return text;
}
/* NOLINTEND(clang-analyzer-security.ArrayBound) */

/** Is the word of this length the name? */
static bool is_name(const char *name, const char *word, size_t length)
{
    return strlen(name) == length && memcmp(name, word, length) == 0;
}

/** "@ name children parameters...": the tree of it. */
static void read_node(const char *line)
{
    const char *name = line + 2;
    size_t length = word_length(name);
    const char *rest;
    int32_t number;
    unsigned type = 0;

    while (type < CANOPY_NODE_TYPES && !is_name(names[type], name, length)) {
        type++;
    }
    TEST_ASSERT_LESS_THAN_MESSAGE(CANOPY_NODE_TYPES, type, line);
    rest = read_number(name + length, &number);
    children = (unsigned)number;
    TEST_ASSERT_LESS_OR_EQUAL_MESSAGE(CHILDREN_MAX, children, line);
    memset(parameters, 0, sizeof parameters);
    for (unsigned which = 0; *rest != '\0'; which++) {
        TEST_ASSERT_LESS_THAN_MESSAGE(PARAMETERS_MAX, which, line);
        rest = read_number(rest, &parameters[which]);
    }
    nodes[0] = (canopy_node_t){.type = (uint8_t)type, .end = (uint16_t)(children + 1u)};
    for (unsigned child = 1; child <= children; child++) {
        nodes[child] = (canopy_node_t){.type = CANOPY_NODE_STATEFUL_ACTION,
                                       .end = (uint16_t)(child + 1u),
                                       .state = WORDS,
                                       .parameter = (uint16_t)(child - 1u)};
    }
    tree = (canopy_tree_t){.nodes = nodes,
                           .leaves = &leaf,
                           .parameters = parameters,
                           .node_count = (uint16_t)(children + 1u),
                           .leaf_count = 1,
                           .parameter_count = PARAMETERS_MAX + 1,
                           .word_count = WORDS};
    TEST_ASSERT_EQUAL_MESSAGE(CANOPY_OK, canopy_tree_validate(&tree, NULL), line);
}

/** "state | children return | node returns | calls | next state". @return the state. */
static unsigned read_row(const char *line, row_t *row)
{
    int32_t state;
    int32_t next;
    const char *field = read_number(line, &state);
    size_t length;
    bool answered;

    field += strlen(" | ");
    row->text = line;
    row->operation = *field == 'h' || *field == 'r' ? *field : 't';
    length = word_length(field);
    answered = length == children || field[length - children - 1u] == ':';
    for (unsigned child = 0; child < children; child++) {
        row->returns[child] = answered ? status_of(field[length - children + child]) : CANOPY_IDLE;
    }
    field += length + strlen(" | ");
    row->status = status_of(*field);
    field += strlen("R | ");
    length = word_length(field);
    TEST_ASSERT_LESS_THAN_MESSAGE(CALLS_MAX, length, line);
    memcpy(row->calls, field, length);
    row->calls[*field == '-' ? 0u : length] = '\0';
    (void)read_number(field + length + strlen(" | "), &next);
    row->next = (unsigned)next;
    return (unsigned)state;
}

/** A Condition cannot do what the row asks of it. */
static bool cannot_be(const row_t *row)
{
    for (unsigned child = 0; child < children; child++) {
        if ((conditions >> child & 1u) != 0u && row->returns[child] == CANOPY_RUNNING) {
            return true;
        }
    }
    return false;
}

/** Reads the rows of one node, from `line` on. @return the line after them. */
static size_t read_rows(size_t line)
{
    row_count = 0;
    state_count = 0;
    for (; line < TABLE_ROWS && table[line][0] != '@'; line++) {
        TEST_ASSERT_LESS_THAN(ROWS_MAX, row_count);
        if (read_row(table[line], &rows[row_count]) == state_count) {
            TEST_ASSERT_LESS_THAN(STATES_MAX, state_count);
            first_row[state_count++] = row_count;
        }
        row_count++;
    }
    first_row[state_count] = row_count;
    return line;
}

/** The rows of a state name each combination of statuses exactly once: of a tick, of a halt, and of a reset. */
static void rows_are_complete(unsigned state)
{
    unsigned ticks = 0;
    unsigned halts = 0;
    unsigned resets = 0;
    unsigned all = 1;

    for (unsigned row = first_row[state]; row < first_row[state + 1u]; row++) {
        unsigned stands_for = 1;

        for (unsigned child = 0; child < children; child++) {
            stands_for *= rows[row].returns[child] == CANOPY_IDLE ? 4u : 1u;
        }
        ticks += rows[row].operation == 't' ? stands_for : 0u;
        halts += rows[row].operation == 'h' ? stands_for : 0u;
        resets += rows[row].operation == 'r' ? stands_for : 0u;
    }
    for (unsigned child = 0; child < children; child++) {
        all *= 4u;
    }
    TEST_ASSERT_EQUAL_MESSAGE(all, ticks, rows[first_row[state]].text);
    TEST_ASSERT_EQUAL_MESSAGE(all, halts, rows[first_row[state]].text);
    TEST_ASSERT_EQUAL_MESSAGE(all, resets, rows[first_row[state]].text);
}

static void set_up_engine(engine_t *engine)
{
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_init(&engine->instance, &tree, engine->status, engine->words, NULL));
    engine->now = UINT64_MAX - 1500u; /* the wrap-around of time falls between the second and the third row */
}

static void copy_engine(engine_t *to, const engine_t *from)
{
    *to = *from;
    to->instance.status = to->status;
    to->instance.words = to->words;
}

static void take(engine_t *engine, const row_t *row)
{
    canopy_status_t status = CANOPY_IDLE;

    current = row;
    calls[0] = '\0';
    if (row->operation == 't') {
        status = canopy_tree_tick(&engine->instance, engine->now);
    } else if (row->operation == 'h') {
        canopy_tree_halt(&engine->instance);
    } else {
        canopy_tree_reset(&engine->instance);
    }
    engine->now += 1000u;
    rows_walked++;
    if (status != row->status || strcmp(calls, row->calls) != 0 || engine->instance.faults != 0u ||
        canopy_tree_status(&engine->instance, 0) != status) {
        TEST_ASSERT_EQUAL_STRING_MESSAGE(row->calls, calls, row->text);
        TEST_ASSERT_EQUAL_MESSAGE(row->status, status, row->text);
        TEST_ASSERT_EQUAL_MESSAGE(row->status, canopy_tree_status(&engine->instance, 0), row->text);
        TEST_FAIL_MESSAGE(row->text);
    }
}

/** Every path of `depth` rows from here. */
static void walk(const engine_t *from, unsigned state, unsigned depth)
{
    for (unsigned row = first_row[state]; row < first_row[state + 1u] && depth > 0u; row++) {
        engine_t engine;

        if (cannot_be(&rows[row])) {
            continue;
        }
        copy_engine(&engine, from);
        take(&engine, &rows[row]);
        walk(&engine, rows[row].next, depth - 1u);
    }
}

/** Every row once, by the shortest way to its state: rows are listed in the order in which states are found. */
static void walk_all_states(void)
{
    static engine_t reached[STATES_MAX];
    unsigned known = 1;

    set_up_engine(&reached[0]);
    for (unsigned state = 0; state < state_count; state++) {
        rows_are_complete(state);
        for (unsigned row = first_row[state]; row < first_row[state + 1u]; row++) {
            engine_t engine;

            copy_engine(&engine, &reached[state]);
            take(&engine, &rows[row]);
            TEST_ASSERT_LESS_OR_EQUAL_MESSAGE(known, rows[row].next, rows[row].text);
            if (rows[row].next == known && known < state_count) {
                copy_engine(&reached[known++], &engine);
            }
        }
    }
    TEST_ASSERT_EQUAL(state_count, known);
}

static void every_node_does_what_the_table_says(void)
{
    size_t line = 0;

    while (line < TABLE_ROWS) {
        engine_t start;

        read_node(table[line]);
        line = read_rows(line + 1u);
        conditions = 0;
        set_up_engine(&start);
        walk_all_states();
        walk(&start, 0, DEPTH);
        for (conditions = 1; conditions < 1u << children; conditions++) {
            for (unsigned child = 0; child < children; child++) {
                bool is_condition = (conditions >> child & 1u) != 0u;

                nodes[child + 1u].type = (uint8_t)(is_condition ? CANOPY_NODE_CONDITION : CANOPY_NODE_STATEFUL_ACTION);
            }
            set_up_engine(&start);
            walk(&start, 0, DEPTH);
        }
    }
    TEST_ASSERT_GREATER_THAN_UINT64(1000000, rows_walked);
}

/** The table has every control node and decorator that asks no script and is not the user's own. */
static void the_table_is_complete(void)
{
    static const bool elsewhere[CANOPY_NODE_TYPES] = {[CANOPY_NODE_PRECONDITION] = true,
                                                      [CANOPY_NODE_ATTRIBUTES] = true,
                                                      [CANOPY_NODE_SKIP_UNLESS_UPDATED] = true,
                                                      [CANOPY_NODE_WAIT_VALUE_UPDATE] = true,
                                                      [CANOPY_NODE_LOOP] = true,
                                                      [CANOPY_NODE_SWITCH] = true,
                                                      [CANOPY_NODE_USER_CONTROL] = true,
                                                      [CANOPY_NODE_USER_DECORATOR] = true};
    static const bool is_leaf[CANOPY_NODE_TYPES] = {
#define LEAF true
#define CONTROL false
#define DECORATOR false
#define CANOPY_NODE(id, name, category, least, most, words, count, parameters, text) [CANOPY_NODE_##id] = (category),
#include "canopy/nodes.def"
#undef CANOPY_NODE
    };

    for (unsigned type = 0; type < CANOPY_NODE_TYPES; type++) {
        bool found = elsewhere[type] || is_leaf[type];

        for (size_t line = 0; line < TABLE_ROWS && !found; line++) {
            const char *name = table[line] + 2;

            found = table[line][0] == '@' && is_name(names[type], name, word_length(name));
        }
        TEST_ASSERT_TRUE_MESSAGE(found, names[type]);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_table_is_complete);
    RUN_TEST(every_node_does_what_the_table_says);
    return UNITY_END();
}
