# SPDX-License-Identifier: MIT
# To be sourced: find_python sets `python` to PYTHON3, else to the first interpreter of 3.10 or later on the PATH; fails
# when there is none.
find_python() {
    for python in ${PYTHON3:+"$PYTHON3"} python3 python3.14 python3.13 python3.12 python3.11 python3.10; do
        if "$python" -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null; then
            return 0
        fi
    done
    return 1
}
