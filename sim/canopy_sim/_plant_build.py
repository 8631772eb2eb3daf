# SPDX-License-Identifier: MIT
"""Builds the extension `canopy_sim._plant` from the plant's C sources (run by setuptools, see setup.py).

API mode: the C compiler checks every declaration below against the headers, so they cannot drift apart unseen.
"""

from cffi import FFI

ffibuilder = FFI()

ffibuilder.cdef(
    """
    typedef enum {
        CANOPY_SIM_POWER_STOP, CANOPY_SIM_POWER_DO_TASK, CANOPY_SIM_POWER_DRIVE_TO_CHARGER, CANOPY_SIM_POWER_CHARGE
    } canopy_sim_power_mode_t;
    typedef struct { int64_t distance_nm; int32_t battery; bool charging; } canopy_sim_power_t;
    bool canopy_sim_power_set(canopy_sim_power_t *power, int64_t distance_nm, int32_t battery);
    void canopy_sim_power_step(canopy_sim_power_t *power, canopy_sim_power_mode_t mode);
    int32_t canopy_sim_power_distance_mm(const canopy_sim_power_t *power);

    typedef enum {
        CANOPY_SIM_POSTURE_STOP, CANOPY_SIM_POSTURE_SIT_UP, CANOPY_SIM_POSTURE_STAND_UP, CANOPY_SIM_POSTURE_WALK_HOME
    } canopy_sim_posture_mode_t;
    typedef struct { int32_t head_x_mm; int32_t head_height_mm; } canopy_sim_posture_t;
    bool canopy_sim_posture_set(canopy_sim_posture_t *posture, int32_t head_x_mm, int32_t head_height_mm);
    void canopy_sim_posture_step(canopy_sim_posture_t *posture, canopy_sim_posture_mode_t mode);
    void canopy_sim_posture_push_over(canopy_sim_posture_t *posture);

    #define CANOPY_SIM_POWER_STEP_MS ...
    #define CANOPY_SIM_POSTURE_STEP_MS ...
    typedef struct { canopy_sim_power_t power; canopy_sim_posture_t posture; } canopy_sim_nao_t;
    void canopy_sim_nao_init(canopy_sim_nao_t *nao);
    """
)

# setuptools wants paths relative to setup.py.
ffibuilder.set_source(
    "canopy_sim._plant",
    '#include "canopy_sim/nao.h"',
    sources=["plant/src/nao.c", "plant/src/posture.c", "plant/src/power.c"],
    include_dirs=["plant/include"],
    extra_compile_args=["-std=c11"],
)

if __name__ == "__main__":
    ffibuilder.compile(verbose=True)
