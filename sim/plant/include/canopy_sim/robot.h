/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Plant: the whole robot of Example 6 (Fig. 34, the Big BT): battery, place, posture, toes, voice, speech, arms, ball.
 *
 *     static canopy_sim_robot_t robot;
 *     canopy_sim_robot_init(&robot, CANOPY_SIM_PROFILE_NAO, 1);
 *     canopy_sim_robot_step(&robot, &(canopy_sim_command_t){.legs = CANOPY_SIM_LEGS_STAND_UP});
 *
 * The robot obeys and has no will: which command is right is the controller's business, and a command that the body cannot
 * carry out does nothing (a robot that lies does not walk). The only exception is a command that two parts share: legs that
 * are told to walk home and a drive to the charger at once do what the legs are told.
 *
 * Everything that happens is a function of the state, the seed, and what people do (the functions below step): the same
 * calls give the same bits everywhere. Whole numbers only; the two profiles are in figures.h.
 *
 * Threads: none, no global state; the caller owns the object. Every function takes constant time and may be used from
 * firmware.
 */
#ifndef CANOPY_SIM_ROBOT_H
#define CANOPY_SIM_ROBOT_H

#include <stdbool.h>
#include <stdint.h>

#include "canopy_sim/figures.h"
#include "canopy_sim/nao.h"

/** What the legs are told; the numbers are those of the CAN signal PostureCommand.Mode, the first four posture.h's. */
typedef enum {
    CANOPY_SIM_LEGS_STOP = 0,
    CANOPY_SIM_LEGS_SIT_UP = 1,
    CANOPY_SIM_LEGS_STAND_UP = 2,
    CANOPY_SIM_LEGS_WALK_HOME = 3,
    CANOPY_SIM_LEGS_SIT_DOWN = 4,
    CANOPY_SIM_LEGS_LIE_DOWN = 5,
    CANOPY_SIM_LEGS_BACK_OFF = 6,
    CANOPY_SIM_LEGS_APPROACH_BALL = 7
} canopy_sim_legs_t;

/** What the arms are told; UpperCommand.Arms. */
typedef enum {
    CANOPY_SIM_ARMS_STOP = 0,
    CANOPY_SIM_ARMS_WAVE = 1,
    CANOPY_SIM_ARMS_GRASP = 2,
    CANOPY_SIM_ARMS_THROW = 3
} canopy_sim_arms_t;

/** What can be said; UpperCommand.Say. */
typedef enum {
    CANOPY_SIM_SAY_NOTHING = 0,
    CANOPY_SIM_SAY_OUCH = 1,
    CANOPY_SIM_SAY_WHAT_TO_DO = 2,
    CANOPY_SIM_SAY_GOODBYE = 3
} canopy_sim_say_t;

/** What people can wish; Voice.Suggestion. */
typedef enum {
    CANOPY_SIM_WISH_NOTHING = 0,
    CANOPY_SIM_WISH_SIT = 1,
    CANOPY_SIM_WISH_STAND_UP = 2,
    CANOPY_SIM_WISH_SLEEP = 3,
    CANOPY_SIM_WISH_SAY_GOODBYE = 4,
    CANOPY_SIM_WISH_BALL_GAME = 5,
    CANOPY_SIM_WISHES = 6
} canopy_sim_wish_t;

/** How it is; Posture.Name. [figures.h, e] */
typedef enum {
    CANOPY_SIM_IS_MOVING = 0, /**< On the way from one to another. */
    CANOPY_SIM_IS_STANDING = 1,
    CANOPY_SIM_IS_SITTING = 2,
    CANOPY_SIM_IS_ON_BACK = 3,
    CANOPY_SIM_IS_ON_BELLY = 4
} canopy_sim_pose_t;

/** Where the ball is; Ball.Hand. */
typedef enum {
    CANOPY_SIM_HAND_EMPTY = 0,
    CANOPY_SIM_HAND_HOLDS = 1,
    CANOPY_SIM_HAND_THREW = 2 /**< The ball is in the air. */
} canopy_sim_hand_t;

/** State of a timed act (speech, arms); Acts.SpeechState, Acts.ArmsState. */
typedef enum { CANOPY_SIM_ACT_IDLE = 0, CANOPY_SIM_ACT_BUSY = 1, CANOPY_SIM_ACT_DONE = 2 } canopy_sim_act_state_t;

/** What the robot is told to do. All zero: stop. `say_number`, `arms_number`: another number is another order. */
typedef struct {
    canopy_sim_power_mode_t power;
    canopy_sim_legs_t legs;
    canopy_sim_arms_t arms;
    canopy_sim_say_t say;
    uint8_t arms_number;
    uint8_t say_number;
    bool track_ball;
} canopy_sim_command_t;

/** A timed act: begins with an order, is done after its time, and forgets when the order is withdrawn. */
typedef struct {
    uint32_t left_ms;
    canopy_sim_act_state_t state;
    uint8_t what;   /**< Of the order obeyed last. */
    uint8_t number; /**< The same. */
} canopy_sim_act_t;

enum { CANOPY_SIM_JOINTS = 5, CANOPY_SIM_TOES = 4 };

