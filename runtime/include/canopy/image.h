/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Tree images: another tree for a firmware that runs, as a block of bytes (docs/image.md has it byte by byte). How the
 * bytes come, over CAN or from a file, is the program's business.
 *
 *     uint16_t where;
 *     if (canopy_image_load(&NAME_image, bytes, size, &where) == CANOPY_IMAGE_OK) {
 *         (void)canopy_image_run(&NAME_image, &loop, now);
 *     }
 *
 * An image names leaves, scripts and entries by hash; what the firmware does not have in exactly that form is refused.
 * The image's bytes need no alignment and are not needed after the load.
 *
 * Memory: two buffers in the application's static object, so that an image can be loaded while another one runs. An
 * application without the option IMAGE_NODES has none of this, and this file's code is not linked.
 *
 * Threads: everything here belongs to the loop's thread, and is called between cycles (from after_cycle, or around
 * canopy_loop_cycle()); never from a leaf.
 */
#ifndef CANOPY_IMAGE_H
#define CANOPY_IMAGE_H

#include <stddef.h>

#include "canopy/loop.h"

#define CANOPY_IMAGE_VERSION 1u /**< Of the format. */
#define CANOPY_IMAGE_HEADER 56u /**< [bytes] */
#define CANOPY_IMAGE_SLOTS 2u   /**< Buffers: one runs, the other is loaded. */
#define CANOPY_IMAGE_NONE UINT16_MAX

/** Why an image is refused. Stable: the numbers may be logged and sent. `where` is what canopy_image_load() gives. */
typedef enum {
    CANOPY_IMAGE_OK = 0,
    CANOPY_IMAGE_ARGUMENT = -1, /**< A pointer is NULL. */
    CANOPY_IMAGE_SIZE = -2,     /**< More or fewer bytes than the image says, or than its parts need. */
    CANOPY_IMAGE_MAGIC = -3,    /**< Not an image. */
    CANOPY_IMAGE_FORMAT = -4,   /**< Another version of the format. */
    CANOPY_IMAGE_CRC = -5,      /**< Damaged. */
    CANOPY_IMAGE_ENGINE = -6,   /**< Made for a runtime with other node types. */
    CANOPY_IMAGE_TOO_LARGE =
        -7,                   /**< where: 0 nodes, 1 parameters, 2 state words, 3 texts: more than there is room for. */
    CANOPY_IMAGE_KIND = -8,   /**< where: place in the image's kinds; the firmware has no such leaf or control node. */
    CANOPY_IMAGE_SCRIPT = -9, /**< where: place in the image's scripts; the firmware has no such script. */
    CANOPY_IMAGE_ENTRY = -10, /**< where: place in the image's entries; the firmware has no such entry. */
    CANOPY_IMAGE_USES = -11,  /**< where: node; more uses of its kind than the firmware has room for. */
    CANOPY_IMAGE_PORTS = -12, /**< where: node; its ports are connected as in no use of the firmware, or wrongly. */
    CANOPY_IMAGE_TREE = -13   /**< where: node; canopy_tree_validate() refuses it, or what it names is not there. */
} canopy_image_error_t;

/** What a port is. Numbers within one firmware, not in images. */
typedef enum {
    CANOPY_IMAGE_NUMBER, /**< A number: constant, or read from an entry. */
    CANOPY_IMAGE_BOOL,   /**< As a number; a constant is 0 or 1. */
    CANOPY_IMAGE_TEXT,   /**< A pointer to a constant text. */
    CANOPY_IMAGE_READ,   /**< A pointer to an entry that the leaf reads. */
    CANOPY_IMAGE_WRITE   /**< A pointer to an entry that the leaf writes; NULL where the tree does not connect it. */
} canopy_image_form_t;

/** How an image gives a port's value. Numbers of the format. */
typedef enum {
    CANOPY_IMAGE_FROM_BASE = 0,     /**< As the use of the firmware with the same hash has it. */
    CANOPY_IMAGE_FROM_CONSTANT = 1, /**< The value itself. */
    CANOPY_IMAGE_FROM_TEXT = 2,     /**< Its first byte in the image's texts. */
    CANOPY_IMAGE_FROM_ENTRY = 3,    /**< Its place in the image's entries. */
    CANOPY_IMAGE_FROM_NOTHING = 4   /**< An output that is not connected. */
} canopy_image_source_t;

/** One port of a kind: where it is in the kind's ports struct. */
typedef struct {
    uint16_t member;  /**< Offset [bytes]. */
    uint16_t updates; /**< Offset of the pointer to the entry's update counter, or CANOPY_IMAGE_NONE. */
    uint16_t type;    /**< The C type's number in this firmware: an entry of another type does not fit. */
    uint8_t size;     /**< Of the member [bytes]. */
    uint8_t form;     /**< canopy_image_form_t. */
} canopy_image_port_t;

