/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The engine against the conformance table: every path of three rows from the start of every node, halts and resets
 * included, and every row at least once. The table is constant data, so this runs on a target without files.
 *
 * Each child is a StatefulAction, and in further walks a Condition, in every mixture; a Condition is never RUNNING, so such
 * a walk leaves out the rows in which it would be. A Switch with more than MIXED_CHILDREN_MAX children is spared these.
 *
 * What scripts and the user's own functions answer stands in the row, in the order in which they are asked.
 */
#include <string.h>

#include "canopy/node.h"
#include "table_text.h"
#include "unity.h"

enum {
    PARAMETERS_MAX = 8,
    WORDS = 4,
    STATES_MAX = 256,
    ROWS_MAX = 1024,
    CALLS_MAX = 24,
    DEPTH = 3,
    MIXED_CHILDREN_MAX = 3
};

static const char *const table[] = {
#include "conformance_table.inc"
};

#define TABLE_ROWS (sizeof table / sizeof table[0])

static const char *const names[CANOPY_NODE_TYPES] = {
#define CANOPY_NODE(id, name, category, least, most, words, count, parameters, text) [CANOPY_NODE_##id] = (name),
#include "canopy/nodes.def"
#undef CANOPY_NODE
};

/** All that a tick depends on, copied to come back to it. */
typedef struct {
    canopy_time_t now;
    uint16_t words[WORDS];
    uint8_t status[CHILDREN_MAX + 1];
} state_t;

static row_t rows[ROWS_MAX];
static unsigned row_count;
static unsigned first_row[STATES_MAX + 1]; /* rows of a state lie together */
static unsigned state_count;
static unsigned children;
static uint64_t rows_walked;

static canopy_node_t nodes[CHILDREN_MAX + 1];
static int32_t parameters[PARAMETERS_MAX];
static unsigned answers_of[PARAMETERS_MAX]; /* how many a script may give; 0: it is not asked */
static const char *script_letters;
static canopy_tree_t tree;
static canopy_tree_instance_t instance;
static state_t now; /* of the instance */
static const row_t *current;
static const char *next_answer;
static char calls[CALLS_MAX];
static unsigned call_count;

static void note(char who, char how)
{
    if (call_count >= CALLS_MAX - 2) { /* Unity's assertions are calls, and this is where the time goes */
        TEST_FAIL_MESSAGE(current->text);
    }
    calls[call_count++] = who;
    if (how != ' ') {
        calls[call_count++] = how;
    }
}

static canopy_status_t leaf_start(void *application, uint16_t leaf)
{
    (void)application;
    note((char)('a' + leaf), ' ');
    return (canopy_status_t)current->returns[leaf];
}

static canopy_status_t leaf_running(void *application, uint16_t leaf)
{
    (void)application;
    note((char)('a' + leaf), '\'');
    return (canopy_status_t)current->returns[leaf];
}

static void leaf_halted(void *application, uint16_t leaf)
{
    (void)application;
    note((char)('a' + leaf), '!');
}

static const canopy_leaf_t leaf = {.tick = leaf_start, .running = leaf_running, .halted = leaf_halted};
static unsigned conditions; /* bit of a child: it is a Condition */

void setUp(void)
{
}

void tearDown(void)
{
}

/** The next answer that the row has; an upper-case letter stands for itself. */
static int32_t take_answer(void)
{
    int32_t answer;

    if (*next_answer != '?' && *next_answer != ',') {
        TEST_FAIL_MESSAGE(current->text);
    }
    next_answer++;
    if (*next_answer >= 'A' && *next_answer <= 'Z') {
        answer = (unsigned char)*next_answer++;
    } else {
        next_answer = read_number(next_answer, &answer);
    }
    return answer;
}

/** A script that is only run gives something, too: its place, which nothing may depend on. */
static int32_t run_script(unsigned which)
{
    note(script_letters[which], ' ');
    return answers_of[which] != 0u ? take_answer() : (int32_t)which;
}

#define SCRIPT(which)                                \
    static int32_t script_##which(void *application) \
    {                                                \
        (void)application;                           \
        return run_script(which);                    \
    }
SCRIPT(0)
SCRIPT(1)
SCRIPT(2)
SCRIPT(3)
SCRIPT(4)
SCRIPT(5)
SCRIPT(6)
SCRIPT(7)
static const canopy_script_t scripts[PARAMETERS_MAX] = {script_0, script_1, script_2, script_3,
                                                        script_4, script_5, script_6, script_7};

/** What a function of the user's own answers: a status that the node is done with, the next child, or a child's number. */
static canopy_step_t take_step(uint16_t node, uint16_t child)
{
    bool is_letter = next_answer[0] != '\0' && next_answer[1] >= 'A' && next_answer[1] <= 'Z';
    int32_t answer = take_answer();

    if (is_letter && answer == 'N') {
        return nodes[child].end != nodes[node].end ? nodes[child].end : canopy_done(CANOPY_RUNNING);
    }
    return is_letter ? canopy_done(status_of((char)answer)) : (canopy_step_t)answer;
}

