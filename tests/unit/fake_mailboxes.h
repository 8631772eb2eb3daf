/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A CAN driver for tests with up to four mailboxes in which frames stay until the test lets them out or back, and a clock
 * that moves when the test says so, or while the loop waits.
 */
#ifndef CANOPY_TESTS_FAKE_MAILBOXES_H
#define CANOPY_TESTS_FAKE_MAILBOXES_H

#include "canopy/can.h"
#include "canopy/status.h"
#include "unity.h"

enum { BOXES = 4, OUT_MAX = 1024 };

typedef struct {
    canopy_can_frame_t box[BOXES];
    canopy_can_outcome_t outcome[BOXES]; /* what outcome() says of a full box */
    bool is_full[BOXES];
    bool is_aborting[BOXES];
    canopy_can_outcome_t aborted_is; /* what becomes of a frame that is taken back; PENDING: it takes a while */
    canopy_can_outcome_t taken_is;   /* what becomes of a frame at once; PENDING: it waits in its box */
    int result;                      /* what send() says */
    unsigned offered;                /* calls of send() */
    unsigned aborts;
    unsigned requests;
    canopy_can_frame_t out[OUT_MAX];
    unsigned out_count;
} fake_boxes_t;

static fake_boxes_t boxes;

static inline int boxes_receive(void *context, canopy_can_frame_t *frame)
{
    (void)context;
    (void)frame;
    return 0;
}

static inline void boxes_note_out(const canopy_can_frame_t *frame)
{
    TEST_ASSERT_LESS_THAN_UINT(OUT_MAX, boxes.out_count);
    boxes.out[boxes.out_count++] = *frame;
}

static inline int boxes_send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    (void)context;
    boxes.offered++;
    TEST_ASSERT_LESS_THAN_UINT8(BOXES, mailbox);
    TEST_ASSERT_FALSE_MESSAGE(boxes.is_full[mailbox], "a frame for a mailbox that is full");
    if (boxes.result != 1) {
        return boxes.result;
    }
    boxes.box[mailbox] = *frame;
    boxes.outcome[mailbox] = boxes.taken_is;
    boxes.is_full[mailbox] = true;
    boxes.is_aborting[mailbox] = false;
    if (boxes.taken_is == CANOPY_CAN_SENT) {
        boxes_note_out(frame);
    }
    return 1;
}

static inline canopy_can_outcome_t boxes_outcome(void *context, uint8_t mailbox)
{
    (void)context;
    TEST_ASSERT_TRUE_MESSAGE(boxes.is_full[mailbox], "the outcome of nothing");
    if (boxes.outcome[mailbox] != CANOPY_CAN_PENDING) {
        boxes.is_full[mailbox] = false;
    }
    return boxes.outcome[mailbox];
}

static inline void boxes_abort(void *context, uint8_t mailbox)
{
    (void)context;
    TEST_ASSERT_TRUE_MESSAGE(boxes.is_full[mailbox], "nothing is taken back");
    TEST_ASSERT_FALSE_MESSAGE(boxes.is_aborting[mailbox], "taken back twice");
    boxes.aborts++;
    boxes.is_aborting[mailbox] = true;
    boxes.outcome[mailbox] = boxes.aborted_is;
    if (boxes.aborted_is == CANOPY_CAN_SENT) {
        boxes_note_out(&boxes.box[mailbox]);
    }
}

static inline void boxes_request(void *context)
{
    (void)context;
    boxes.requests++;
}

/** The wire takes the frame in a mailbox. */
static inline void boxes_let_out(uint8_t mailbox)
{
    TEST_ASSERT_TRUE(boxes.is_full[mailbox]);
    TEST_ASSERT_EQUAL(CANOPY_CAN_PENDING, boxes.outcome[mailbox]);
    boxes.outcome[mailbox] = CANOPY_CAN_SENT;
    boxes_note_out(&boxes.box[mailbox]);
}

static inline void boxes_reset(void)
{
    boxes = (fake_boxes_t){.result = 1, .aborted_is = CANOPY_CAN_ABORTED};
}

#endif
