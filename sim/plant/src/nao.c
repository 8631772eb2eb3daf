/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Plant: one NAO.
 */
#include "canopy_sim/nao.h"

void canopy_sim_nao_init(canopy_sim_nao_t *nao)
{
    /* Fig. 28, and the farthest start of Lemma 11. */
    (void)canopy_sim_power_set(&nao->power, 80 * CANOPY_SIM_NM_PER_M, 500);
    (void)canopy_sim_posture_set(&nao->posture, 500, 0);
}

void canopy_sim_nao_step(canopy_sim_nao_t *nao, canopy_sim_power_mode_t power, canopy_sim_posture_mode_t posture)
{
    canopy_sim_power_step(&nao->power, power);
    canopy_sim_posture_step(&nao->posture, posture);
}
