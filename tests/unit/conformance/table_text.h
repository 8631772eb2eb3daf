/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Reads the lines of the conformance table, with what a target without a C library has, too.
 */
#ifndef CANOPY_TESTS_TABLE_TEXT_H
#define CANOPY_TESTS_TABLE_TEXT_H

#include <string.h>

#include "canopy/tree.h"

enum { CHILDREN_MAX = 7 };

/** What the row of the table says; the texts end at the next blank. */
typedef struct {
    const char *text;
    const char *answers; /**< Of scripts. */
    const char *calls;
    uint16_t next;
    uint8_t calls_length;
    char operation; /**< t tick, h halt, r reset. */
    uint8_t returns[CHILDREN_MAX];
    uint8_t status;
    bool fault;
} row_t;

/** Status of a letter; IDLE of any other one. */
static inline canopy_status_t status_of(char letter)
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

/** Length of the word that begins here. */
static inline size_t word_length(const char *text)
{
    size_t length = 0;

    while (text[length] != '\0' && text[length] != ' ') {
        length++;
    }
    return length;
}

/* NOLINTBEGIN(clang-analyzer-security.ArrayBound): it guesses lengths of words that the table's lines do not have. */
/** Reads a whole number, after blanks. @return what follows it */
static inline const char *read_number(const char *text, int32_t *number)
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
static inline bool is_name(const char *name, const char *word, size_t length)
{
    return strlen(name) == length && memcmp(name, word, length) == 0;
}

/** "state | children return ? scripts answer | node returns | calls | next state". @return the state. */
static inline unsigned read_row(const char *line, unsigned children, row_t *row)
{
    int32_t state;
    int32_t next;
    const char *field = read_number(line, &state);
    size_t length = 0;
    bool answered;

    field += strlen(" | ");
    row->text = line;
    row->operation = *field == 'h' || *field == 'r' ? *field : 't';
    while (field[length] != ' ' && field[length] != '?') {
        length++;
    }
    answered = length == children || (length > children && field[length - children - 1u] == ':');
    for (unsigned child = 0; child < children; child++) {
        row->returns[child] = answered ? (uint8_t)status_of(field[length - children + child]) : (uint8_t)CANOPY_IDLE;
    }
    row->answers = &field[length];
    field += word_length(field) + strlen(" | ");
    row->status = (uint8_t)status_of(*field);
    row->fault = field[1] == '!';
    field += word_length(field) + strlen(" | ");
    row->calls = field;
    length = word_length(field);
    row->calls_length = *field == '-' ? 0u : (uint8_t)length;
    (void)read_number(field + length + strlen(" | "), &next);
    row->next = (uint16_t)next;
    return (unsigned)state;
}

#endif
