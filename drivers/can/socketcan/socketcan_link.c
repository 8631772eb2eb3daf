/* SPDX-License-Identifier: MIT */
/** @file What the kernel says of an interface (rtnetlink), and switching it off and on. */
#include <errno.h>
#include <linux/can/netlink.h>
#include <linux/capability.h>
#include <linux/if_link.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "socketcan_internal.h"

/* Of linux/if.h, which does not go together with net/if.h. */
#define FLAG_ECHO (1u << 18)

enum { ANSWER_BYTES = 16384 };

typedef struct rtattr attribute_t;

/** Attributes lie one behind the other. */
typedef struct {
    const char *next;
    size_t left;
} attributes_t;

static attributes_t within(const attribute_t *outer)
{
    return (attributes_t){.next = RTA_DATA(outer), .left = RTA_PAYLOAD(outer)};
}

/** @return the next attribute, all of which is there; NULL: none */
static const attribute_t *take(attributes_t *attributes)
{
    const attribute_t *attribute = (const void *)attributes->next;
    size_t step;

    if (attributes->left < sizeof *attribute || attribute->rta_len < sizeof *attribute ||
        attribute->rta_len > attributes->left) {
        return NULL;
    }
    step = RTA_ALIGN((size_t)attribute->rta_len);
    step = step < attributes->left ? step : attributes->left;
    attributes->next += step;
    attributes->left -= step;
    return attribute;
}

static uint32_t number_of(const attribute_t *attribute)
{
    uint32_t number = 0;

    if (RTA_PAYLOAD(attribute) >= sizeof number) {
        memcpy(&number, RTA_DATA(attribute), sizeof number);
    }
    return number;
}

static bool text_is(const attribute_t *attribute, const char *text)
{
    size_t size = strlen(text) + 1u;

    return RTA_PAYLOAD(attribute) >= size && memcmp(RTA_DATA(attribute), text, size) == 0;
}

static canopy_can_controller_t controller_of(uint32_t can_state)
{
    switch (can_state) {
    case CAN_STATE_ERROR_WARNING:
        return CANOPY_CAN_CONTROLLER_WARNING;
    case CAN_STATE_ERROR_PASSIVE:
        return CANOPY_CAN_CONTROLLER_PASSIVE;
    case CAN_STATE_BUS_OFF:
        return CANOPY_CAN_CONTROLLER_BUS_OFF;
    default:
        return CANOPY_CAN_CONTROLLER_ACTIVE;
    }
}

/** Attributes of the kernel's CAN device layer. */
static void read_controller(canopy_socketcan_link_t *link, const attribute_t *outer)
{
    attributes_t attributes = within(outer);
    const attribute_t *part;

    while ((part = take(&attributes)) != NULL) {
        if (part->rta_type == IFLA_CAN_STATE) {
            link->is_controller = true;
            link->controller = controller_of(number_of(part));
        } else if (part->rta_type == IFLA_CAN_RESTART_MS) {
            link->restarts_itself = number_of(part) != 0u;
        }
    }
}

static void read_info(canopy_socketcan_link_t *link, const attribute_t *outer)
{
    attributes_t attributes = within(outer);
    const attribute_t *part;
    bool is_can = false;

    while ((part = take(&attributes)) != NULL) {
        if (part->rta_type == IFLA_INFO_KIND) {
            is_can = text_is(part, "can");
        } else if (part->rta_type == IFLA_INFO_DATA && is_can) {
            read_controller(link, part);
        }
    }
}

/** @param answer `length` bytes, which are a header and a struct ifinfomsg at least */
static void read_link(canopy_socketcan_link_t *link, const char *answer, size_t length)
{
    struct ifinfomsg info;
    attributes_t attributes = {.next = answer + NLMSG_SPACE(sizeof info), .left = length - NLMSG_LENGTH(sizeof info)};
    const attribute_t *part;

    memcpy(&info, answer + NLMSG_HDRLEN, sizeof info);
    *link = (canopy_socketcan_link_t){
        .index = (unsigned)info.ifi_index, .has_echo = (info.ifi_flags & FLAG_ECHO) != 0u, .has_queue = true};
    while ((part = take(&attributes)) != NULL) {
        if (part->rta_type == IFLA_QDISC) {
            link->has_queue = !text_is(part, "noqueue"); /* while the interface is down it is "noop": not known yet */
        } else if (part->rta_type == IFLA_LINKINFO) {
            read_info(link, part);
        }
    }
}

