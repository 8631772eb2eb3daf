# SPDX-License-Identifier: MIT
# Arm Cortex-M4, its FPU not used.
set(CANOPY_CPU_FLAGS "-mcpu=cortex-m4 -mfloat-abi=soft")
include("${CMAKE_CURRENT_LIST_DIR}/cortex-m.cmake")