/** Groups of joints, for their temperatures; Joints. */
typedef enum {
    CANOPY_SIM_JOINT_HEAD = 0,
    CANOPY_SIM_JOINT_LEFT_ARM,
    CANOPY_SIM_JOINT_RIGHT_ARM,
    CANOPY_SIM_JOINT_LEFT_LEG,
    CANOPY_SIM_JOINT_RIGHT_LEG
} canopy_sim_joint_t;

/** State of the robot. Read it freely, write it through the functions. */
typedef struct {
    canopy_sim_nao_t nao; /**< Distance to the charger and charge; the head's place and height: in both profiles. */
    const canopy_sim_figures_t *figures;
    uint64_t time_ms; /**< The robot's time since its start. */
    uint64_t steps;
    int64_t energy_uj;    /**< `nao`: in the battery. */
    int64_t odometer_um;  /**< Walked so far, forwards and backwards alike. */
    int64_t obstacle_um;  /**< Odometer at which a foot is free again; 0: nothing is in the way. */
    int32_t battery_mdeg; /**< Temperature of the battery [0.001 °C]. */
    int32_t current_ma;   /**< Into the battery; negative: out of it. */
    int32_t joint_mdeg[CANOPY_SIM_JOINTS];
    int32_t ball_um; /**< How far the ball is. */
    uint32_t random;
    uint32_t transition_ms; /**< Left of the way to `next_pose`. */
    uint32_t transition_all_ms;
    uint32_t found_ms;       /**< How long the tracker has looked for the ball. */
    uint32_t flight_ms;      /**< Left of the ball's flight. */
    uint32_t press_ms;       /**< How long the toes are pressed yet. */
    uint32_t falls;          /**< Times that it fell, pushed or by itself. */
    canopy_sim_act_t speech; /**< What it says. */
    canopy_sim_act_t arms;   /**< What its arms do. */
    canopy_sim_profile_t profile;
    canopy_sim_pose_t pose;
    canopy_sim_pose_t from_pose; /* of a transition */
    canopy_sim_pose_t next_pose;
    canopy_sim_hand_t hand;
    canopy_sim_wish_t wish; /**< The last one. */
    uint8_t wishes;         /**< How many there were, modulo 256. */
    uint8_t toes;           /**< Bits: left outer, left inner, right inner, right outer. */
    bool chest_button;
    bool tracked;   /**< The ball is seen. */
    bool unplugged; /**< The charger has no mains. */
} canopy_sim_robot_t;

/**
 * Puts the robot where missions begin: `paper` as canopy_sim_nao_init(), on the floor; `nao` standing 3 m from its charger,
 * charge 80 %. The ball is 1.5 m away.
 * @param seed of the chances; 0 is 1
 */
void canopy_sim_robot_init(canopy_sim_robot_t *robot, canopy_sim_profile_t profile, uint32_t seed);

/** One step of the profile's length. */
void canopy_sim_robot_step(canopy_sim_robot_t *robot, const canopy_sim_command_t *command);

/**
 * Sets charge and distance, as canopy_sim_power_set(). @return false: out of range, nothing is changed.
 */
bool canopy_sim_robot_set_power(canopy_sim_robot_t *robot, int64_t distance_nm, int32_t battery);

/** Sets the head's place and height, as canopy_sim_posture_set(), and with them how it stands. @return false: out of range. */
bool canopy_sim_robot_set_posture(canopy_sim_robot_t *robot, int32_t head_x_mm, int32_t head_height_mm);

/** Puts the ball so far away, on the floor. @return false: not within 0..5000 mm. */
bool canopy_sim_robot_set_ball(canopy_sim_robot_t *robot, int32_t distance_mm);

/* What people do. */

/** Somebody says what the robot should do. @return false: no such wish. */
bool canopy_sim_robot_say(canopy_sim_robot_t *robot, canopy_sim_wish_t wish);

/** Somebody presses the button on the chest: the wish after the last one. */
void canopy_sim_robot_press_chest(canopy_sim_robot_t *robot);

/**
 * Something presses toe bumpers: for `ms` of the robot's time; 0: it is in the way, until the robot has backed off 0.25 m.
 * @param toes bits, as in canopy_sim_robot_t; others are left out
 */
void canopy_sim_robot_press_toes(canopy_sim_robot_t *robot, uint8_t toes, uint32_t ms);

/** Somebody pushes the robot over: it lies, on its back or its belly, as chance has it; what it holds it drops. */
void canopy_sim_robot_push_over(canopy_sim_robot_t *robot);

/** The battery has only so much charge left [0.1 %]. @return false: not within 0..1000. */
bool canopy_sim_robot_drain(canopy_sim_robot_t *robot, int32_t battery);

/** Somebody pulls the charger's plug, or puts it back. */
void canopy_sim_robot_plug(canopy_sim_robot_t *robot, bool is_plugged);

/** The legs are as hot as 85 °C. */
void canopy_sim_robot_overheat(canopy_sim_robot_t *robot);

/** Whatever is in the hand falls, half a metre away. */
void canopy_sim_robot_drop_ball(canopy_sim_robot_t *robot);

/* What sensors show, where it is not a member. */

/** At the charger, and the charger has mains. */
bool canopy_sim_robot_is_plugged(const canopy_sim_robot_t *robot);

#endif