/** What an answer of the kernel says of a link. @param answer `size` bytes @return as canopy_socketcan_ask_link() */
static canopy_error_t read_answer(canopy_socketcan_link_t *link, const char *answer, size_t size)
{
    struct nlmsghdr header;
    struct nlmsgerr error;

    if (size < NLMSG_HDRLEN) {
        return CANOPY_ERROR_UNSUPPORTED;
    }
    memcpy(&header, answer, sizeof header);
    if (header.nlmsg_len > size) {
        return CANOPY_ERROR_UNSUPPORTED;
    }
    if (header.nlmsg_type == NLMSG_ERROR && header.nlmsg_len >= NLMSG_LENGTH(sizeof error)) {
        memcpy(&error, answer + NLMSG_HDRLEN, sizeof error);
        return error.error == -ENODEV ? CANOPY_ERROR_NOT_FOUND : CANOPY_ERROR_UNSUPPORTED;
    }
    if (header.nlmsg_type != RTM_NEWLINK || header.nlmsg_len < NLMSG_LENGTH(sizeof(struct ifinfomsg))) {
        return CANOPY_ERROR_UNSUPPORTED;
    }
    read_link(link, answer, header.nlmsg_len);
    return CANOPY_OK;
}

canopy_error_t canopy_socketcan_ask_link(const char *name, canopy_socketcan_link_t *link)
{
    struct {
        struct nlmsghdr header;
        struct ifinfomsg info;
        attribute_t attribute;
        char name[IFNAMSIZ];
    } request = {.header = {.nlmsg_len = sizeof request, .nlmsg_type = RTM_GETLINK, .nlmsg_flags = NLM_F_REQUEST},
                 .info = {.ifi_family = AF_UNSPEC},
                 .attribute = {.rta_len = RTA_LENGTH(IFNAMSIZ), .rta_type = IFLA_IFNAME}};
    union {
        struct nlmsghdr header; /* for its alignment */
        char bytes[ANSWER_BYTES];
    } answer;
    ssize_t size = -1;
    int socket_number = socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);

    if (socket_number < 0) {
        return CANOPY_ERROR_UNSUPPORTED;
    }
    (void)memcpy(request.name, name, strlen(name)); /* shorter than IFNAMSIZ: canopy_socketcan_open() has looked */
    if (send(socket_number, &request, sizeof request, 0) == (ssize_t)sizeof request) {
        size = recv(socket_number, &answer, sizeof answer, MSG_DONTWAIT); /* the kernel answers within send() */
    }
    (void)close(socket_number);
    return size >= 0 ? read_answer(link, answer.bytes, (size_t)size) : CANOPY_ERROR_UNSUPPORTED;
}

bool canopy_socketcan_may_switch(void)
{
    struct __user_cap_header_struct header = {.version = _LINUX_CAPABILITY_VERSION_3};
    struct __user_cap_data_struct data[_LINUX_CAPABILITY_U32S_3] = {{0}};

    return syscall(SYS_capget, &header, data) == 0 && (data[0].effective & (1u << CAP_NET_ADMIN)) != 0u;
}

static void name_into(struct ifreq *request, const char *name)
{
    *request = (struct ifreq){0};
    (void)memcpy(request->ifr_name, name, strlen(name)); /* shorter than IFNAMSIZ, as above */
}

canopy_can_controller_t canopy_socketcan_look(int socket, unsigned index, const char *name)
{
    struct ifreq request = {.ifr_ifindex = (int)index};

    if (ioctl(socket, SIOCGIFNAME, &request) != 0 || strncmp(request.ifr_name, name, sizeof request.ifr_name) != 0 ||
        ioctl(socket, SIOCGIFFLAGS, &request) != 0) {
        return CANOPY_CAN_CONTROLLER_GONE;
    }
    return (request.ifr_flags & IFF_UP) != 0 ? CANOPY_CAN_CONTROLLER_ACTIVE : CANOPY_CAN_CONTROLLER_DOWN;
}

/** The kernel tells each socket that the interface went down. We know. */
static void forget_error(int descriptor)
{
    int number = 0;
    socklen_t length = sizeof number;

    (void)getsockopt(descriptor, SOL_SOCKET, SO_ERROR, &number, &length);
}

bool canopy_socketcan_switch(canopy_socketcan_t *self)
{
    struct ifreq request;
    bool done;

    name_into(&request, self->name);
    if (!self->may_switch || ioctl(self->socket, SIOCGIFFLAGS, &request) != 0) {
        return false;
    }
    request.ifr_flags = (short)(request.ifr_flags & ~IFF_UP);
    done = ioctl(self->socket, SIOCSIFFLAGS, &request) == 0;
    if (done) {
        request.ifr_flags = (short)(request.ifr_flags | IFF_UP);
        done = ioctl(self->socket, SIOCSIFFLAGS, &request) == 0;
    }
    forget_error(self->socket);
    forget_error(self->events);
    self->may_switch = done; /* a capability of another user namespace does not help */
    return done;
}
