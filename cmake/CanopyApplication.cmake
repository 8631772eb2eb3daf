# SPDX-License-Identifier: MIT
# canopy_add_application(NAME TREE tree.xml DBC bus.dbc NODE node PERIOD_MS ms LEAVES leaves.c…
#                        [MAIN_TREE id] [INCLUDE state_types.h] [ALLOW_FLOATING_POINT] [ALLOW_UNSET_PORTS]
#                        [TYPE_MAP "C++ type=C type"…] [ROS_PACKAGE name=folder…]
#                        [SEARCH folder, project or file…] [FOREIGN attribute…]
#                        [IMAGE_NODES nodes [IMAGE_USES uses]]
#                        [TRACE id [TRACE_ENTRIES all|marked|none] [TRACE_GUARD data_id] [TRACE_TICKS ticks]]
#                        [BITRATE bit/s] [FOREIGN_LOAD percent] [FOREIGN_BURST frames] [TX_LATENCY_US us]
#                        [MAX_RAM bytes] [MAX_FLASH bytes])
#
# Compiles a tree and a bus description to C at build time, and makes the static library NAME_application of the
# generated tables, the bus with its codec, and your leaves. Link it, and a CAN and a clock driver, into your program:
#
#   canopy_add_application(nao_home TREE trees/get_home.xml DBC nao.dbc NODE Controller PERIOD_MS 50 LEAVES home_leaves.c)
#   add_executable(nao_home main.c)
#   target_link_libraries(nao_home PRIVATE nao_home_application canopy_clock_posix)
#
# All that is generated begins with NAME. Several applications go into one program when each is another NODE of the DBC;
# two that are the same node do not link: docs/several-trees.md.
#
# The generated files, the model file for the host tools among them, are in
# ${CMAKE_CURRENT_BINARY_DIR}/generated/NAME.
#
# canopy_add_image(NAME TREE tree.xml FOR application [MODEL])
#
# Compiles another tree to an image that this application, of the same folder and with IMAGE_NODES, can load while it
# runs (docs/image.md): generated/APPLICATION/NAME.img, made by the target NAME_image. MODEL: its model file, too,
# NAME.model.json, for the host tools.
include_guard(GLOBAL)

include("${CMAKE_CURRENT_LIST_DIR}/Python.cmake") # CANOPY_PYTHON

# A change of the compiler compiles every application again.
cmake_path(GET CMAKE_CURRENT_LIST_DIR PARENT_PATH CANOPY_SOURCE_DIR)
file(GLOB_RECURSE CANOPY_COMPILER_SOURCES CONFIGURE_DEPENDS
     "${CANOPY_SOURCE_DIR}/host_tools/canopy/compiler/*.py" "${CANOPY_SOURCE_DIR}/host_tools/canopy/compiler/*.j2"
     "${CANOPY_SOURCE_DIR}/host_tools/canopy/tree/*.py"
     "${CANOPY_SOURCE_DIR}/runtime/include/canopy/nodes.def")
# A property: a variable would be known only where this file was included first.
set_property(GLOBAL PROPERTY CANOPY_COMPILER_SOURCES "${CANOPY_COMPILER_SOURCES}")