/** One kind of leaf, control node or decorator of yours. */
typedef struct {
    uint64_t hash; /**< Of its signature. */
    const canopy_image_port_t *ports;
    const void *base_ports;                /**< The ports structs of the uses in the firmware's own tree. */
    const uint64_t *base_hashes;           /**< Of what an image cannot give itself in those uses; 0: nothing. */
    void *pool[CANOPY_IMAGE_SLOTS];        /**< uses_max ports structs for images. */
    uint16_t *sources[CANOPY_IMAGE_SLOTS]; /**< For canopy_image_connect(): uses_max * port_count. */
    uint16_t *bases[CANOPY_IMAGE_SLOTS];   /**< uses_max: the use in the firmware's tree, or CANOPY_IMAGE_NONE. */
    uint16_t ports_size;                   /**< [bytes] */
    uint16_t port_count;
    uint16_t base_count;
    uint16_t index; /**< In canopy_tree_t.leaves or .controls. */
    uint8_t type;   /**< canopy_node_type_t. */
} canopy_image_kind_t;

/** One entry of the blackboard. */
typedef struct {
    uint64_t hash;    /**< Of its name, path, type and first value. */
    uint16_t offset;  /**< In the application's memory [bytes]. */
    uint16_t updates; /**< The same of its update counter, or CANOPY_IMAGE_NONE. */
    uint16_t type;    /**< As canopy_image_port_t.type. */
} canopy_image_entry_t;

/** The buffers of one image. */
typedef struct {
    canopy_node_t *nodes;
    int32_t *parameters;
    canopy_script_t *scripts; /**< As many as the firmware has. */
    char *texts;
} canopy_image_slot_t;

/** What is loaded and what runs. All zero is the start: the firmware's own tree runs. */
typedef struct {
    canopy_tree_t trees[CANOPY_IMAGE_SLOTS];
    uint64_t hashes[CANOPY_IMAGE_SLOTS];
    uint8_t running; /**< 0: the firmware's own tree; else 1 + slot. */
    uint8_t loaded;  /**< 0: none; else 1 + slot. */
} canopy_image_state_t;

/** What a firmware offers to images, and the room it has for them. Constant; made by `canopy compile`. */
typedef struct {
    const canopy_app_t *app;
    uint64_t engine; /**< Hash of the runtime's node types. */
    const canopy_image_kind_t *kinds;
    const uint64_t *scripts; /**< Hashes of app->tree->scripts. */
    const canopy_image_entry_t *entries;
    canopy_image_slot_t slots[CANOPY_IMAGE_SLOTS];
    canopy_image_state_t *state;
    uint16_t *counts; /**< kind_count: uses so far, while loading. */
    uint16_t kind_count;
    uint16_t entry_count;
    uint16_t script_leaf; /**< The leaf that runs scripts, or CANOPY_IMAGE_NONE. */
    uint16_t nodes_max;
    uint16_t parameters_max;
    uint16_t words_max;
    uint16_t uses_max;  /**< Of each kind. */
    uint32_t texts_max; /**< [bytes] */
} canopy_image_app_t;

/**
 * Checks an image and decodes it into the buffer that does not run. What runs is not touched, whatever the result. An
 * image that was loaded before and has not been run is given up.
 *
 * @param bytes the image, at any alignment
 * @param size  [bytes], exactly the image's
 * @param where when not NULL: receives what is wrong, see canopy_image_error_t
 * @return CANOPY_IMAGE_OK or why it is refused. O(size + nodes * kinds): not within a cycle's time for large images.
 */
canopy_image_error_t canopy_image_load(const canopy_image_app_t *self, const uint8_t *bytes, size_t size,
                                       uint16_t *where);

/**
 * Stops the tree that runs as canopy_loop_stop() does (halt handlers are called, safe values go out; it may wait for the
 * bus), and lets the loaded image begin with the next cycle: every entry has its first value, every leaf's state is 0.
 * Counters go on.
 *
 * @param now [us], as for canopy_loop_cycle()
 * @return CANOPY_OK. CANOPY_ERROR_BUS_DOWN: the image runs, but the safe values in between are not known to be out.
 *         CANOPY_ERROR_ARGUMENT when it is another application's loop, CANOPY_ERROR_NOT_FOUND when no image is loaded:
 *         then nothing is changed. O(nodes + messages).
 */
canopy_error_t canopy_image_run(const canopy_image_app_t *self, canopy_loop_t *loop, canopy_time_t now);

/** The same with the firmware's own tree; that is always there. */
canopy_error_t canopy_image_run_own(const canopy_image_app_t *self, canopy_loop_t *loop, canopy_time_t now);

/** The hash of the image that runs, as `canopy image show` prints it; 0 while the firmware's own tree runs. O(1). */
uint64_t canopy_image_running(const canopy_image_app_t *self);

/** For the generated code: fills in a use's ports as the image that runs connects them. O(ports). */
void canopy_image_connect(const canopy_image_app_t *self, uint16_t kind, uint16_t parameter, void *ports);

#endif
