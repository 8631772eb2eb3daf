/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The two profiles of the whole robot: the paper's equations, and a NAO's documented figures. Same code, other numbers.
 *
 * `paper`: Eqs. 39 to 59 of Colledanchise & Ögren as power.h and posture.h have them, a step a second, the power part in
 * every tenth. What the paper has no numbers for (sitting and lying down, ball, speech, wave) has those of
 * examples/papers/trees/fig34.plant.toml, or Canopy's own.
 *
 * `nao`: steps of 10 ms. Sources, by letter in figures.c:
 *   [a] Aldebaran's data sheet of the NAO H25 V5: battery 48.6 Wh at 21.6 V; autonomy 60 min in active use, 90 min in
 *       normal use; charged in 3 h; height 574 mm; four toe bumpers, of which this plant has both halves of each foot.
 *   [b] NAOqi's documentation, DCM: sensors and actuators have a constant cycle of up to 10 ms (10 ms on a NAO).
 *   [c] Gouaillier et al., "Mechatronic design of NAO humanoid", ICRA 2009: it walks at 0.6 km/h.
 *   [d] Reichenberg & Laue, "Stand Up, NAO!", arXiv:2510.02129 (2025): stand-up motions take seconds and fail now and then;
 *       a robot lies on its back or on its belly. 2 to 5 s here; the odds of a failure are Canopy's.
 *   [e] NAOqi's documentation, ALRobotPosture: Stand, Sit, LyingBack, LyingBelly.
 *   [-] Canopy's own, where no figure was found; chosen so that a demonstration shows it.
 */
#ifndef CANOPY_SIM_FIGURES_H
#define CANOPY_SIM_FIGURES_H

#include <stdint.h>

/** Which numbers. */
typedef enum { CANOPY_SIM_PROFILE_PAPER = 0, CANOPY_SIM_PROFILE_NAO = 1 } canopy_sim_profile_t;

/** The numbers of a profile. */
typedef struct {
    uint32_t step_ms; /**< Of canopy_sim_robot_step(), in the robot's time. */
    int32_t walk_um;  /**< Walked in a step [um]. */
    uint32_t grasp_ms;
    uint32_t grasp_percent; /**< Of all grasps, how many get the ball. */
    uint32_t throw_ms;
    uint32_t flight_ms; /**< Time from the hand to the floor. */
    uint32_t say_ms;
    uint32_t wave_ms;
    uint32_t find_ms; /**< Until the tracker has the ball. */
    int32_t reach_mm; /**< Closer than that the ball can be grasped. */
    int32_t throw_least_mm;
    int32_t throw_most_mm;
    /* From here on `nao` alone; the paper's are in power.h and posture.h. */
    int64_t capacity_uj;
    int64_t normal_mw;
    int64_t active_mw;
    int64_t charge_mw; /**< Net, into the battery. */
    uint32_t sit_up_ms;
    uint32_t stand_up_least_ms;
    uint32_t stand_up_most_ms;
    uint32_t sit_down_ms;
    uint32_t lie_down_ms;
    uint32_t fall_percent; /**< Of all sitting and standing up, how much fails. */
    int32_t stand_mm;      /**< Height of the head. */
    int32_t sit_mm;
    int32_t lie_mm;
} canopy_sim_figures_t;

/** The numbers of a profile; of one that is none, those of the paper. O(1). */
const canopy_sim_figures_t *canopy_sim_figures(canopy_sim_profile_t profile);

#endif
