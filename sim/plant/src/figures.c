/* SPDX-License-Identifier: MIT */
/** @file The numbers of the profiles; figures.h has the sources behind the letters. */
#include "canopy_sim/figures.h"

static const canopy_sim_figures_t paper = {
    .step_ms = 1000,   /* Example 5's step; Example 4's is ten of them */
    .walk_um = 100000, /* fig34.plant.toml: the ball comes 0.1 m closer in a step; Walk Home's step too */
    .grasp_ms = 4000,  /* fig34.plant.toml: grip + 0.25 */
    .grasp_percent = 100,
    .throw_ms = 2000, /* fig34.plant.toml: thrown + 0.5 */
    .flight_ms = 1000,
    .say_ms = 2000,
    .wave_ms = 3000,
    .find_ms = 1000,
    .reach_mm = 200, /* fig34.plant.toml: close is 0.2 m */
    .throw_least_mm = 800,
    .throw_most_mm = 3000, /* fig34.plant.toml: at most 3 m away */
};

static const canopy_sim_figures_t nao = {
    .step_ms = 10,                        /* [b] */
    .walk_um = 1667,                      /* [c] 0.6 km/h */
    .grasp_ms = 1500,                     /* [-] */
    .grasp_percent = 80,                  /* [-] */
    .throw_ms = 1000,                     /* [-] */
    .flight_ms = 500,                     /* [-] */
    .say_ms = 1500,                       /* [-] */
    .wave_ms = 3000,                      /* [-] */
    .find_ms = 300,                       /* [-] */
    .reach_mm = 200,                      /* as `paper` */
    .throw_least_mm = 800,                /* [-] */
    .throw_most_mm = 2000,                /* [-] */
    .capacity_uj = INT64_C(174960000000), /* [a] 48.6 Wh */
    .normal_mw = 32400,                   /* [a] 48.6 Wh in 90 min */
    .active_mw = 48600,                   /* [a] 48.6 Wh in 60 min */
    .charge_mw = 16200,                   /* [a] 48.6 Wh in 3 h */
    .sit_up_ms = 3000,                    /* [d] */
    .stand_up_least_ms = 2000,            /* [d] */
    .stand_up_most_ms = 5000,             /* [d] */
    .sit_down_ms = 2000,                  /* [-] */
    .lie_down_ms = 2000,                  /* [-] */
    .fall_percent = 10,                   /* [-] */
    .stand_mm = 550,                      /* [a] the head's middle of 574 mm in all */
    .sit_mm = 350,                        /* [-] */
    .lie_mm = 50,                         /* [-] */
};

const canopy_sim_figures_t *canopy_sim_figures(canopy_sim_profile_t profile)
{
    return profile == CANOPY_SIM_PROFILE_NAO ? &nao : &paper;
}
