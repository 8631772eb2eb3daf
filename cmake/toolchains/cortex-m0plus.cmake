# SPDX-License-Identifier: MIT
# Arm Cortex-M0+: the smallest core Canopy is built for; no divide instruction, no unaligned access, no FPU.
set(CANOPY_CPU_FLAGS "-mcpu=cortex-m0plus")
include("${CMAKE_CURRENT_LIST_DIR}/cortex-m.cmake")
