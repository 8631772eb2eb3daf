/* SPDX-License-Identifier: MIT */
/** @file What the courier does: takes orders, asks the planner for a way, and drives it. */
#include <string.h>

#include "courier_leaves.h"

#define MILLISECOND_US UINT32_C(1000)
#define ARRIVED_MM 30         /* so near to a point is there */
#define PROGRESS_MM 20        /* less is no progress */
#define BRAKING_PER_S 4       /* the last of the way is driven at distance times this */
#define SLOWEST_MM_PER_S 50   /* or it would never arrive */
#define FASTEST_MM_PER_S 1000 /* Drive has no higher one */

/* Orders */

static bool is_new(const courier_input_t *in, const pose_t *goal)
{
    return in->order.number != 0u && in->order.number != goal->order;
}

canopy_status_t wait_for_order_on_start(const courier_input_t *in, const wait_for_order_ports_t *ports)
{
    return is_new(in, ports->goal) ? CANOPY_SUCCESS : CANOPY_RUNNING;
}

canopy_status_t wait_for_order_on_running(const courier_input_t *in, const wait_for_order_ports_t *ports)
{
    return is_new(in, ports->goal) ? CANOPY_SUCCESS : CANOPY_RUNNING;
}

void wait_for_order_on_halted(const courier_input_t *in, const wait_for_order_ports_t *ports)
{
    (void)in;
    (void)ports;
}

canopy_status_t take_order_tick(const courier_input_t *in, const take_order_ports_t *ports)
{
    take_order_set_goal(ports, &(pose_t){.at = {.x = in->order.x, .y = in->order.y}, .order = in->order.number});
    return CANOPY_SUCCESS;
}

canopy_status_t order_changed_tick(const courier_input_t *in, const order_changed_ports_t *ports)
{
    return is_new(in, ports->goal) ? CANOPY_SUCCESS : CANOPY_FAILURE;
}

/*
 * Requests: sent in every tick until the answer with their number comes, or patience is at its end. A request has the
 * number after the last one answered, which the other board knows better than a program that has just started.
 */

static void begin_request(request_t *self, const courier_input_t *in, uint8_t answered)
{
    self->number = answered < UINT8_MAX ? (uint8_t)(answered + 1u) : 1u; /* 0 asks for nothing */
    self->since = in->now;
}

static bool has_waited(const courier_input_t *in, canopy_time_t since, uint32_t patience_ms)
{
    return in->now - since >= (canopy_time_t)patience_ms * MILLISECOND_US;
}

canopy_status_t compute_path_on_start(const courier_input_t *in, courier_output_t *out,
                                      const compute_path_ports_t *ports, request_t *self)
{
    begin_request(self, in, in->plan_reply.number);
    return compute_path_on_running(in, out, ports, self);
}

canopy_status_t compute_path_on_running(const courier_input_t *in, courier_output_t *out,
                                        const compute_path_ports_t *ports, request_t *self)
{
    if (in->plan_reply.number == self->number) {
        if (in->plan_reply.result != COURIER_PLAN_REPLY_RESULT_PLANNED) {
            return CANOPY_FAILURE;
        }
        compute_path_set_path(ports, &(path_t){
                                         .points = {{in->plan_reply.via_x, in->plan_reply.via_y}, ports->goal->at},
                                         .number = self->number,
                                     });
        return CANOPY_SUCCESS;
    }
    if (has_waited(in, self->since, ports->patience)) {
        return CANOPY_FAILURE;
    }
    courier_set_plan_request_number(out, self->number);
    courier_set_plan_request_x(out, ports->goal->at.x);
    courier_set_plan_request_y(out, ports->goal->at.y);
    return CANOPY_RUNNING;
}

void compute_path_on_halted(const courier_input_t *in, courier_output_t *out, const compute_path_ports_t *ports,
                            request_t *self)
{
    (void)in;
    (void)out; /* the request is not written any more, so it is the safe one: number 0 */
    (void)ports;
    (void)self;
}

canopy_status_t clear_map_on_start(const courier_input_t *in, courier_output_t *out, const clear_map_ports_t *ports,
                                   request_t *self)
{
    begin_request(self, in, in->map_status.clear_number);
    return clear_map_on_running(in, out, ports, self);
}

canopy_status_t clear_map_on_running(const courier_input_t *in, courier_output_t *out, const clear_map_ports_t *ports,
                                     request_t *self)
{
    if (in->map_status.clear_number == self->number) {
        return CANOPY_SUCCESS;
    }
    if (has_waited(in, self->since, ports->patience)) {
        return CANOPY_FAILURE;
    }
    courier_set_map_command_clear_number(out, self->number);
    courier_set_map_command_layer(out, strcmp(ports->layer, "Everything") == 0 ? COURIER_MAP_COMMAND_LAYER_EVERYTHING
                                                                               : COURIER_MAP_COMMAND_LAYER_OBSTACLES);
    return CANOPY_RUNNING;
}

