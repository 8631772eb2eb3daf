# SPDX-License-Identifier: MIT
# 32-bit x86, Debian's cross compiler, or clang with its headers and libraries. An x86-64 kernel runs the programs. They are
# linked statically, so that no C library of that kind need be installed where they run; but gcc's address sanitizer cannot
# be, so programs with a sanitizer are run with the cross compiler's own C library.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR i686)
if(NOT CMAKE_C_COMPILER)
    set(CMAKE_C_COMPILER i686-linux-gnu-gcc)
endif()
set(CMAKE_C_COMPILER_TARGET i686-linux-gnu)
if(CANOPY_SANITIZE)
    set(i686_libraries /usr/i686-linux-gnu/lib)
    set(CMAKE_EXE_LINKER_FLAGS_INIT
        "-Wl,--dynamic-linker=${i686_libraries}/ld-linux.so.2 -Wl,-rpath,${i686_libraries}")
else()
    set(CMAKE_EXE_LINKER_FLAGS_INIT "-static")
endif()
set(CMAKE_CROSSCOMPILING_EMULATOR env)

set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
