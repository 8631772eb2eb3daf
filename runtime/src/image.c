/* SPDX-License-Identifier: MIT */
/** @file Tree images: checked from the outside in, decoded byte by byte, and run only as a whole. */
#include "canopy/image.h"

#include <string.h>

enum { NODE_SIZE = 12, PARAMETER_SIZE = 4, HASH_SIZE = 8, VALUE_SIZE = 12, CRC_AT = 12, CRC_SIZE = 4 };

/** An image on its way into a slot: its parts, and how far its uses have been read. */
typedef struct {
    const canopy_image_app_t *self;
    const canopy_image_slot_t *slot;
    unsigned which;
    const uint8_t *nodes;
    const uint8_t *parameters;
    const uint8_t *kinds;
    const uint8_t *scripts;
    const uint8_t *entries;
    const uint8_t *uses;
    const uint8_t *values;
    const uint8_t *texts;
    uint16_t node_count;
    uint16_t parameter_count;
    uint16_t word_count;
    uint16_t kind_count;
    uint16_t script_count;
    uint16_t entry_count;
    uint32_t use_count;
    uint32_t value_count;
    uint32_t text_size;
    uint32_t next_use;
    uint32_t next_value;
    uint16_t where;
} image_t;

static uint16_t get16(const uint8_t *bytes)
{
    return (uint16_t)(bytes[0] | ((unsigned)bytes[1] << 8));
}

static uint32_t get32(const uint8_t *bytes)
{
    return get16(bytes) | ((uint32_t)get16(bytes + 2) << 16);
}

static uint64_t get64(const uint8_t *bytes)
{
    return get32(bytes) | ((uint64_t)get32(bytes + 4) << 32);
}

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
    if (get16(bytes + 4) != CANOPY_IMAGE_VERSION) {
        return CANOPY_IMAGE_FORMAT;
    }
    if (get32(bytes + 8) != size) {
        return CANOPY_IMAGE_SIZE;
    }
    crc = crc32(UINT32_MAX, bytes, CRC_AT);
    crc = ~crc32(crc, bytes + CRC_AT + CRC_SIZE, size - CRC_AT - CRC_SIZE);
    if (get32(bytes + CRC_AT) != crc) {
        return CANOPY_IMAGE_CRC;
    }
    return get64(bytes + 24) == self->engine ? CANOPY_IMAGE_OK : CANOPY_IMAGE_ENGINE;
}

