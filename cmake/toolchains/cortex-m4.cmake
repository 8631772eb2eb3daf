# SPDX-License-Identifier: MIT
# Arm Cortex-M4 without FPU use. Tests run in QEMU's mps2-an386 board; semihosting hands their output and exit status out.
set(CANOPY_CPU_FLAGS "-mcpu=cortex-m4 -mfloat-abi=soft")
include("${CMAKE_CURRENT_LIST_DIR}/cortex-m.cmake")
set(CMAKE_CROSSCOMPILING_EMULATOR
    qemu-system-arm -M mps2-an386 -nographic -monitor none -serial none -semihosting-config enable=on,target=native -kernel)
