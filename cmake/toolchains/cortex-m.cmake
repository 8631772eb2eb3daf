# SPDX-License-Identifier: MIT
# What the Cortex-M toolchains share. Include it after setting CANOPY_CPU_FLAGS.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)

set(CMAKE_C_FLAGS_INIT "${CANOPY_CPU_FLAGS} -mthumb -ffunction-sections -fdata-sections")
# Firmware is built for size; assertions of the C library have no place to print to.
set(CMAKE_BUILD_TYPE_INIT MinSizeRel)
set(CMAKE_C_FLAGS_MINSIZEREL_INIT "-Os -g -DNDEBUG")
set(CMAKE_EXE_LINKER_FLAGS_INIT "--specs=nano.specs -nostartfiles -Wl,--gc-sections -Wl,--fatal-warnings")

set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