/** Finds the parts. @return do they fill the image exactly? */
static bool find_parts(image_t *image, const uint8_t *bytes, size_t size)
{
    uint64_t needed;

    image->node_count = get16(bytes + 32);
    image->parameter_count = get16(bytes + 34);
    image->word_count = get16(bytes + 36);
    image->kind_count = get16(bytes + 38);
    image->script_count = get16(bytes + 40);
    image->entry_count = get16(bytes + 42);
    image->use_count = get32(bytes + 44);
    image->value_count = get32(bytes + 48);
    image->text_size = get32(bytes + 52);
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
static canopy_image_error_t check_room(image_t *image)
{
    const canopy_image_app_t *self = image->self;
    const bool fits[] = {image->node_count <= self->nodes_max, image->parameter_count <= self->parameters_max,
                         image->word_count <= self->words_max, image->text_size <= self->texts_max};

    for (uint16_t what = 0; what < sizeof fits / sizeof fits[0]; what++) {
        if (!fits[what]) {
            image->where = what;
            return CANOPY_IMAGE_TOO_LARGE;
        }
    }
    return CANOPY_IMAGE_OK;
}

/**
 * Looks for the hash at `bytes` among rows that begin with their hash, `stride` bytes each.
 * @return the row's number, or CANOPY_IMAGE_NONE
 */
static uint16_t find(const uint8_t *bytes, const void *rows, size_t stride, uint16_t count)
{
    const uint64_t hash = get64(bytes);
    const uint8_t *row = rows;

    for (uint16_t index = 0; index < count; index++) {
        uint64_t known;

        memcpy(&known, row + (stride * index), sizeof known);
        if (known == hash) {
            return index;
        }
    }
    return CANOPY_IMAGE_NONE;
}

/** The firmware's kind that the image's kind number `index` is. */
static uint16_t find_kind(const image_t *image, uint16_t index)
{
    return find(image->kinds + ((size_t)HASH_SIZE * index), image->self->kinds, sizeof image->self->kinds[0],
                image->self->kind_count);
}

/** The same of a script. */
static uint16_t find_script(const image_t *image, uint16_t index)
{
    return find(image->scripts + ((size_t)HASH_SIZE * index), image->self->scripts, sizeof image->self->scripts[0],
                image->self->app->tree->script_count);
}

/** The same of an entry. */
static uint16_t find_entry(const image_t *image, uint16_t index)
{
    return find(image->entries + ((size_t)HASH_SIZE * index), image->self->entries, sizeof image->self->entries[0],
                image->self->entry_count);
}

/** Is everything there that the image names? Fills in the scripts. */
static canopy_image_error_t bind_names(image_t *image)
{
    for (image->where = 0; image->where < image->kind_count; image->where++) {
        if (find_kind(image, image->where) == CANOPY_IMAGE_NONE) {
            return CANOPY_IMAGE_KIND;
        }
    }
    for (image->where = 0; image->where < image->entry_count; image->where++) {
        if (find_entry(image, image->where) == CANOPY_IMAGE_NONE) {
            return CANOPY_IMAGE_ENTRY;
        }
    }
    for (image->where = 0; image->where < image->script_count; image->where++) {
        uint16_t script = find_script(image, image->where);

        /* An image that names a script twice could name more than there is room for. */
        if (script == CANOPY_IMAGE_NONE || image->where >= image->self->app->tree->script_count) {
            return CANOPY_IMAGE_SCRIPT;
        }
        image->slot->scripts[image->where] = image->self->app->tree->scripts[script];
    }
    return CANOPY_IMAGE_OK;
}

/** Writes a number into a member of 1, 2, 4 or 8 bytes. @return does it fit? */
static bool store(uint8_t *member, const canopy_image_port_t *port, uint64_t value)
{
    const uint8_t value8 = (uint8_t)(value & UINT8_MAX);
    const uint16_t value16 = (uint16_t)(value & UINT16_MAX);
    const uint32_t value32 = (uint32_t)(value & UINT32_MAX);

    switch (port->size) {
    case sizeof value8:
        memcpy(member, &value8, sizeof value8);
        return value <= (port->form == (uint8_t)CANOPY_IMAGE_BOOL ? 1u : UINT8_MAX);
    case sizeof value16:
        memcpy(member, &value16, sizeof value16);
        return value <= UINT16_MAX;
    case sizeof value32:
        memcpy(member, &value32, sizeof value32);
        return value <= UINT32_MAX;
    default:
        memcpy(member, &value, sizeof value);
        return true;
    }
}

/** Points a member at an entry, and its counter at the entry's. @return may it? */
static bool point_at(const image_t *image, uint8_t *ports, const canopy_image_port_t *port,
                     const canopy_image_entry_t *entry)
{
    uint8_t *memory = image->self->app->memory;
    const void *pointer = memory + entry->offset;
    const void *updates = NULL;

    if (port->form == (uint8_t)CANOPY_IMAGE_WRITE && entry->updates != CANOPY_IMAGE_NONE) {
        if (port->updates == CANOPY_IMAGE_NONE) {
            return false; /* the write would go uncounted, and a node wait for it in vain */
        }
        updates = memory + entry->updates;
    }
    memcpy(ports + port->member, &pointer, sizeof pointer);
    if (port->updates != CANOPY_IMAGE_NONE) {
        memcpy(ports + port->updates, &updates, sizeof updates);
    }
    return true;
}

/** Connects a port to an entry. *source: as for canopy_image_connect(). @return may it? */
static bool connect_entry(const image_t *image, uint8_t *ports, const canopy_image_port_t *port, uint64_t value,
                          uint16_t *source)
{
    uint16_t index = value < image->entry_count ? find_entry(image, (uint16_t)value) : CANOPY_IMAGE_NONE;

    if (index == CANOPY_IMAGE_NONE || image->self->entries[index].type != port->type) {
        return false;
    }
    switch ((canopy_image_form_t)port->form) { /* not covered: no other value */
    case CANOPY_IMAGE_NUMBER:
    case CANOPY_IMAGE_BOOL:
        *source = index;
        return true;
    case CANOPY_IMAGE_READ:
    case CANOPY_IMAGE_WRITE:
        return point_at(image, ports, port, &image->self->entries[index]);
    case CANOPY_IMAGE_TEXT:
        break;
    }
    return false;
}

enum { IN_POOL = CANOPY_IMAGE_NONE - 1, IN_BASE = CANOPY_IMAGE_NONE };

/** Gives one port what the image says. @return may it? */
static bool decode_value(const image_t *image, uint8_t *ports, const canopy_image_port_t *port, const uint8_t *bytes,
                         bool has_base, uint16_t *source)
{
    const uint64_t value = get64(bytes + 4);
    const canopy_image_form_t form = (canopy_image_form_t)port->form;

    *source = IN_POOL;
    switch (get32(bytes)) {
    case CANOPY_IMAGE_FROM_BASE:
        *source = IN_BASE;
        return has_base;
    case CANOPY_IMAGE_FROM_CONSTANT:
        return (form == CANOPY_IMAGE_NUMBER || form == CANOPY_IMAGE_BOOL) && store(ports + port->member, port, value);
    case CANOPY_IMAGE_FROM_TEXT: {
        const char *text = image->slot->texts + (value < image->text_size ? (size_t)value : 0u);

        memcpy(ports + port->member, &text, sizeof text);
        return form == CANOPY_IMAGE_TEXT && value < image->text_size;
    }
    case CANOPY_IMAGE_FROM_ENTRY:
        return connect_entry(image, ports, port, value, source);
    case CANOPY_IMAGE_FROM_NOTHING: {
        const void *nothing = NULL;

        memcpy(ports + port->member, &nothing, sizeof nothing);
        return form == CANOPY_IMAGE_WRITE;
    }
    default:
        return false;
    }
}

/** The ports of the next use, which is the kind's use number `parameter`. */
static bool decode_ports(image_t *image, const canopy_image_kind_t *kind, uint16_t parameter)
{
    const uint8_t *hash = image->uses + ((size_t)HASH_SIZE * image->next_use);
    const uint16_t base = get64(hash) != 0u
                              ? find(hash, kind->base_hashes, sizeof kind->base_hashes[0], kind->base_count)
                              : CANOPY_IMAGE_NONE;
    uint8_t *ports = kind->pool[image->which];
    uint16_t *sources = kind->sources[image->which];

    if ((get64(hash) != 0u && base == CANOPY_IMAGE_NONE) || kind->port_count > image->value_count - image->next_value) {
        return false;
    }
    if (kind->port_count == 0u) {
        return true;
    }
    kind->bases[image->which][parameter] = base;
    ports += (size_t)kind->ports_size * parameter;
    sources += (size_t)kind->port_count * parameter;
    memset(ports, 0, kind->ports_size);
    if (base != CANOPY_IMAGE_NONE) {
        const uint8_t *base_ports = kind->base_ports;

        memcpy(ports, base_ports + ((size_t)kind->ports_size * base), kind->ports_size);
    }
    for (uint16_t which = 0; which < kind->port_count; which++, image->next_value++) {
        if (!decode_value(image, ports, &kind->ports[which], image->values + ((size_t)VALUE_SIZE * image->next_value),
                          base != CANOPY_IMAGE_NONE, &sources[which])) {
            return false;
        }
    }
    return true;
}

/** A node of yours: which kind, and which of its uses. */
static canopy_image_error_t decode_user_node(image_t *image, canopy_node_t *node)
{
    const uint16_t index = node->leaf < image->kind_count ? find_kind(image, node->leaf) : CANOPY_IMAGE_NONE;
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
    if (!decode_ports(image, kind, node->parameter)) {
        return CANOPY_IMAGE_PORTS;
    }
    image->next_use++;
    return CANOPY_IMAGE_OK;
}

/** Script and its like: the leaf that runs scripts gets the firmware's number of the script. */
static canopy_image_error_t decode_script_node(const image_t *image, canopy_node_t *node)
{
    if (image->self->script_leaf == CANOPY_IMAGE_NONE || node->parameter >= image->script_count) {
        return CANOPY_IMAGE_TREE;
    }
    node->leaf = image->self->script_leaf;
    node->parameter = find_script(image, node->parameter);
    return CANOPY_IMAGE_OK;
}

/** Has the type functions of yours? */
static bool is_user_type(uint8_t type)
{
    return type <= (uint8_t)CANOPY_NODE_STATEFUL_ACTION || type == (uint8_t)CANOPY_NODE_USER_CONTROL ||
           type == (uint8_t)CANOPY_NODE_USER_DECORATOR;
}

static canopy_image_error_t decode_node(image_t *image, uint16_t index)
{
    const uint8_t *bytes = image->nodes + ((size_t)NODE_SIZE * index);
    canopy_node_t *node = &image->slot->nodes[index];

    *node = (canopy_node_t){.type = bytes[0],
                            .asks = bytes[1],
                            .parent = get16(bytes + 2),
                            .end = get16(bytes + 4),
                            .state = get16(bytes + 6),
                            .leaf = get16(bytes + 8),
                            .parameter = get16(bytes + 10)};
    if (!is_user_type(node->type)) {
        return CANOPY_IMAGE_OK;
    }
    return node->leaf == CANOPY_IMAGE_NONE ? decode_script_node(image, node) : decode_user_node(image, node);
}

/** Nodes, parameters, texts: into the slot's buffers. */
static canopy_image_error_t decode(image_t *image)
{
    image->where = 0;
    /* An unended text would be read on into what lies behind it. */
    if (image->text_size != 0u && image->texts[image->text_size - 1u] != 0u) {
        return CANOPY_IMAGE_SIZE;
    }
    memcpy(image->slot->texts, image->texts, image->text_size);
    for (uint16_t index = 0; index < image->parameter_count; index++) {
        image->slot->parameters[index] = (int32_t)get32(image->parameters + ((size_t)PARAMETER_SIZE * index));
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
static canopy_image_error_t make_tree(image_t *image)
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
                            .word_count = image->word_count};
    image->where = 0;
    return canopy_tree_validate(tree, &image->where) == CANOPY_OK ? CANOPY_IMAGE_OK : CANOPY_IMAGE_TREE;
}

static canopy_image_error_t load(image_t *image, const uint8_t *bytes, size_t size)
{
    static canopy_image_error_t (*const steps[])(image_t *) = {check_room, bind_names, decode, make_tree};
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
    image_t image = {.self = self};

    if (self == NULL || bytes == NULL) {
        return CANOPY_IMAGE_ARGUMENT;
    }
    image.which = self->state->running == 1u ? 1u : 0u;
    image.slot = &self->slots[image.which];
    self->state->loaded = 0;
    error = load(&image, bytes, size);
    if (error == CANOPY_IMAGE_OK) {
        self->state->hashes[image.which] = get64(bytes + 16);
        self->state->loaded = (uint8_t)(image.which + 1u);
    }
    if (where != NULL) {
        *where = image.where;
    }
    return error;
}

/** Stops what runs and starts the tree of `slot` - 1, or the firmware's own (0). */
static void exchange(const canopy_image_app_t *self, canopy_loop_t *loop, canopy_time_t now, uint8_t slot)
{
    const canopy_app_t *app = self->app;
    const canopy_tree_t *tree = slot != 0u ? &self->state->trees[slot - 1u] : app->tree;
    const uint32_t faults = app->tree_instance->faults;

    canopy_loop_stop(loop, now);
    app->start(app->memory);
    self->state->running = slot;
    (void)canopy_tree_init(app->tree_instance, tree, app->status, app->words, app->memory);
    app->tree_instance->faults = faults;
    app->trace_state->next_node = 0;
    for (uint16_t node = 0; node < tree->node_count; node++) {
        app->sent[node] = (uint8_t)CANOPY_IDLE;
    }
}

canopy_error_t canopy_image_run(const canopy_image_app_t *self, canopy_loop_t *loop, canopy_time_t now)
{
    uint8_t slot = self->state->loaded;

    if (slot == 0u) {
        return CANOPY_ERROR_NOT_FOUND;
    }
    self->state->loaded = 0;
    exchange(self, loop, now, slot);
    return CANOPY_OK;
}

void canopy_image_run_own(const canopy_image_app_t *self, canopy_loop_t *loop, canopy_time_t now)
{
    exchange(self, loop, now, 0);
}

uint64_t canopy_image_running(const canopy_image_app_t *self)
{
    uint8_t running = self->state->running;

    return running != 0u ? self->state->hashes[running - 1u] : 0u;
}

void canopy_image_connect(const canopy_image_app_t *self, uint16_t kind, uint16_t parameter, void *ports)
{
    const canopy_image_kind_t *row = &self->kinds[kind];
    const unsigned which = self->state->running - 1u;
    const uint16_t *sources = row->sources[which] + ((size_t)row->port_count * parameter);
    const uint8_t *memory = self->app->memory;
    const uint8_t *pool = row->pool[which];
    uint8_t *into = ports;

    pool += (size_t)row->ports_size * parameter;
    for (uint16_t index = 0; index < row->port_count; index++) {
        const canopy_image_port_t *port = &row->ports[index];

        if (sources[index] < (uint16_t)IN_POOL) {
            memcpy(into + port->member, memory + self->entries[sources[index]].offset, port->size);
        } else if (sources[index] == (uint16_t)IN_POOL) {
            memcpy(into + port->member, pool + port->member, port->size);
        }
    }
}