static canopy_step_t own_enter(canopy_tree_instance_t *self, uint16_t node)
{
    note('E', canopy_resumes(self, node) ? '\'' : ' ');
    return take_step(node, node);
}

static canopy_step_t own_child(canopy_tree_instance_t *self, uint16_t node, uint16_t child, canopy_status_t status)
{
    (void)self;
    note('C', ' ');
    if (status != current->returns[child - 1u]) {
        TEST_FAIL_MESSAGE(current->text);
    }
    return take_step(node, child);
}

static void own_halt(canopy_tree_instance_t *self, uint16_t node)
{
    (void)self;
    (void)node;
    note('H', ' ');
}

static canopy_control_t own;

/** A number; "!", a script that is run; "?0,1", one that is asked. @return what follows it */
static const char *read_parameter(const char *text, unsigned which)
{
    while (*text == ' ') {
        text++;
    }
    if (*text != '?' && *text != '!') {
        return read_number(text, &parameters[which]);
    }
    parameters[which] = (int32_t)which;
    if (nodes[0].type < (uint8_t)CANOPY_NODE_PRECONDITION) { /* a number, which an entry gives */
        nodes[0].asks |= (uint8_t)(1u << which);
    }
    answers_of[which] = *text == '?' ? 1u : 0u;
    for (; *text != '\0' && *text != ' '; text++) {
        answers_of[which] += *text == ',' ? 1u : 0u;
    }
    return text;
}

/** "@ node children parameters...": the tree of it. */
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
    nodes[0] = (canopy_node_t){.type = (uint8_t)type, .end = (uint16_t)(children + 1u)};
    for (unsigned child = 1; child <= children; child++) {
        nodes[child] = (canopy_node_t){.type = CANOPY_NODE_STATEFUL_ACTION,
                                       .end = (uint16_t)(child + 1u),
                                       .state = WORDS,
                                       .parameter = (uint16_t)(child - 1u)};
    }
    memset(parameters, 0, sizeof parameters);
    memset(answers_of, 0, sizeof answers_of);
    for (unsigned which = 0; *rest != '\0'; which++) {
        TEST_ASSERT_LESS_THAN_MESSAGE(PARAMETERS_MAX, which, line);
        rest = read_parameter(rest, which);
    }
    script_letters = "ABCDEFGH";
    if (type == CANOPY_NODE_USER_CONTROL || type == CANOPY_NODE_USER_DECORATOR) {
        script_letters = "ECH";
        own = (canopy_control_t){.enter = own_enter, .child = own_child, .halt = parameters[2] < 0 ? NULL : own_halt};
        nodes[0].asks = 0;
    }
    tree = (canopy_tree_t){.nodes = nodes,
                           .leaves = &leaf,
                           .controls = &own,
                           .scripts = scripts,
                           .parameters = parameters,
                           .node_count = (uint16_t)(children + 1u),
                           .leaf_count = 1,
                           .control_count = 1,
                           .script_count = PARAMETERS_MAX,
                           .parameter_count = PARAMETERS_MAX,
                           .word_count = WORDS};
    TEST_ASSERT_EQUAL_MESSAGE(CANOPY_OK, canopy_tree_validate(&tree, NULL), line);
}

/** A Condition cannot do what the row asks of it. */
static bool cannot_be(const row_t *row)
{
    for (unsigned child = 0; child < children; child++) {
        if ((conditions >> child & 1u) != 0u && row->returns[child] == (uint8_t)CANOPY_RUNNING) {
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
        if (read_row(table[line], children, &rows[row_count]) == state_count) {
            TEST_ASSERT_LESS_THAN(STATES_MAX, state_count);
            first_row[state_count++] = row_count;
        }
        row_count++;
    }
    first_row[state_count] = row_count;
    return line;
}

/** How many answers there are to a call: of a child that is ticked, of a script that is asked; else 1. */
static unsigned answers_to(const char *call)
{
    if (*call >= 'a' && *call <= 'z') {
        return call[1] == '!' ? 1u : 4u;
    }
    for (unsigned which = 0; script_letters[which] != '\0'; which++) {
        if (*call == script_letters[which] && answers_of[which] != 0u) {
            return answers_of[which];
        }
    }
    return 1u;
}

/**
 * The rows of a state name all combinations of answers, of a tick, of a halt, and of a reset. Each row stands for one of as
 * many as there are answers to all that it asks; these parts of the whole make 1. Parts are counted in units by which all
 * products of 2, 3, 5 and 7 that occur can be divided.
 */
static void rows_are_complete(unsigned state)
{
    static const char operations[] = "thr";
    static const uint64_t whole = UINT64_C(1048576) * 2187u * 15625u * 49u;

    for (unsigned operation = 0; operation < 3u; operation++) {
        uint64_t sum = 0;

        for (unsigned row = first_row[state]; row < first_row[state + 1u]; row++) {
            uint64_t part = rows[row].operation == operations[operation] ? whole : 0u;

            for (unsigned call = 0; call < rows[row].calls_length; call++) {
                unsigned answers = answers_to(&rows[row].calls[call]);

                TEST_ASSERT_TRUE_MESSAGE(part % answers == 0u, rows[row].text);
                part /= answers;
            }
            sum += part;
        }
        TEST_ASSERT_TRUE_MESSAGE(sum == whole, rows[first_row[state]].text);
    }
}

static void set_up_engine(void)
{
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_init(&instance, &tree, now.status, now.words, NULL));
    now.now = UINT64_MAX - 1500u; /* the wrap-around of time falls between the second and the third row */
}

