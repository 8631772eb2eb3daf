/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Opens a CAN bus by its name; the contract is in canopy/can/open.h.
 */
#include "canopy/can/open.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#define SOCKETCAN "socketcan:"
#define UNIXBUS "unixbus:"
#define LENGTH(literal) (sizeof(literal) - 1u)

/** What to do about a failed socketcan:NAME. */
static const char *socketcan_advice(canopy_error_t error)
{
    switch (error) {
    case CANOPY_ERROR_NOT_FOUND:
        return "there is no such interface; `ip link show type can` lists them, and `ip link add dev vcan0 type vcan && "
               "ip link set vcan0 up` makes a virtual one";
    case CANOPY_ERROR_UNSUPPORTED:
        return "the kernel has no SocketCAN, or this is not a CAN interface; try `modprobe can-raw`, run inside "
               "tests/rig/with-vcan, or use unixbus:bus0";
    case CANOPY_ERROR_ARGUMENT:
        return "an interface name has 1 to 15 characters, and a filter at most 512 ids";
    case CANOPY_OK:
    case CANOPY_ERROR_TREE:
    case CANOPY_ERROR_BUS_DOWN:
    case CANOPY_ERROR_IO:
        break;
    }
    return "the operating system refused it";
}

/** What to do about a failed unixbus:NAME. */
static const char *unixbus_advice(canopy_error_t error, int number)
{
    if (number == ENAMETOOLONG) {
        return "the folder's path is too long for a socket; set CANOPY_BUS_DIR to a shorter one";
    }
    if (number == EUSERS) {
        return "the bus has 320 participants, the most that a bus can have; end one of them: `canopy buses` lists them";
    }
    switch (error) {
    case CANOPY_ERROR_NOT_FOUND:
        return "the folder in which the bus shall lie does not exist; make it, or set CANOPY_BUS_DIR to one that does";
    case CANOPY_ERROR_ARGUMENT:
        return "it takes a name such as bus0 or a folder's path with a slash, and a filter of at most 512 ids";
    case CANOPY_OK:
    case CANOPY_ERROR_TREE:
    case CANOPY_ERROR_BUS_DOWN:
    case CANOPY_ERROR_IO:
    case CANOPY_ERROR_UNSUPPORTED:
        break;
    }
    return "the bus's folder must be yours and writable by you alone; set CANOPY_BUS_DIR to another place";
}

canopy_error_t canopy_can_open(canopy_can_port_t *port, const char *spec, const canopy_can_acceptance_t *acceptance,
                               char *message, size_t message_size)
{
    canopy_error_t error = CANOPY_ERROR_ARGUMENT;
    const char *advice = "it must be socketcan:INTERFACE or unixbus:NAME, for example socketcan:vcan0 or unixbus:bus0";
    port->can = NULL;
    port->kind = CANOPY_CAN_OPEN_NONE;
    errno = EINVAL; /* until a driver says otherwise */
    if (strncmp(spec, SOCKETCAN, LENGTH(SOCKETCAN)) == 0) {
        error = canopy_socketcan_open(&port->driver.socketcan, spec + LENGTH(SOCKETCAN), acceptance);
        port->kind = CANOPY_CAN_OPEN_SOCKETCAN;
        port->can = &port->driver.socketcan.can;
        advice = socketcan_advice(error);
    } else if (strncmp(spec, UNIXBUS, LENGTH(UNIXBUS)) == 0) {
        error = canopy_unixbus_open(&port->driver.unixbus, spec + LENGTH(UNIXBUS), acceptance);
        port->kind = CANOPY_CAN_OPEN_UNIXBUS;
        port->can = &port->driver.unixbus.can;
        advice = unixbus_advice(error, errno);
    }
    if (error != CANOPY_OK) {
        /* Programs open their bus before they start threads that might ask for an error's text too. */
        const char *cause = strerror(errno); /* NOLINT(concurrency-mt-unsafe) */
        (void)snprintf(message, message_size, "CAN bus \"%s\": %s (%s)", spec, advice, cause);
        port->can = NULL;
        port->kind = CANOPY_CAN_OPEN_NONE;
    }
    return error;
}

const char *canopy_can_advice(const canopy_can_port_t *port, unsigned number)
{
    return port->kind == CANOPY_CAN_OPEN_SOCKETCAN ? canopy_socketcan_advice(&port->driver.socketcan, number) : NULL;
}

void canopy_can_close(canopy_can_port_t *port)
{
    switch (port->kind) {
    case CANOPY_CAN_OPEN_SOCKETCAN:
        canopy_socketcan_close(&port->driver.socketcan);
        break;
    case CANOPY_CAN_OPEN_UNIXBUS:
        canopy_unixbus_close(&port->driver.unixbus);
        break;
    case CANOPY_CAN_OPEN_NONE:
        break;
    }
    port->can = NULL;
    port->kind = CANOPY_CAN_OPEN_NONE;
}
