# SPDX-License-Identifier: MIT
# What the Cortex-M toolchains share. Include it after setting CANOPY_CPU_FLAGS.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)

# No C library, not even its headers where there is one: Canopy's firmware needs what C11 demands of a freestanding
# compiler, and memcpy() and its like; so the build shows it. (It also saves 370 MB of newlib in `make test`.)
cmake_path(SET libc NORMALIZE "${CMAKE_CURRENT_LIST_DIR}/../../tests/firmware/support/libc")
set(own_headers " -isystem \"${libc}\"")
foreach(folder IN ITEMS include include-fixed)
    execute_process(COMMAND ${CMAKE_C_COMPILER} -print-file-name=${folder}
        OUTPUT_VARIABLE path OUTPUT_STRIP_TRAILING_WHITESPACE)
    string(APPEND own_headers " -isystem \"${path}\"")
endforeach()
set(CMAKE_C_FLAGS_INIT
    "${CANOPY_CPU_FLAGS} -mthumb -ffreestanding -nostdinc${own_headers} -ffunction-sections -fdata-sections")
set(CMAKE_C_FLAGS_MINSIZEREL_INIT "-Os -g -DNDEBUG")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-nostdlib -Wl,--gc-sections -Wl,--fatal-warnings")
# The compiler's own helpers: 64-bit division and the like.
set(CMAKE_C_STANDARD_LIBRARIES_INIT "-lgcc")

set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)

# QEMU's board mps2-an386 has a Cortex-M4, which also runs the instructions of the smaller cores. Semihosting hands the
# program's output and exit status out.
set(CMAKE_CROSSCOMPILING_EMULATOR
    qemu-system-arm -M mps2-an386 -nographic -monitor none -serial none -semihosting-config enable=on,target=native
    -kernel)
