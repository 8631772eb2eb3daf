/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A second decoder of the trace, written from docs/trace.md alone: it shares nothing with the runtime, which makes the
 * frames, nor with canopy.trace.TraceDecoder, to which it is compared (tests/trace/test_decoders.py).
 *
 * It says of each node and of each slot what is certain of a tick, what was told last and may be old, and what is not
 * known. Frames have to come in the order of the bus; any of them may be missing.
 *
 * Memory: the caller's. Nothing blocks, allocates or recurses; a frame costs O(nodes + slots) at most.
 */
#ifndef CANOPY_TESTS_TRACE_DECODER_H
#define CANOPY_TESTS_TRACE_DECODER_H

#include <stdbool.h>
#include <stdint.h>

#include "canopy/can.h"

enum {
    DECODER_VERSION = 2,
    DECODER_CODES = 15,      /**< Codes 0..14. */
    DECODER_AGES_MAX = 1024, /**< Bytes of a tick's list of ages that are kept. */
    DECODER_PAGES = 5,       /**< Of CanopyHealth. */
    DECODER_BINS = 12        /**< Of its page Lateness. */
};

/** What the model file says. */
typedef struct {
    uint32_t base;       /**< Arbitration id of CanopyTick; the other seven follow it. */
    bool is_extended;    /**< The ids have 29 bits. */
    uint32_t hash;       /**< First 8 digits of the model file's hash. */
    uint16_t node_count; /**< 1..65534. */
    uint16_t slot_count; /**< 0..4096. */
    uint8_t changes_max; /**< Most CanopyChange frames of a tick, 1..32. */
} decoder_model_t;

/** A node, or a slot. Read `is_certain`, `shown` and what follows when a tick is over; the rest is the decoder's. */
typedef struct {
    uint32_t told;       /**< Code, or 32 bits of a value, told last. */
    uint32_t marked;     /**< The tick that is at hand has told it, or says that it has not changed: decoder_t.mark. */
    uint32_t shown;      /**< With is_certain. */
    uint32_t since;      /**< Number of a tick. */
    bool is_known;       /**< `told` may be shown as old; else it is not to be shown at all. */
    bool is_certain;     /**< `shown` is the truth at the end of this tick. */
    bool is_since_exact; /**< It became so in the tick `since`; else in this tick or an earlier one. */
} decoder_cell_t;

/** What a tick worked with; `came` is false when CanopyInputs was lost. */
typedef struct {
    bool came;
    bool is_sure; /**< A frame of the same tick has come behind it; else ask whether the next CanopyTick is the next. */
    bool is_whole; /**< The list of ages is complete, as far as can be seen. */
    uint32_t now;  /**< [us], modulo 2^24. */
    uint8_t taken;
    uint8_t check;
    uint8_t can_state;
    bool overload;
    bool returning;
    bool many; /**< The list begins with the number of frames, in 4 bytes. */
    uint16_t age_bytes;
    uint8_t ages[DECODER_AGES_MAX];
} decoder_inputs_t;

/** Counters of the controller since its start. */
typedef struct {
    uint8_t pages; /**< Bit k: page k has come since the controller's start. */
    bool filtered; /**< The driver hands over no unknown frames. */
    uint16_t rx_rejected, rx_unknown, rx_lost, tx_replaced, tx_expired, trace_dropped, overruns, leaf_faults, rx_errors,
        timeouts;
    uint8_t rx_backlogs, restarts, slips;
    uint32_t longest_cycle; /**< [us] */
    uint32_t latest_start;  /**< [us], in steps of 10. */
    uint8_t lateness[DECODER_BINS];
} decoder_health_t;

typedef enum {
    DECODER_RUNS = 0,
    DECODER_OTHER_VERSION, /**< The controller speaks another version of the format. */
    DECODER_OTHER_TREE     /**< It runs another tree than that of the model file. */
} decoder_stop_t;

