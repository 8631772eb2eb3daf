/* SPDX-License-Identifier: MIT */
/** @file The robot of nao.dbc in the shared library of a controller (cmake/CanopyInProcess.cmake), for Python. */
#include "in_process.h"

const canopy_world_t *nao_library_world(void);
nao_world_t *nao_library_robot(void);

static nao_world_t nao;

const canopy_world_t *nao_library_world(void)
{
    return nao_world_init(&nao);
}

nao_world_t *nao_library_robot(void)
{
    return &nao;
}
