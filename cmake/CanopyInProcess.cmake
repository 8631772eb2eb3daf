# SPDX-License-Identifier: MIT
# canopy_add_in_process(NAME [IMAGE] [WORLD function] [SOURCES world.c…] [LIBRARIES codec…])
#
# Makes a shared library of an application of this folder, with the runtime in it: generated/NAME/NAME.so, beside
# its model file, by the target NAME_in_process. The Python package canopy.inprocess loads it; each load is an
# instance of its own. docs/in-process.md has the rest.
#
#   canopy_add_application(nao_home TREE trees/get_home.xml … LEAVES home_leaves.c)
#   canopy_add_in_process(nao_home)
#
# WORLD names a function `const canopy_world_t *function(void)` in SOURCES: what surrounds the application, in C
# (canopy/in_process.h). IMAGE: the application has IMAGE_NODES, and may be given another tree. Every source is compiled once more, as position-independent code.
include_guard(GLOBAL)

# canopy_sources_of(VARIABLE TARGET…): absolute names of what the targets are compiled from, those that are generated too.
function(canopy_sources_of VARIABLE)
  set(found "")
  foreach(target IN LISTS ARGN)
    get_target_property(sources ${target} SOURCES)
    get_target_property(folder ${target} SOURCE_DIR)
    foreach(source IN LISTS sources)
      cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY "${folder}" NORMALIZE)
      list(APPEND found "${source}")
    endforeach()
  endforeach()
  set(${VARIABLE} "${found}" PARENT_SCOPE)
endfunction()

function(canopy_add_in_process NAME)
  cmake_parse_arguments(PARSE_ARGV 1 HOST "IMAGE" "WORLD" "SOURCES;LIBRARIES")
  if(HOST_UNPARSED_ARGUMENTS OR NOT TARGET ${NAME}_application)
    message(FATAL_ERROR "canopy_add_in_process(${NAME}): call canopy_add_application(${NAME} …) before it; "
                        "unknown arguments: ${HOST_UNPARSED_ARGUMENTS}")
  endif()
  set(targets canopy_runtime canopy_in_process ${NAME}_application ${HOST_LIBRARIES})
  canopy_sources_of(sources ${targets})
  list(APPEND sources ${HOST_SOURCES} "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/../drivers/in_process/library.c")
  add_library(${NAME}_library SHARED ${sources})
  set(folder "${CMAKE_CURRENT_BINARY_DIR}/generated/${NAME}")
  set_target_properties(${NAME}_library PROPERTIES OUTPUT_NAME ${NAME} PREFIX "" SUFFIX ".so"
                                                   LIBRARY_OUTPUT_DIRECTORY "${folder}")
  foreach(target IN LISTS targets)
    target_include_directories(${NAME}_library PRIVATE $<TARGET_PROPERTY:${target},INTERFACE_INCLUDE_DIRECTORIES>)
    add_dependencies(${NAME}_library ${target}) # one rule makes a generated file; two targets would write it at once
  endforeach()
  string(TOUPPER "${NAME}" upper)
  target_compile_definitions(
    ${NAME}_library PRIVATE CANOPY_IN_PROCESS=1 CANOPY_APP=${NAME}_app "CANOPY_BUS_HEADER=\"${NAME}_bus.h\""
                            CANOPY_RX_MESSAGES=${upper}_RX_MESSAGES $<$<BOOL:${HOST_WORLD}>:CANOPY_WORLD=${HOST_WORLD}>
                            $<$<BOOL:${HOST_IMAGE}>:CANOPY_IMAGE=${NAME}_image>)
  target_compile_features(${NAME}_library PRIVATE c_std_11)
  target_link_options(${NAME}_library PRIVATE -Wl,-Bsymbolic)
  if(CANOPY_SANITIZE) # Python has no sanitizer's runtime in it, and could not load the library
    target_compile_options(${NAME}_library PRIVATE -fno-sanitize=all)
    target_link_options(${NAME}_library PRIVATE -fno-sanitize=all)
  endif()
  target_link_libraries(${NAME}_library PRIVATE $<TARGET_NAME_IF_EXISTS:canopy_warnings>)
endfunction()
