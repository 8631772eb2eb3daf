# SPDX-License-Identifier: MIT
# Target lcm_types: what lcm-gen makes of host_tools/lcm_types/*.lcm. Python classes in <build>/lcm/python/canopy_msgs; with a
# JDK also <build>/lcm/canopy_msgs.jar, with which lcm-spy decodes Canopy's messages (`canopy spy`).
#
# LCM is a way to watch, not a need: where lcm-gen cannot run the build goes on, and configure says so in one line.
# Needs CANOPY_PYTHON (Python.cmake), the interpreter whose package lcm is used.

# Sets OUT to the folder lcm's wheel was installed into, empty when it is not there.
function(canopy_find_lcm OUT)
    execute_process(
        COMMAND "${CANOPY_PYTHON}" -c
            "import importlib.util as u; s = u.find_spec('lcm'); print(s.origin.rsplit('/', 2)[0] if s else '', end='')"
        OUTPUT_VARIABLE folder RESULT_VARIABLE result ERROR_QUIET)
    if(NOT result EQUAL 0)
        set(folder "")
    endif()
    set(${OUT} "${folder}" PARENT_SCOPE)
endfunction()

# Sets OUT to the reason and the way out when lcm-gen of FOLDER cannot run, else to nothing.
function(canopy_check_lcm_gen FOLDER OUT)
    set(${OUT} "" PARENT_SCOPE)
    if(NOT FOLDER)
        set(${OUT} "${CANOPY_PYTHON} has no package lcm: pip install lcm" PARENT_SCOPE)
        return()
    endif()
    execute_process(COMMAND "${FOLDER}/bin/lcm-gen" --version
        RESULT_VARIABLE result OUTPUT_QUIET ERROR_VARIABLE errors)
    if(result EQUAL 0)
        return()
    elseif(errors MATCHES "libglib")
        set(${OUT} "lcm-gen needs libglib-2.0.so.0: apt-get install libglib2.0-0" PARENT_SCOPE)
    else()
        string(REGEX REPLACE "[\r\n]+" " " errors "${errors}")
        set(${OUT} "${FOLDER}/bin/lcm-gen does not run (${result} ${errors}): pip install --force-reinstall lcm"
            PARENT_SCOPE)
    endif()
endfunction()

# Generates into folders that are emptied first, so that a type that is gone leaves nothing behind.
function(canopy_add_lcm_types FOLDER)
    set(source "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/../host_tools/lcm_types")
    set(build "${CMAKE_BINARY_DIR}/lcm")
    file(GLOB types CONFIGURE_DEPENDS "${source}/*.lcm")
    add_custom_command(
        OUTPUT "${build}/python.stamp"
        COMMAND "${CMAKE_COMMAND}" -E rm -rf "${build}/python"
        COMMAND "${CMAKE_COMMAND}" -E make_directory "${build}/python"
        COMMAND "${FOLDER}/bin/lcm-gen" --python --ppath "${build}/python" ${types}
        COMMAND "${CMAKE_COMMAND}" -E touch "${build}/python.stamp"
        DEPENDS ${types} "${FOLDER}/bin/lcm-gen"
        COMMENT "Generating the LCM types for Python"
        VERBATIM)
    set(made "${build}/python.stamp")

    find_program(CANOPY_JAVAC javac DOC "Java compiler for the LCM types of lcm-spy")
    if(CANOPY_JAVAC)
        set(java_files ${types})
        list(TRANSFORM java_files REPLACE ".*/([^/]+)[.]lcm$" "${build}/java/canopy_msgs/\\1.java")
        # A jar is a zip file; cmake packs it, so that one Java tool is enough.
        add_custom_command(
            OUTPUT "${build}/canopy_msgs.jar"
            COMMAND "${CMAKE_COMMAND}" -E rm -rf "${build}/java" "${build}/classes"
            COMMAND "${CMAKE_COMMAND}" -E make_directory "${build}/java" "${build}/classes"
            COMMAND "${FOLDER}/bin/lcm-gen" --java --jpath "${build}/java" ${types}
            COMMAND "${CANOPY_JAVAC}" -encoding UTF-8 -source 8 -target 8 -Xlint:-options
                -cp "${FOLDER}/share/java/lcm.jar" -sourcepath "${build}/java" -d "${build}/classes"
                ${java_files}
            COMMAND "${CMAKE_COMMAND}" -E chdir "${build}/classes"
                "${CMAKE_COMMAND}" -E tar cf "${build}/canopy_msgs.jar" --format=zip canopy_msgs
            COMMAND "${CMAKE_COMMAND}" -E rm -rf "${build}/java" "${build}/classes"
            DEPENDS ${types} "${FOLDER}/bin/lcm-gen"
            COMMENT "Building canopy_msgs.jar, the LCM types for lcm-spy"
            VERBATIM)
        list(APPEND made "${build}/canopy_msgs.jar")
    else()
        message(STATUS "No canopy_msgs.jar for lcm-spy: no javac; to have it: apt-get install default-jdk-headless")
    endif()
    add_custom_target(lcm_types ALL DEPENDS ${made})
endfunction()

canopy_find_lcm(canopy_lcm_folder)
canopy_check_lcm_gen("${canopy_lcm_folder}" canopy_lcm_trouble)
if(canopy_lcm_trouble)
    message(STATUS "No LCM types, Canopy goes on without LCM: ${canopy_lcm_trouble}")
else()
    canopy_add_lcm_types("${canopy_lcm_folder}")
endif()
