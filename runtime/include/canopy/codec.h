/* SPDX-License-Identifier: MIT */
/**
 * @file
 * What the codecs that `canopy codec` makes say of a frame. Include it through the generated NAME_codec.h.
 *
 * For each message M of a DBC named NAME there is a plain struct NAME_M_t of raw values and
 *
 *     void NAME_M_init(NAME_M_t *self);
 *     canopy_codec_result_t NAME_M_decode(NAME_M_t *self, const uint8_t *data, size_t length);
 *     int NAME_M_encode(const NAME_M_t *self, uint8_t *data, size_t size);
 *
 * They have no state and no memory of their own, never block, may be called from anywhere, and take O(bytes). A codec
 * counts nothing by itself: its results say what there is to count.
 */
#ifndef CANOPY_CODEC_H
#define CANOPY_CODEC_H

/** What decode says. Whatever is not OK has changed nothing. */
typedef enum {
    CANOPY_CODEC_OK = 0,
    CANOPY_CODEC_WRONG_LENGTH =
        -1, /**< The frame does not have the message's length; encode: there is no room for it. */
    CANOPY_CODEC_OUT_OF_RANGE =
        -2 /**< A value outside the DBC's range, NaN, infinity, or no branch of a multiplexer. */
} canopy_codec_result_t;

#endif