void clear_map_on_halted(const courier_input_t *in, courier_output_t *out, const clear_map_ports_t *ports,
                         request_t *self)
{
    (void)in;
    (void)out;
    (void)ports;
    (void)self;
}

/* Driving. Distances are the larger one of the two coordinates': no root, and no floating point. */

static int32_t magnitude(int32_t value)
{
    return value < 0 ? -value : value;
}

static point_t way_to(const courier_input_t *in, point_t target)
{
    return (point_t){.x = target.x - in->pose.x, .y = target.y - in->pose.y};
}

static int32_t length_of(point_t way)
{
    return magnitude(way.x) > magnitude(way.y) ? magnitude(way.x) : magnitude(way.y);
}

/* Straight on, and slower towards the end. */
static void drive(courier_output_t *out, point_t way, uint32_t speed_mm_per_s)
{
    int32_t distance = length_of(way);
    int32_t limit = speed_mm_per_s < FASTEST_MM_PER_S ? (int32_t)speed_mm_per_s : FASTEST_MM_PER_S;
    int32_t speed = distance * BRAKING_PER_S;

    speed = speed < SLOWEST_MM_PER_S ? SLOWEST_MM_PER_S : speed;
    speed = speed > limit ? limit : speed;
    courier_set_drive_speed_x(out, way.x * speed / distance);
    courier_set_drive_speed_y(out, way.y * speed / distance);
}

static void expect_progress(progress_t *self, const courier_input_t *in, point_t target)
{
    *self = (progress_t){.target = target, .nearest = INT32_MAX, .since = in->now};
}

/* Has the robot come no nearer to the target for `patience_ms`? Another target is another beginning. */
static bool is_stuck(progress_t *self, const courier_input_t *in, point_t target, uint32_t patience_ms)
{
    int32_t distance = length_of(way_to(in, target));

    if (target.x != self->target.x || target.y != self->target.y) {
        expect_progress(self, in, target);
    }
    if (distance <= self->nearest - PROGRESS_MM) {
        self->nearest = distance;
        self->since = in->now;
    }
    return has_waited(in, self->since, patience_ms);
}

canopy_status_t follow_path_on_start(const courier_input_t *in, courier_output_t *out, const follow_path_ports_t *ports,
                                     follow_t *self)
{
    *self = (follow_t){.path = ports->path->number};
    expect_progress(&self->progress, in, ports->path->points[0]);
    return follow_path_on_running(in, out, ports, self);
}

canopy_status_t follow_path_on_running(const courier_input_t *in, courier_output_t *out,
                                       const follow_path_ports_t *ports, follow_t *self)
{
    if (self->path != ports->path->number) {
        self->path = ports->path->number;
        self->next = 0;
    }
    while (length_of(way_to(in, ports->path->points[self->next])) <= ARRIVED_MM) {
        self->next++;
        if (self->next == PATH_POINTS) {
            return CANOPY_SUCCESS;
        }
    }
    if (is_stuck(&self->progress, in, ports->path->points[self->next], ports->patience)) {
        return CANOPY_FAILURE;
    }
    drive(out, way_to(in, ports->path->points[self->next]), ports->speed);
    return CANOPY_RUNNING;
}

void follow_path_on_halted(const courier_input_t *in, courier_output_t *out, const follow_path_ports_t *ports,
                           follow_t *self)
{
    (void)in;
    (void)out; /* the speeds are not written any more, so they are the safe ones: 0 */
    (void)ports;
    (void)self;
}

canopy_status_t move_by_on_start(const courier_input_t *in, courier_output_t *out, const move_by_ports_t *ports,
                                 move_t *self)
{
    self->target = (point_t){.x = in->pose.x + ports->dx, .y = in->pose.y + ports->dy};
    return move_by_on_running(in, out, ports, self);
}

canopy_status_t move_by_on_running(const courier_input_t *in, courier_output_t *out, const move_by_ports_t *ports,
                                   move_t *self)
{
    point_t way = way_to(in, self->target);

    if (length_of(way) <= ARRIVED_MM) {
        return CANOPY_SUCCESS;
    }
    drive(out, way, ports->speed);
    return CANOPY_RUNNING;
}

void move_by_on_halted(const courier_input_t *in, courier_output_t *out, const move_by_ports_t *ports, move_t *self)
{
    (void)in;
    (void)out;
    (void)ports;
    (void)self;
}
