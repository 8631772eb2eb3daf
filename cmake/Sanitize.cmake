# SPDX-License-Identifier: MIT
# Instruments everything built here, so that no part is missed:
#   CANOPY_SANITIZE  sanitizers: address,undefined, or one of them, or memory (clang), or thread
#   CANOPY_COVERAGE  clang's counters for lines, branches and MC/DC (clang 19 or later)
#   CANOPY_FUZZ      both sanitizers, and the guidance that libFuzzer needs (clang)
# CANOPY_INSTRUMENTED is true with any of them: such objects need symbols and memory of their own.
option(CANOPY_COVERAGE "Count lines, branches and MC/DC while the tests run (clang 19 or later)" OFF)
option(CANOPY_FUZZ "Build the fuzz targets of tests/fuzz (clang)" OFF)

set(CANOPY_INSTRUMENTED OFF)
if(CANOPY_FUZZ)
    set(CANOPY_SANITIZE address,undefined)
endif()
if(CANOPY_SANITIZE)
    set(CANOPY_INSTRUMENTED ON)
    add_compile_options(-fsanitize=${CANOPY_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
    add_link_options(-fsanitize=${CANOPY_SANITIZE})
endif()
if(CANOPY_FUZZ)
    add_compile_options(-fsanitize=fuzzer-no-link)
endif()
if(CANOPY_COVERAGE)
    set(CANOPY_INSTRUMENTED ON)
    add_compile_options(-fprofile-instr-generate -fcoverage-mapping -fcoverage-mcdc)
    add_link_options(-fprofile-instr-generate)
endif()
