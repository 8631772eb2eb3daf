# SPDX-License-Identifier: MIT
# CANOPY_PYTHON: the interpreter that runs `canopy compile` and lcm-gen's environment in the build; it must have the
# package canopy-bt. The Makefile puts it into build/venv, and the presets point there.
if(NOT CANOPY_PYTHON)
    find_package(Python3 3.10 COMPONENTS Interpreter REQUIRED)
    set(CANOPY_PYTHON "${Python3_EXECUTABLE}" CACHE FILEPATH "Python interpreter with the package canopy-bt")
endif()
if(NOT EXISTS "${CANOPY_PYTHON}")
    message(FATAL_ERROR "CANOPY_PYTHON is ${CANOPY_PYTHON}, which does not exist. Run `make demo` or `make test`, "
        "which make it, or set -DCANOPY_PYTHON= to an interpreter that has the package of host_tools/ (pip install ./host_tools).")
endif()

# The compiler's C name of a file's stem: LeftArm -> left_arm.
function(canopy_c_name STEM RESULT)
  execute_process(
    COMMAND "${CANOPY_PYTHON}" -I -c "import sys; from canopy.compiler.names import snake; print(snake(sys.argv[1]))"
            "${STEM}" OUTPUT_VARIABLE name OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
  set(${RESULT} "${name}" PARENT_SCOPE)
endfunction()