function(canopy_add_application NAME)
  cmake_parse_arguments(PARSE_ARGV 1 APP "ALLOW_FLOATING_POINT;ALLOW_UNSET_PORTS" 
                        "TREE;MAIN_TREE;DBC;NODE;PERIOD_MS;INCLUDE;BITRATE;FOREIGN_LOAD;FOREIGN_BURST;TX_LATENCY_US;TRACE;TRACE_ENTRIES;TRACE_GUARD;TRACE_TICKS;MAX_RAM;MAX_FLASH;IMAGE_NODES;IMAGE_USES" # one string: no list across lines
                        "LEAVES;TYPE_MAP;ROS_PACKAGE;SEARCH;FOREIGN")
  foreach(required TREE DBC NODE PERIOD_MS LEAVES)
    if(NOT APP_${required})
      message(FATAL_ERROR "canopy_add_application(${NAME}): ${required} is missing")
    endif()
  endforeach()
  if(APP_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "canopy_add_application(${NAME}): unknown arguments: ${APP_UNPARSED_ARGUMENTS}")
  endif()
  get_property(compiler GLOBAL PROPERTY CANOPY_COMPILER_SOURCES)
  cmake_path(ABSOLUTE_PATH APP_TREE BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" NORMALIZE)
  cmake_path(ABSOLUTE_PATH APP_DBC BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" NORMALIZE)
  cmake_path(GET APP_DBC FILENAME dbc_name)
  set(folder "${CMAKE_CURRENT_BINARY_DIR}/generated/${NAME}")
  set(sources "${folder}/${NAME}_app.c" "${folder}/${NAME}_bus.c")
  set(headers "${folder}/${NAME}_app.h" "${folder}/${NAME}_leaves.h" "${folder}/${NAME}_bus.h")
  set(options "")
  set(trace_dbc "")
  if(DEFINED APP_TRACE)
    set(trace_dbc "${folder}/${NAME}_trace.dbc")
  endif()
  foreach(option MAIN_TREE INCLUDE BITRATE FOREIGN_LOAD FOREIGN_BURST TX_LATENCY_US TRACE TRACE_ENTRIES TRACE_GUARD
                 TRACE_TICKS MAX_RAM MAX_FLASH IMAGE_NODES IMAGE_USES)
    if(DEFINED APP_${option})
      string(TOLOWER "${option}" flag)
      string(REPLACE "_" "-" flag "${flag}")
      string(REPLACE ";" "\\;" value "${APP_${option}}") # one argument, whatever is in it
      list(APPEND options "--${flag}" "${value}")
    endif()
  endforeach()
  if(APP_ALLOW_FLOATING_POINT)
    list(APPEND options --allow-floating-point)
  endif()
  if(APP_ALLOW_UNSET_PORTS)
    list(APPEND options --allow-unset-ports)
  endif()
  foreach(pair IN LISTS APP_TYPE_MAP)
    list(APPEND options --type-map "${pair}")
  endforeach()
  foreach(place IN LISTS APP_SEARCH) # the build runs elsewhere
    cmake_path(ABSOLUTE_PATH place BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" NORMALIZE)
    list(APPEND options --search "${place}")
  endforeach()
  foreach(name IN LISTS APP_FOREIGN)
    list(APPEND options --foreign "${name}")
  endforeach()
  foreach(pair IN LISTS APP_ROS_PACKAGE) # the build runs elsewhere
    string(REGEX MATCH "^([^=]*)=(.*)$" matched "${pair}")
    cmake_path(ABSOLUTE_PATH CMAKE_MATCH_2 BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" NORMALIZE)
    list(APPEND options --ros-package "${CMAKE_MATCH_1}=${CMAKE_MATCH_2}")
  endforeach()
  add_custom_command(
    OUTPUT ${sources} ${headers} "${folder}/${NAME}.model.json" "${folder}/${dbc_name}" ${trace_dbc}
    COMMAND "${CANOPY_PYTHON}" -I -m canopy compile # -I: the folder `canopy` of a build is no package
            "${APP_TREE}" --name "${NAME}" --dbc "${APP_DBC}" --node "${APP_NODE}"
            --period-ms "${APP_PERIOD_MS}" --output "${folder}" --depfile "${folder}.d" ${options}
    DEPENDS "${APP_TREE}" "${APP_DBC}" ${compiler}
    DEPFILE "${folder}.d" # the files that the tree includes
    COMMENT "canopy compile ${NAME}"
    VERBATIM)
  add_library(${NAME}_application STATIC ${sources} ${headers} ${APP_LEAVES})
  target_include_directories(${NAME}_application PUBLIC "${folder}" "${CMAKE_CURRENT_SOURCE_DIR}")
  target_link_libraries(${NAME}_application PUBLIC canopy_runtime PRIVATE $<TARGET_NAME_IF_EXISTS:canopy_warnings>)
endfunction()

function(canopy_add_image NAME)
  cmake_parse_arguments(PARSE_ARGV 1 IMAGE "MODEL" "TREE;FOR" "")
  if(NOT IMAGE_TREE OR NOT IMAGE_FOR OR IMAGE_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "canopy_add_image(${NAME}): TREE and FOR must be given, and nothing else")
  endif()
  get_property(compiler GLOBAL PROPERTY CANOPY_COMPILER_SOURCES)
  cmake_path(ABSOLUTE_PATH IMAGE_TREE BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" NORMALIZE)
  set(folder "${CMAKE_CURRENT_BINARY_DIR}/generated/${IMAGE_FOR}")
  set(image "${folder}/${NAME}.img")
  set(model "")
  if(IMAGE_MODEL)
    set(model --model)
  endif()
  add_custom_command(
    OUTPUT "${image}"
    COMMAND "${CANOPY_PYTHON}" -I -m canopy image build "${IMAGE_TREE}" --for "${folder}/${IMAGE_FOR}.model.json"
            --output "${image}" --depfile "${image}.d" ${model}
    DEPENDS "${IMAGE_TREE}" "${folder}/${IMAGE_FOR}.model.json" ${compiler}
    DEPFILE "${image}.d" # the files that the tree includes
    COMMENT "canopy image ${NAME} for ${IMAGE_FOR}"
    VERBATIM)
  add_custom_target(${NAME}_image ALL DEPENDS "${image}")
  # One rule makes the model file; two targets that both ran it would write it at the same time.
  add_dependencies(${NAME}_image ${IMAGE_FOR}_application)
endfunction()