/** The tick at hand: what CanopyTick announced, and what of it has come. */
typedef struct {
    uint32_t number;
    bool is_start;    /**< The controller's first one: everything was 0 before. */
    bool is_followed; /**< Another frame of the trace has come behind CanopyTick. */
    uint8_t root;
    uint8_t overruns; /**< Modulo 4. */
    bool has_snapshot, has_changes;
    uint8_t values; /**< CanopyValue frames announced. */
    bool snapshot_came;
    bool last_came;   /**< The last CanopyChange. */
    bool nodes_wait;  /**< It says that nodes wait. */
    bool broken;      /**< Frames between its CanopyTick and the newest one are missing. */
    bool has_node;    /**< A CanopyChange has named `first` and `last`. */
    bool has_wrapped; /**< They have begun once more at 0. */
    uint16_t first, last;
    uint8_t values_came;
    bool slots_wait;
    bool arrivals_open; /**< CanopyArrivals is to come. */
    decoder_inputs_t inputs;
} decoder_tick_t;

struct decoder;

/** A tick is over: look at its number, cells, inputs. */
typedef void (*decoder_over_t)(void *context, const struct decoder *self);

typedef struct decoder {
    const decoder_model_t *model;
    decoder_cell_t *nodes; /**< model->node_count of them. */
    decoder_cell_t *slots; /**< model->slot_count of them. */
    decoder_over_t over;
    void *context;
    decoder_stop_t stop;
    bool is_at_hand; /**< The tick is not over. */
    decoder_tick_t tick;
    uint32_t mark;     /**< Counts CanopyTick frames. */
    bool has_ticked;   /**< A CanopyTick has come. */
    uint8_t first_seq; /**< Sequence of the last CanopyTick. */
    uint8_t sequence;  /**< Of the last frame that has one. */
    uint8_t came;      /**< Frames with a Sequence since that CanopyTick, without it. */
    uint64_t lost;     /**< Frames with a Sequence that are missing. */
    uint64_t refused;  /**< Frames that cannot be. */
    uint64_t strays;   /**< Frames whose CanopyTick is missing. */
    uint32_t starts;   /**< Starts of the controller that were seen: tick 0, or a number that did not go up. */
    decoder_health_t health;
    bool has_upper;      /**< Page 1 of CanopyModel has come. */
    uint16_t upper_tick; /**< Modulo 65536. */
    uint32_t upper_now;  /**< Bits 24..47 of its Now. */
} decoder_t;

/**
 * Everything unknown.
 *
 * @param nodes,slots memory for model->node_count and model->slot_count cells
 * @param over        called at the end of each tick; may be NULL
 */
void decoder_init(decoder_t *self, const decoder_model_t *model, decoder_cell_t *nodes, decoder_cell_t *slots,
                  decoder_over_t over, void *context);

/** The next frame of the bus, the trace's or not. Does nothing once `stop` says why. */
void decoder_take(decoder_t *self, const canopy_can_frame_t *frame);

/** No more frames of the tick at hand can come: four periods have passed since its CanopyTick, or the log is at its end. */
void decoder_silence(decoder_t *self);

/** Between decoder.c and decoder_frames.c: the frames without a Sequence. They return whether the frame can be. */
bool decoder_value(decoder_t *self, const uint8_t *data);
bool decoder_inputs(decoder_t *self, const uint8_t *data);
bool decoder_arrivals(decoder_t *self, const uint8_t *data);
bool decoder_health(decoder_t *self, const uint8_t *data);
bool decoder_tree(decoder_t *self, const uint8_t *data);

/** The frame at hand belongs to a tick whose CanopyTick is missing: the tick is over, and nothing is known of the nodes. */
void decoder_stray(decoder_t *self);

static inline uint16_t decoder_u16(const uint8_t *bytes)
{
    return (uint16_t)(bytes[0] | ((unsigned)bytes[1] << 8));
}

static inline uint32_t decoder_u32(const uint8_t *bytes)
{
    return decoder_u16(bytes) | ((uint32_t)decoder_u16(&bytes[2]) << 16);
}

#endif
