/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The whole robot as the world of a controller of big.dbc (canopy/in_process.h): its sensors at their cycle times, its plant,
 * and people who do something to it now and then. What canopy-sim is on a desk, without its checks.
 *
 * One tick of the controller is one step of the plant: 10 ms in the profile `nao`, a second in `paper`, where every sensor is
 * sent in every tick.
 */
#ifndef NAO_BIG_WORLD_H
#define NAO_BIG_WORLD_H

#include "canopy/in_process.h"
#include "canopy_sim/robot.h"

/** Messages that a controller of big.dbc receives. */
enum { BIG_SENSORS = 8 };

/** What people may do by chance: bits of big_world_t.people. */
enum {
    BIG_PEOPLE_SAY = 1u << 0,
    BIG_PEOPLE_TOES = 1u << 1,
    BIG_PEOPLE_PUSH = 1u << 2,
    BIG_PEOPLE_DROP = 1u << 3,  /**< Take the ball out of the hand. */
    BIG_PEOPLE_DRAIN = 1u << 4, /**< Leave 21 % in the battery. */
    BIG_PEOPLE_PLUG = 1u << 5   /**< Pull the charger's plug, or put it back. */
};

/** The robot, what it was told last, and the people around it. */
typedef struct {
    canopy_sim_robot_t robot;     /**< May be set to any state before a tick. */
    canopy_sim_command_t command; /**< Of the last tick. */
    int32_t least_battery;        /**< Since it was last set [0.1 %]. */
    uint32_t people;              /**< What they may do; 0: nobody is there. */
    uint32_t people_every;        /**< Mean number of steps between two things that they do; 0 is 1. */
    uint64_t deeds;               /**< How many they did. */
    canopy_world_t world;
    canopy_sim_command_t next; /* of the tick under way */
    uint16_t places[BIG_SENSORS];
    uint32_t random; /* of the people: they are not the robot's chances */
    bool is_known;
} big_world_t;

/** A robot as canopy_sim_robot_init() makes it, and nobody around it. @return for canopy_in_process_init() */
const canopy_world_t *big_world_init(big_world_t *self, canopy_sim_profile_t profile, uint32_t seed);

#endif
