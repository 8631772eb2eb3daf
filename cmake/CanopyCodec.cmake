# SPDX-License-Identifier: MIT
# canopy_add_codec(NAME DBC bus.dbc [NODE node])
#
# Makes the codec of a DBC at build time (`canopy codec`), and the static library NAME of it. Include "STEM_codec.h", where
# STEM is the C name of the DBC file: left_arm of LeftArm.dbc. docs/codec.md has the rest.
include_guard(GLOBAL)

include("${CMAKE_CURRENT_LIST_DIR}/CanopyApplication.cmake") # CANOPY_PYTHON, CANOPY_COMPILER_SOURCES

function(canopy_add_codec NAME)
  cmake_parse_arguments(PARSE_ARGV 1 CODEC "" "DBC;NODE" "")
  if(NOT CODEC_DBC OR CODEC_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "canopy_add_codec(${NAME}): DBC is missing, or unknown arguments: ${CODEC_UNPARSED_ARGUMENTS}")
  endif()
  cmake_path(ABSOLUTE_PATH CODEC_DBC BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" NORMALIZE)
  canopy_overlay_of("${CODEC_DBC}" overlay)
  cmake_path(GET CODEC_DBC STEM stem)
  canopy_c_name("${stem}" stem)
  set(folder "${CMAKE_CURRENT_BINARY_DIR}/generated/${NAME}")
  set(options "")
  if(CODEC_NODE)
    set(options --node "${CODEC_NODE}")
  endif()
  add_custom_command(
    OUTPUT "${folder}/${stem}_codec.c" "${folder}/${stem}_codec.h"
    COMMAND "${CANOPY_PYTHON}" -m canopy codec "${CODEC_DBC}" --output "${folder}" ${options}
    DEPENDS "${CODEC_DBC}" ${overlay} ${CANOPY_COMPILER_SOURCES}
    COMMENT "canopy codec ${NAME}"
    VERBATIM)
  add_library(${NAME} STATIC "${folder}/${stem}_codec.c" "${folder}/${stem}_codec.h")
  target_include_directories(${NAME} PUBLIC "${folder}")
  target_link_libraries(${NAME} PUBLIC canopy_runtime PRIVATE $<TARGET_NAME_IF_EXISTS:canopy_warnings>)
endfunction()
