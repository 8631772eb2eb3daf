/* SPDX-License-Identifier: MIT */
/** @file Tree images: checked from the outside in, decoded byte by byte, and run only as a whole. */
#include "image_parts.h"

enum { CRC_AT = 12, CRC_SIZE = 4 };

/** CRC-32 of IEEE 802.3 (zlib's), without a table: an image is loaded seldom. */
static uint32_t crc32(uint32_t crc, const uint8_t *bytes, size_t size)
{
    for (size_t index = 0; index < size; index++) {
        crc ^= bytes[index];
        for (unsigned bit = 0; bit < 8u; bit++) {
            crc = (crc & 1u) != 0u ? (crc >> 1) ^ UINT32_C(0xEDB88320) : crc >> 1;
        }
    }
    return crc;
}

/** Is it an image of this format, whole and undamaged, for this runtime? */
static canopy_image_error_t check_header(const canopy_image_app_t *self, const uint8_t *bytes, size_t size)
{
    static const uint8_t magic[4] = {'C', 'N', 'P', 'Y'};
    uint32_t crc;

    if (size < CANOPY_IMAGE_HEADER) {
        return CANOPY_IMAGE_SIZE;
    }
    if (memcmp(bytes, magic, sizeof magic) != 0) {
        return CANOPY_IMAGE_MAGIC;
    }
    if (canopy_image_get16(bytes + 4) != CANOPY_IMAGE_VERSION) {
        return CANOPY_IMAGE_FORMAT;
    }
    if (canopy_image_get32(bytes + 8) != size) {
        return CANOPY_IMAGE_SIZE;
    }
    crc = crc32(UINT32_MAX, bytes, CRC_AT);
    crc = ~crc32(crc, bytes + CRC_AT + CRC_SIZE, size - CRC_AT - CRC_SIZE);
    if (canopy_image_get32(bytes + CRC_AT) != crc) {
        return CANOPY_IMAGE_CRC;
    }
    return canopy_image_get64(bytes + 24) == self->engine ? CANOPY_IMAGE_OK : CANOPY_IMAGE_ENGINE;
}

/** Finds the parts. @return do they fill the image exactly? */
static bool find_parts(canopy_image_parts_t *image, const uint8_t *bytes, size_t size)
{
    uint64_t needed;

    image->node_count = canopy_image_get16(bytes + 32);
    image->parameter_count = canopy_image_get16(bytes + 34);
    image->word_count = canopy_image_get16(bytes + 36);
    image->kind_count = canopy_image_get16(bytes + 38);
    image->script_count = canopy_image_get16(bytes + 40);
    image->entry_count = canopy_image_get16(bytes + 42);
    image->use_count = canopy_image_get32(bytes + 44);
    image->value_count = canopy_image_get32(bytes + 48);
    image->text_size = canopy_image_get32(bytes + 52);
    image->hash = canopy_image_get32(bytes + 20);
    needed = CANOPY_IMAGE_HEADER + (uint64_t)NODE_SIZE * image->node_count +
             (uint64_t)PARAMETER_SIZE * image->parameter_count +
             (uint64_t)HASH_SIZE * ((uint64_t)image->kind_count + image->script_count + image->entry_count) +
             (uint64_t)HASH_SIZE * image->use_count + (uint64_t)VALUE_SIZE * image->value_count + image->text_size;
    if (needed != size) {
        return false;
    }
    image->nodes = bytes + CANOPY_IMAGE_HEADER;
    image->parameters = image->nodes + (size_t)NODE_SIZE * image->node_count;
    image->kinds = image->parameters + (size_t)PARAMETER_SIZE * image->parameter_count;
    image->scripts = image->kinds + (size_t)HASH_SIZE * image->kind_count;
    image->entries = image->scripts + (size_t)HASH_SIZE * image->script_count;
    image->uses = image->entries + (size_t)HASH_SIZE * image->entry_count;
    image->values = image->uses + (size_t)HASH_SIZE * image->use_count;
    image->texts = image->values + (size_t)VALUE_SIZE * image->value_count;
    return true;
}

/** Is there room? Scripts need no room of their own: bind_scripts() refuses more than the firmware has. */
static canopy_image_error_t check_room(canopy_image_parts_t *image)
{
    const canopy_image_app_t *self = image->self;
    const bool fits[] = {image->node_count <= self->nodes_max, image->parameter_count <= self->parameters_max,
                         image->word_count <= self->words_max, image->text_size <= self->texts_max};

    for (size_t what = 0; what < sizeof fits / sizeof fits[0]; what++) {
        if (!fits[what]) {
            image->where = (uint16_t)what;
            return CANOPY_IMAGE_TOO_LARGE;
        }
    }
    return CANOPY_IMAGE_OK;
}

