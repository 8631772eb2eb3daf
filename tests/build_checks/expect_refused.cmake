# SPDX-License-Identifier: MIT
# cmake -DCHECK=script -DNM=nm -DLIBRARY=lib -DEXPECTED=regex -P expect_refused.cmake
# Succeeds when CHECK fails on LIBRARY and its message matches EXPECTED.
cmake_minimum_required(VERSION 3.25)
execute_process(COMMAND "${CMAKE_COMMAND}" "-DNM=${NM}" "-DLIBRARY=${LIBRARY}" -P "${CHECK}"
    RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(result EQUAL 0)
    message(FATAL_ERROR "${LIBRARY} was accepted.")
elseif(NOT output MATCHES "${EXPECTED}")
    message(FATAL_ERROR "The message does not match `${EXPECTED}`:\n${output}")
endif()
