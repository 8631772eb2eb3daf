# SPDX-License-Identifier: MIT
# canopy_embed_images(TARGET NAME...): images of canopy_add_image(… FOR exchange) as C arrays NAME_bytes in NAME.inc, for
# tests that have no files. The file is its own script: cmake -DIMAGE=… -DOUTPUT=… -DNAME=… -P embed.cmake
if(CMAKE_SCRIPT_MODE_FILE)
  file(READ "${IMAGE}" digits HEX)
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${digits}")
  file(WRITE "${OUTPUT}" "static const uint8_t ${NAME}_bytes[] = {${bytes}};\n")
  return()
endif()

set(CANOPY_EMBED_SCRIPT "${CMAKE_CURRENT_LIST_FILE}")

function(canopy_embed_images TARGET)
  set(folder "${CMAKE_CURRENT_BINARY_DIR}/generated/exchange")
  add_library(${TARGET} INTERFACE)
  target_include_directories(${TARGET} INTERFACE "${folder}")
  foreach(name IN LISTS ARGN)
    add_custom_command(
      OUTPUT "${folder}/${name}.inc"
      COMMAND "${CMAKE_COMMAND}" -DIMAGE=${folder}/${name}.img -DOUTPUT=${folder}/${name}.inc -DNAME=${name}
              -P "${CANOPY_EMBED_SCRIPT}"
      DEPENDS ${name}_image "${folder}/${name}.img" "${CANOPY_EMBED_SCRIPT}"
      VERBATIM)
    add_custom_target(${name}_bytes DEPENDS "${folder}/${name}.inc")
    add_dependencies(${name}_bytes ${name}_image)
    add_dependencies(${TARGET} ${name}_bytes)
  endforeach()
endfunction()
