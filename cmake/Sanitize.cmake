# SPDX-License-Identifier: MIT
# CANOPY_SANITIZE: the address and undefined-behaviour sanitizers in everything built here, so that no part is missed.
if(CANOPY_SANITIZE)
    add_compile_options(-fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
    add_link_options(-fsanitize=address,undefined)
endif()