static void take(const row_t *row)
{
    canopy_status_t status = CANOPY_IDLE;
    uint32_t faults = row->fault ? 1u : 0u;

    current = row;
    next_answer = row->answers;
    call_count = 0;
    instance.faults = 0;
    if (row->operation == 't') {
        status = canopy_tree_tick(&instance, now.now);
    } else if (row->operation == 'h') {
        canopy_tree_halt(&instance);
    } else {
        canopy_tree_reset(&instance);
    }
    now.now += 1000u;
    rows_walked++;
    if (status != row->status || call_count != row->calls_length || memcmp(calls, row->calls, call_count) != 0 ||
        *next_answer != ' ' || instance.faults != faults || canopy_tree_status(&instance, 0) != status) {
        calls[call_count] = '\0';
        TEST_MESSAGE(calls);
        TEST_ASSERT_EQUAL_MESSAGE(row->status, status, row->text);
        TEST_ASSERT_EQUAL_MESSAGE(row->status, canopy_tree_status(&instance, 0), row->text);
        TEST_ASSERT_EQUAL_MESSAGE(faults, instance.faults, row->text);
        TEST_FAIL_MESSAGE(row->text);
    }
}

/** Every path of `depth` rows from here. */
static void walk(unsigned state, unsigned depth)
{
    const state_t here = now;

    for (unsigned row = first_row[state]; row < first_row[state + 1u]; row++) {
        if (cannot_be(&rows[row])) {
            continue;
        }
        now = here;
        take(&rows[row]);
        if (depth > 1u) {
            walk(rows[row].next, depth - 1u);
        }
    }
}

/** Every row once, by the shortest way to its state: rows are listed in the order in which states are found. */
static void walk_all_states(void)
{
    static state_t reached[STATES_MAX];
    unsigned known = 1;

    set_up_engine();
    reached[0] = now;
    for (unsigned state = 0; state < state_count; state++) {
        rows_are_complete(state);
        for (unsigned row = first_row[state]; row < first_row[state + 1u]; row++) {
            now = reached[state];
            take(&rows[row]);
            TEST_ASSERT_LESS_OR_EQUAL_MESSAGE(known, rows[row].next, rows[row].text);
            if (rows[row].next == known && known < state_count) {
                reached[known++] = now;
            }
        }
    }
    TEST_ASSERT_EQUAL(state_count, known);
}

static void every_node_does_what_the_table_says(void)
{
    size_t line = 0;

    while (line < TABLE_ROWS) {
        unsigned mixtures;

        read_node(table[line]);
        line = read_rows(line + 1u);
        conditions = 0;
        walk_all_states();
        set_up_engine();
        walk(0, DEPTH);
        mixtures = children <= MIXED_CHILDREN_MAX ? 1u << children : 1u;
        for (conditions = 1; conditions < mixtures; conditions++) {
            for (unsigned child = 0; child < children; child++) {
                bool is_condition = (conditions >> child & 1u) != 0u;

                nodes[child + 1u].type = (uint8_t)(is_condition ? CANOPY_NODE_CONDITION : CANOPY_NODE_STATEFUL_ACTION);
            }
            set_up_engine();
            walk(0, DEPTH);
        }
    }
    TEST_ASSERT_GREATER_THAN_UINT64(1000000, rows_walked);
}

/** The table has every node but the kinds of leaves of the user's own, which are the children. */
static void the_table_is_complete(void)
{
    static const bool is_child[CANOPY_NODE_TYPES] = {
        [CANOPY_NODE_CONDITION] = true, [CANOPY_NODE_SYNC_ACTION] = true, [CANOPY_NODE_STATEFUL_ACTION] = true};

    for (unsigned type = 0; type < CANOPY_NODE_TYPES; type++) {
        bool found = is_child[type];

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