/** Is everything there that the image names? Fills in the scripts. */
static canopy_image_error_t bind_names(canopy_image_parts_t *image)
{
    for (image->where = 0; image->where < image->kind_count; image->where++) {
        if (canopy_image_kind_of(image, image->where) == CANOPY_IMAGE_NONE) {
            return CANOPY_IMAGE_KIND;
        }
    }
    for (image->where = 0; image->where < image->entry_count; image->where++) {
        if (canopy_image_entry_of(image, image->where) == CANOPY_IMAGE_NONE) {
            return CANOPY_IMAGE_ENTRY;
        }
    }
    for (image->where = 0; image->where < image->script_count; image->where++) {
        uint16_t script = canopy_image_script_of(image, image->where);

        /* An image that names a script twice could name more than there is room for. */
        if (script == CANOPY_IMAGE_NONE || image->where >= image->self->app->tree->script_count) {
            return CANOPY_IMAGE_SCRIPT;
        }
        image->slot->scripts[image->where] = image->self->app->tree->scripts[script];
    }
    return CANOPY_IMAGE_OK;
}

/** A node of yours: which kind, and which of its uses. */
static canopy_image_error_t decode_user_node(canopy_image_parts_t *image, canopy_node_t *node)
{
    const uint16_t index = node->leaf < image->kind_count ? canopy_image_kind_of(image, node->leaf) : CANOPY_IMAGE_NONE;
    const canopy_image_kind_t *kind;

    if (index == CANOPY_IMAGE_NONE || image->self->kinds[index].type != node->type ||
        image->next_use == image->use_count) {
        return CANOPY_IMAGE_TREE;
    }
    kind = &image->self->kinds[index];
    node->leaf = kind->index;
    node->parameter = image->self->counts[index];
    if (node->parameter == image->self->uses_max) {
        return CANOPY_IMAGE_USES;
    }
    image->self->counts[index]++;
    if (!canopy_image_decode_ports(image, kind, node->parameter)) {
        return CANOPY_IMAGE_PORTS;
    }
    image->next_use++;
    return CANOPY_IMAGE_OK;
}

/** Script and its like: the leaf that runs scripts gets the firmware's number of the script. */
static canopy_image_error_t decode_script_node(const canopy_image_parts_t *image, canopy_node_t *node)
{
    if (image->self->script_leaf == CANOPY_IMAGE_NONE || node->parameter >= image->script_count) {
        return CANOPY_IMAGE_TREE;
    }
    node->leaf = image->self->script_leaf;
    node->parameter = canopy_image_script_of(image, node->parameter);
    return CANOPY_IMAGE_OK;
}

/** Has the type functions of yours? */
static bool is_user_type(uint8_t type)
{
    return type <= (uint8_t)CANOPY_NODE_STATEFUL_ACTION || type == (uint8_t)CANOPY_NODE_USER_CONTROL ||
           type == (uint8_t)CANOPY_NODE_USER_DECORATOR;
}

static canopy_image_error_t decode_node(canopy_image_parts_t *image, uint16_t index)
{
    const uint8_t *bytes = image->nodes + ((size_t)NODE_SIZE * index);
    canopy_node_t *node = &image->slot->nodes[index];

    *node = (canopy_node_t){.type = bytes[0],
                            .asks = bytes[1],
                            .parent = canopy_image_get16(bytes + 2),
                            .end = canopy_image_get16(bytes + 4),
                            .state = canopy_image_get16(bytes + 6),
                            .leaf = canopy_image_get16(bytes + 8),
                            .parameter = canopy_image_get16(bytes + 10)};
    if (!is_user_type(node->type)) {
        return CANOPY_IMAGE_OK;
    }
    return node->leaf == CANOPY_IMAGE_NONE ? decode_script_node(image, node) : decode_user_node(image, node);
}

/** Nodes, parameters, texts: into the slot's buffers. */
static canopy_image_error_t decode(canopy_image_parts_t *image)
{
    image->where = 0;
    /* An unended text would be read on into what lies behind it. */
    if (image->text_size != 0u && image->texts[image->text_size - 1u] != 0u) {
        return CANOPY_IMAGE_SIZE;
    }
    memcpy(image->slot->texts, image->texts, image->text_size);
    for (uint16_t index = 0; index < image->parameter_count; index++) {
        image->slot->parameters[index] =
            (int32_t)canopy_image_get32(image->parameters + ((size_t)PARAMETER_SIZE * index));
    }
    for (uint16_t kind = 0; kind < image->self->kind_count; kind++) {
        image->self->counts[kind] = 0;
    }
    for (image->where = 0; image->where < image->node_count; image->where++) {
        canopy_image_error_t error = decode_node(image, image->where);

        if (error != CANOPY_IMAGE_OK) {
            return error;
        }
    }
    image->where = 0;
    return image->next_use == image->use_count && image->next_value == image->value_count ? CANOPY_IMAGE_OK
                                                                                          : CANOPY_IMAGE_SIZE;
}

