/* SPDX-License-Identifier: MIT */
/** @file What the courier's nodes exchange through ports, and what each of them remembers. */
#ifndef COURIER_TYPES_H
#define COURIER_TYPES_H

#include <stdbool.h>
#include <stdint.h>

#include "canopy/clock.h"

/* Ports: what the C++ types of the tree are here. The build names the pairs, see TYPE_MAP in CMakeLists.txt. */

typedef struct {
    int32_t x; /* [mm] */
    int32_t y; /* [mm] */
} point_t;

/* geometry_msgs::msg::PoseStamped */
typedef struct {
    point_t at;
    uint8_t order; /* the number of the order that wants it */
} pose_t;

#define PATH_POINTS 2u

/* nav_msgs::msg::Path */
typedef struct {
    point_t points[PATH_POINTS];
    uint8_t number; /* of the request that it answers; a new path has a new one */
} path_t;

/* State of the leaves. It is 0 when the program starts. */

/* A request to another board, which answers with the same number. */
typedef struct {
    uint8_t number;
    canopy_time_t since; /* [us] */
} request_t;

/* How near the robot has come to a point, to notice when it comes no nearer. */
typedef struct {
    point_t target;
    int32_t nearest;     /* [mm] */
    canopy_time_t since; /* [us] */
} progress_t;

typedef struct {
    progress_t progress;
    uint8_t path; /* the number of the path being followed */
    uint8_t next; /* the point it is driving to */
} follow_t;

typedef struct {
    point_t target;
} move_t;

/* State of the control nodes. */

typedef struct {
    uint16_t reached; /* index of the furthest child that has been ticked */
} pipeline_t;

typedef struct {
    int32_t retries;
    bool recovering;
} recovery_t;

typedef struct {
    uint16_t next;  /* which child is due, from 0 */
    uint16_t tried; /* how many have failed in a row */
} round_robin_t;

typedef struct {
    canopy_time_t started; /* when the child was last started [us] */
    bool has_started;
} rate_t;

#endif
