# SPDX-License-Identifier: MIT
# The target `canopy_unity`: ThrowTheSwitch's Unity, from the first of
#   1. an installed unityConfig.cmake,
#   2. UNITY_DIR, a folder with src/unity.c (or unity.c),
#   3. the source distribution of the PyPI package pytest-unity, which holds the whole of Unity 2.7.0; it is fetched
#      with pip, its checksum compared, and unpacked in the build folder.
set(UNITY_DIR "" CACHE PATH "Folder of Unity's sources; empty: an installed one, else fetched with pip")
set(CANOPY_UNITY_PACKAGE "pytest-unity==0.1.0")
set(CANOPY_UNITY_ARCHIVE "pytest_unity-0.1.0.tar.gz")
set(CANOPY_UNITY_SHA256 "cd3ceb4aeb4f7866f935957f91874999d8ae13ff014684464ade0b7071e28298")

# Sets OUT to the folder of unity.c in the unpacked archive.
function(canopy_fetch_unity OUT)
    set(archive "${CANOPY_DOWNLOAD_DIR}/${CANOPY_UNITY_ARCHIVE}")
    set(help "Give the folder of a Unity 2.6 or later with -DUNITY_DIR=, or put ${CANOPY_UNITY_ARCHIVE} into "
             "${CANOPY_DOWNLOAD_DIR}.")
    string(CONCAT help ${help})
    file(MAKE_DIRECTORY "${CANOPY_DOWNLOAD_DIR}")
    file(LOCK "${archive}.lock" GUARD FUNCTION TIMEOUT 300)
    if(NOT EXISTS "${archive}")
        message(STATUS "Fetching Unity (${CANOPY_UNITY_PACKAGE}) with pip")
        # Not `--no-binary :all:`: pip would build the package's build system, and what that is built with, from source.
        execute_process(
            COMMAND "${CANOPY_PYTHON}" -m pip download --quiet --disable-pip-version-check --no-deps
                    --no-binary pytest-unity --dest "${CANOPY_DOWNLOAD_DIR}" "${CANOPY_UNITY_PACKAGE}"
            RESULT_VARIABLE result ERROR_VARIABLE errors)
        if(NOT result EQUAL 0)
            message(FATAL_ERROR "Unity could not be fetched with pip:\n${errors}\n${help}")
        endif()
    endif()
    file(SHA256 "${archive}" sum)
    if(NOT sum STREQUAL CANOPY_UNITY_SHA256)
        message(FATAL_ERROR "${archive} has the sha256 ${sum}, not ${CANOPY_UNITY_SHA256}. Delete it. ${help}")
    endif()
    set(unpacked "${CMAKE_CURRENT_BINARY_DIR}/unity")
    if(NOT EXISTS "${unpacked}")
        file(ARCHIVE_EXTRACT INPUT "${archive}" DESTINATION "${unpacked}" PATTERNS "*/vendor/unity/*")
    endif()
    file(GLOB_RECURSE sources "${unpacked}/*/unity.c")
    if(NOT sources)
        message(FATAL_ERROR "There is no unity.c in ${archive}. ${help}")
    endif()
    list(GET sources 0 source)
    cmake_path(GET source PARENT_PATH folder)
    set(${OUT} "${folder}" PARENT_SCOPE)
endfunction()

if(NOT UNITY_DIR AND NOT CMAKE_CROSSCOMPILING)
    find_package(unity CONFIG QUIET)
endif()
if(unity_FOUND)
    add_library(canopy_unity INTERFACE)
    target_link_libraries(canopy_unity INTERFACE unity::framework)
    return()
endif()

if(NOT UNITY_DIR)
    canopy_fetch_unity(CANOPY_UNITY_SOURCES)
elseif(EXISTS "${UNITY_DIR}/src/unity.c")
    set(CANOPY_UNITY_SOURCES "${UNITY_DIR}/src")
elseif(EXISTS "${UNITY_DIR}/unity.c")
    set(CANOPY_UNITY_SOURCES "${UNITY_DIR}")
else()
    message(FATAL_ERROR "There is no unity.c in UNITY_DIR (${UNITY_DIR}), nor in its subfolder src.")
endif()
add_library(canopy_unity STATIC "${CANOPY_UNITY_SOURCES}/unity.c")
target_include_directories(canopy_unity SYSTEM PUBLIC "${CANOPY_UNITY_SOURCES}")
target_compile_definitions(canopy_unity PUBLIC UNITY_SUPPORT_64)
