/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The functions of an application's shared library, for canopy.inprocess in Python. One copy of the library holds one
 * instance. Compiled with CANOPY_APP (the application's object), CANOPY_BUS_HEADER and in it CANOPY_RX_MESSAGES, and
 * CANOPY_WORLD, the name of a function that gives the world, or without it; with CANOPY_IMAGE where it takes tree images.
 *
 * Bounds are checked here, for whoever calls is not C: a number out of range gives an error, never a crash.
 */
#include "library.h"

#include <stddef.h>

#include "canopy/in_process.h"

#include CANOPY_BUS_HEADER
#ifdef CANOPY_IMAGE
#include "canopy/image.h"

extern const canopy_image_app_t CANOPY_IMAGE;
#endif

/** Of the functions below; the Python side refuses a library with another one. */
enum { VERSION = 1 };

enum { SENSORS = CANOPY_RX_MESSAGES + 1u }; /* an array of none is none in C */

extern const canopy_app_t CANOPY_APP;
#ifdef CANOPY_WORLD
const canopy_world_t *CANOPY_WORLD(void);
#endif

static canopy_in_process_t host;
static canopy_in_process_sensor_t sensors[SENSORS];

uint32_t canopy_library_version(void)
{
    return VERSION;
}

const char *canopy_library_name(void)
{
    return CANOPY_APP.name;
}

uint64_t canopy_library_period(void)
{
    return CANOPY_APP.period;
}

uint32_t canopy_library_hash(void)
{
    return CANOPY_APP.tree_instance->tree->hash;
}

uint32_t canopy_library_nodes(void)
{
    return CANOPY_APP.tree_instance->tree->node_count;
}

int canopy_library_open(bool with_trace)
{
    const canopy_world_t *world = NULL;

#ifdef CANOPY_WORLD
    world = CANOPY_WORLD();
#endif
    return (int)canopy_in_process_init(&host, &CANOPY_APP, sensors, (uint16_t)SENSORS, world, with_trace);
}

uint32_t canopy_library_receives(uint32_t id, bool is_extended)
{
    return canopy_in_process_find(&host, id, is_extended);
}

uint32_t canopy_library_sends(uint32_t id, bool is_extended)
{
    const canopy_bus_t *bus = CANOPY_APP.bus;

    for (uint16_t index = 0; index < bus->tx_count; index++) {
        if (bus->tx[index].id == id && ((bus->tx[index].flags & (unsigned)CANOPY_CAN_EXTENDED) != 0u) == is_extended) {
            return index;
        }
    }
    return CANOPY_IN_PROCESS_NONE;
}

int canopy_library_put(uint32_t message, const uint8_t *data, uint32_t length, uint64_t age)
{
    if (message >= CANOPY_APP.bus->rx_count || length != CANOPY_APP.bus->rx[message].length) {
        return CANOPY_ERROR_ARGUMENT;
    }
    canopy_in_process_put(&host, (uint16_t)message, data, age);
    return CANOPY_OK;
}

int canopy_library_hold(uint32_t message, bool is_held)
{
    if (message >= CANOPY_APP.bus->rx_count) {
        return CANOPY_ERROR_ARGUMENT;
    }
    canopy_in_process_hold(&host, (uint16_t)message, is_held);
    return CANOPY_OK;
}

int canopy_library_read(uint32_t message, uint8_t *data, uint32_t size)
{
    if (message >= CANOPY_APP.bus->tx_count || size != CANOPY_APP.bus->tx[message].length) {
        return CANOPY_ERROR_ARGUMENT;
    }
    canopy_in_process_read(&host, (uint16_t)message, data);
    return CANOPY_OK;
}

uint64_t canopy_library_run(uint64_t ticks, uint32_t until)
{
    return canopy_in_process_run(&host, ticks, until);
}

uint32_t canopy_library_root(void)
{
    return (uint32_t)host.root;
}

uint64_t canopy_library_now(void)
{
    return host.now;
}

int canopy_library_set_now(uint64_t now)
{
    if (now < host.now) {
        return CANOPY_ERROR_ARGUMENT;
    }
    host.now = now;
    return CANOPY_OK;
}

uint32_t canopy_library_faults(void)
{
    return CANOPY_APP.tree_instance->faults;
}

uint32_t canopy_library_rejected(void)
{
    return canopy_bus_rejected(&CANOPY_APP.bus_state->counters);
}

const uint8_t *canopy_library_statuses(void)
{
    return CANOPY_APP.status;
}

/** What a node is; `last`: what it returned last, whether it was reset or not. */
int canopy_library_status(uint32_t node, bool last)
{
    const canopy_tree_instance_t *tree = CANOPY_APP.tree_instance;

    if (node >= tree->tree->node_count) {
        return CANOPY_ERROR_ARGUMENT;
    }
    return (int)(last ? canopy_status_last(tree->status[node]) : canopy_status_now(tree->status[node]));
}

void canopy_library_halt(void)
{
    canopy_tree_halt(CANOPY_APP.tree_instance);
}

/** From now on `seen` collects what each node has been: as many bytes as the tree has nodes. NULL: no more. */
void canopy_library_watch(uint8_t *seen)
{
    host.seen = seen;
}

/** @return 0; else a canopy_image_error_t, or minus a canopy_error_t. */
int canopy_library_run_image(const uint8_t *bytes, size_t size)
{
#ifdef CANOPY_IMAGE
    const canopy_app_t *without_trace = host.config.app;
    uint16_t where;
    int error = (int)canopy_image_load(&CANOPY_IMAGE, bytes, size, &where);

    if (error == CANOPY_IMAGE_OK) {
        host.seen = NULL;              /* it is as long as the old tree */
        host.config.app = &CANOPY_APP; /* an image wants the application itself, and no copy */
        error = (int)canopy_image_run(&CANOPY_IMAGE, &host.loop, host.now);
        host.config.app = without_trace;
    }
    return error;
#else
    (void)bytes;
    (void)size;
    return CANOPY_ERROR_NOT_FOUND;
#endif
}

const void *canopy_library_entry(uint32_t index, canopy_in_process_entry_t *entry)
{
    if (index >= canopy_in_process_entry_count) {
        return NULL;
    }
    *entry = canopy_in_process_entries[index];
    return entry->address;
}