/** The slot's tree, over the firmware's leaves and control nodes. */
static canopy_image_error_t make_tree(canopy_image_parts_t *image)
{
    const canopy_tree_t *own = image->self->app->tree;
    canopy_tree_t *tree = &image->self->state->trees[image->which];

    *tree = (canopy_tree_t){.nodes = image->slot->nodes,
                            .leaves = own->leaves,
                            .controls = own->controls,
                            .scripts = image->slot->scripts,
                            .parameters = image->slot->parameters,
                            .node_count = image->node_count,
                            .leaf_count = own->leaf_count,
                            .control_count = own->control_count,
                            .script_count = image->script_count,
                            .parameter_count = image->parameter_count,
                            .word_count = image->word_count,
                            .hash = image->hash};
    return canopy_tree_validate(tree, &image->where) == CANOPY_OK ? CANOPY_IMAGE_OK : CANOPY_IMAGE_TREE;
}

static canopy_image_error_t load(canopy_image_parts_t *image, const uint8_t *bytes, size_t size)
{
    static canopy_image_error_t (*const steps[])(canopy_image_parts_t *) = {check_room, bind_names, decode, make_tree};
    canopy_image_error_t error = check_header(image->self, bytes, size);

    if (error == CANOPY_IMAGE_OK && !find_parts(image, bytes, size)) {
        error = CANOPY_IMAGE_SIZE;
    }
    for (size_t step = 0; error == CANOPY_IMAGE_OK && step < sizeof steps / sizeof steps[0]; step++) {
        error = steps[step](image);
    }
    return error;
}

canopy_image_error_t canopy_image_load(const canopy_image_app_t *self, const uint8_t *bytes, size_t size,
                                       uint16_t *where)
{
    canopy_image_error_t error;
    canopy_image_parts_t image = {.self = self};

    if (self == NULL || bytes == NULL) {
        return CANOPY_IMAGE_ARGUMENT;
    }
    image.which = self->state->running == 1u ? 1u : 0u;
    image.slot = &self->slots[image.which];
    self->state->loaded = 0;
    error = load(&image, bytes, size);
    if (error == CANOPY_IMAGE_OK) {
        self->state->hashes[image.which] = canopy_image_get64(bytes + 16);
        self->state->loaded = (uint8_t)(image.which + 1u);
    }
    if (where != NULL) {
        *where = image.where;
    }
    return error;
}

/** Stops what runs and starts the tree of `slot` - 1, or the firmware's own (0). */
static canopy_error_t exchange(const canopy_image_app_t *self, canopy_loop_t *loop, canopy_time_t now, uint8_t slot)
{
    const canopy_app_t *app = self->app;
    const canopy_tree_t *tree = slot != 0u ? &self->state->trees[slot - 1u] : app->tree;
    const uint32_t faults = app->tree_instance->faults;
    canopy_error_t error;

    if (loop->config->app != app) {
        return CANOPY_ERROR_ARGUMENT;
    }
    error = canopy_loop_stop(loop, now);
    app->start(app->memory);
    self->state->running = slot;
    (void)canopy_tree_init(app->tree_instance, tree, app->status, app->words, app->memory);
    app->tree_instance->faults = faults;
    if (app->trace != NULL) {
        canopy_trace_follow_exchange(app->trace_state);
    }
    return error;
}

canopy_error_t canopy_image_run(const canopy_image_app_t *self, canopy_loop_t *loop, canopy_time_t now)
{
    uint8_t slot = self->state->loaded;
    canopy_error_t error = slot != 0u ? exchange(self, loop, now, slot) : CANOPY_ERROR_NOT_FOUND;

    if (error == CANOPY_OK || error == CANOPY_ERROR_BUS_DOWN) {
        self->state->loaded = 0;
    }
    return error;
}

canopy_error_t canopy_image_run_own(const canopy_image_app_t *self, canopy_loop_t *loop, canopy_time_t now)
{
    return exchange(self, loop, now, 0);
}

uint64_t canopy_image_running(const canopy_image_app_t *self)
{
    uint8_t running = self->state->running;

    return running != 0u ? self->state->hashes[running - 1u] : 0u;
}
