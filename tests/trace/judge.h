/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A receiver: a lossy channel, the second decoder, and what must hold of each tick that it shows, against the truth.
 */
#ifndef CANOPY_TESTS_TRACE_JUDGE_H
#define CANOPY_TESTS_TRACE_JUDGE_H

#include <stdio.h>

#include "controller.h"
#include "decoder.h"

/** How frames are lost. */
typedef struct {
    const char *name;
    uint32_t of_1000;    /**< Each by itself. */
    uint32_t bursts;     /**< Of 1000 frames so many begin a burst, */
    uint32_t burst_most; /**< which takes 1 to so many frames. */
    uint32_t damaged;    /**< Of 1000 frames so many have a bit flipped: nothing is judged but by the other decoder. */
} channel_t;

/** What was seen. */
typedef struct {
    uint64_t ticks; /**< That the controllers did. */
    uint64_t shown; /**< That the decoder showed. */
    uint64_t frames;
    uint64_t lost;
    uint64_t wrong; /**< Shown as certain; with judge_t.only_counts. Else one ends the program. */
    uint64_t nodes_certain, nodes_old, nodes_unknown;
    uint64_t slots_certain, slots_old, slots_unknown;
    uint64_t inputs;
    uint32_t known_after; /**< Most ticks from a loss until all nodes and slots were known. */
    uint32_t promised;    /**< Of that controller. */
} tally_t;

typedef struct {
    const controller_t *controller;
    const channel_t *channel;
    random_t random;
    decoder_model_t model;
    decoder_t decoder;
    decoder_cell_t nodes[NODES_MAX];
    decoder_cell_t slots[SLOTS_MAX];
    bool has_clock;   /**< Waits four periods for the rest of a tick, and no longer. True but for a test. */
    bool only_counts; /**< Counts what is wrong; judges nothing else. */
    unsigned silent_from, silent_to; /**< Of a tick's frames these are lost, too: from the one on, up to the other. */
    uint64_t tick;                   /**< The tick at hand, counted like controller_t.ticks. */
    uint64_t came_in;                /**< The tick in which its CanopyTick came. */
    uint64_t lost_in;                /**< The tick in which a frame of nodes or values was lost last. */
    uint64_t any_lost_in;            /**< The same of any frame. */
    bool has_lost;
    bool is_disturbed; /**< Something was lost since all was known. */
    uint64_t last_shown;
    bool has_shown, was_all_certain, were_slots_certain;
    uint32_t burst;   /**< Frames of a burst that are still to be lost. */
    uint32_t dropped; /**< By the controller, so far. */
    bool has_sent;
    uint8_t sent;        /**< Sequence of the controller's last frame that has one. */
    uint8_t counter;     /**< E2E counter of its last CanopyTick. */
    uint64_t lost_since; /**< Frames with a Sequence that the channel has lost since the last CanopyTick that came, */
    uint64_t lost_told;  /**< and before it, as far as a receiver can know. */
    bool is_lost_less;   /**< 64 and more at once: Sequence shows less. */
    tally_t *tally;
    FILE *log; /**< Frames and what is shown of them, for the other decoder; or NULL. */
    decoder_cell_t logged_nodes[NODES_MAX];
    decoder_cell_t logged_slots[SLOTS_MAX];
} judge_t;

/** A receiver that joins. */
void judge_start(judge_t *self, const controller_t *controller, const channel_t *channel, uint64_t seed, tally_t *tally,
                 FILE *log);

/** Takes the frames of the controller's last tick. */
void judge_tick(judge_t *self);

/** The controller has started again: what waited in it is lost. Before its first tick. */
void judge_note_start(judge_t *self);

/** The end: the last tick is shown. */
void judge_end(judge_t *self);

/** Ticks within which all is known after a loss: the whole tree in snapshots, and every value once. */
uint32_t judge_known_within(const controller_t *controller);

#endif
