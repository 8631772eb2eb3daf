/* SPDX-License-Identifier: MIT */
/** @file The ports of a tree image's leaves: decoded once into structs, and completed from the entries in each tick. */
#include "image_parts.h"

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
static bool point_at(const canopy_image_parts_t *image, uint8_t *ports, const canopy_image_port_t *port,
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
    memcpy(ports + port->member, (const void *)&pointer, sizeof pointer);
    if (port->updates != CANOPY_IMAGE_NONE) {
        memcpy(ports + port->updates, (const void *)&updates, sizeof updates);
    }
    return true;
}

/** Connects a port to an entry. *source: as for canopy_image_connect(). @return may it? */
static bool connect_entry(const canopy_image_parts_t *image, uint8_t *ports, const canopy_image_port_t *port,
                          uint64_t value, uint16_t *source)
{
    uint16_t index = value < image->entry_count ? canopy_image_entry_of(image, (uint16_t)value) : CANOPY_IMAGE_NONE;

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
static bool decode_value(const canopy_image_parts_t *image, uint8_t *ports, const canopy_image_port_t *port,
                         const uint8_t *bytes, bool has_base, uint16_t *source)
{
    const uint64_t value = canopy_image_get64(bytes + 4);
    const canopy_image_form_t form = (canopy_image_form_t)port->form;

    *source = IN_POOL;
    switch (canopy_image_get32(bytes)) {
    case CANOPY_IMAGE_FROM_BASE:
        *source = IN_BASE;
        return has_base;
    case CANOPY_IMAGE_FROM_CONSTANT:
        return (form == CANOPY_IMAGE_NUMBER || form == CANOPY_IMAGE_BOOL) && store(ports + port->member, port, value);
    case CANOPY_IMAGE_FROM_TEXT: {
        const char *text = image->slot->texts + (value < image->text_size ? (size_t)value : 0u);

        memcpy(ports + port->member, (const void *)&text, sizeof text);
        return form == CANOPY_IMAGE_TEXT && value < image->text_size;
    }
    case CANOPY_IMAGE_FROM_ENTRY:
        return connect_entry(image, ports, port, value, source);
    case CANOPY_IMAGE_FROM_NOTHING: {
        const void *nothing = NULL;

        memcpy(ports + port->member, (const void *)&nothing, sizeof nothing);
        return form == CANOPY_IMAGE_WRITE;
    }
    default:
        return false;
    }
}

bool canopy_image_decode_ports(canopy_image_parts_t *image, const canopy_image_kind_t *kind, uint16_t parameter)
{
    const uint8_t *hash = image->uses + ((size_t)HASH_SIZE * image->next_use);
    const uint16_t base =
        canopy_image_get64(hash) != 0u
            ? canopy_image_find(hash, kind->base_hashes, sizeof kind->base_hashes[0], kind->base_count)
            : CANOPY_IMAGE_NONE;
    uint8_t *ports = kind->pool[image->which];
    uint16_t *sources = kind->sources[image->which];

    if ((canopy_image_get64(hash) != 0u && base == CANOPY_IMAGE_NONE) ||
        kind->port_count > image->value_count - image->next_value) {
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
