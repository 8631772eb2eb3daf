# SPDX-License-Identifier: MIT
# canopy_check_freestanding(TARGET): the build fails unless the static library TARGET could run on bare metal and owns
# no memory: no allocator, no stdio, no floating-point helper, no other foreign symbol, .data and .bss empty.
# CheckFreestanding.cmake has the rules. Not done with CANOPY_INSTRUMENTED: that adds symbols and data.
function(canopy_check_freestanding TARGET)
    if(CANOPY_INSTRUMENTED)
        return()
    endif()
    set(stamp "${CMAKE_CURRENT_BINARY_DIR}/${TARGET}.freestanding")
    set(script "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/CheckFreestanding.cmake")
    add_custom_command(
        OUTPUT "${stamp}"
        COMMAND "${CMAKE_COMMAND}" "-DLIBRARY=$<TARGET_FILE:${TARGET}>" "-DNM=${CMAKE_NM}" -P "${script}"
        COMMAND "${CMAKE_COMMAND}" -E touch "${stamp}"
        DEPENDS ${TARGET} "${script}"
        COMMENT "Checking that ${TARGET} is freestanding"
        VERBATIM)
    add_custom_target(${TARGET}_freestanding ALL DEPENDS "${stamp}")
endfunction()
