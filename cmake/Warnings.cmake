# SPDX-License-Identifier: MIT
# The house warnings as one interface target. Link it PRIVATE: whoever uses the libraries keeps warnings of their own.
add_library(canopy_warnings INTERFACE)
target_compile_options(canopy_warnings INTERFACE
    -Wall -Wextra -Wconversion -Wsign-conversion -Wshadow -Wundef -Wswitch-enum -Wdouble-promotion -Wcast-align
    -Wmissing-prototypes -Wvla -Wtype-limits -Werror=overflow
    $<$<BOOL:${CANOPY_WERROR}>:-Werror>)
