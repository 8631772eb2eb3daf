# SPDX-License-Identifier: MIT
# canopy_print_sizes(TARGET...): adds libraries or programs to the table that the build target `sizes` prints.
function(canopy_print_sizes)
    set_property(GLOBAL APPEND PROPERTY CANOPY_SIZE_TARGETS ${ARGN})
endfunction()

# Called once every folder has been read.
function(canopy_add_sizes_target)
    get_property(targets GLOBAL PROPERTY CANOPY_SIZE_TARGETS)
    set(arguments "")
    foreach(target IN LISTS targets)
        get_target_property(type ${target} TYPE)
        if(type STREQUAL "OBJECT_LIBRARY")
            list(APPEND arguments "-D${target}=$<TARGET_OBJECTS:${target}>")
        else()
            list(APPEND arguments "-D${target}=$<TARGET_FILE:${target}>")
        endif()
    endforeach()
    cmake_path(GET CMAKE_BINARY_DIR FILENAME build)
    add_custom_target(sizes
        COMMAND "${CMAKE_COMMAND}" ${arguments} "-DTARGETS=${targets}" "-DTITLE=${build}"
                "-DSIZE=${CANOPY_SIZE_PROGRAM}" -P "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/PrintSizes.cmake"
        DEPENDS ${targets}
        VERBATIM)
endfunction()

# GNU size of the same tool chain as nm; CMake does not look for it itself.
string(REGEX REPLACE "nm$" "size" CANOPY_SIZE_PROGRAM "${CMAKE_NM}")
cmake_language(DEFER DIRECTORY "${PROJECT_SOURCE_DIR}" CALL canopy_add_sizes_target)
