# SPDX-License-Identifier: MIT
# cmake -DLIBRARY=libx.a -DNM=nm -P CheckFreestanding.cmake
#
# Fails when an object of the static library needs a symbol that neither the library nor the list below has, or when it
# has writable memory of its own; names every such object and symbol.
cmake_minimum_required(VERSION 3.25)

# C11 lets a freestanding compiler call these four, and every core Canopy is built for has them.
set(allowed_symbols memcpy memmove memset memcmp)
# The compiler's integer helpers: AEABI, libgcc's names for them, Thumb-1 switch tables, and what -fPIE and a
# distribution's default -fstack-protector add on a host.
set(allowed_pattern "^(__aeabi_(u?l?divmod|u?idiv|u?idivmod|uldivmod|ll?sl|llsr|lasr|lmul|u?lcmp|uread[48]|uwrite[48])\
|__aeabi_mem(cpy|move|set|clr)[48]?|__gnu_thumb1_case_[a-z]+\
|__u?(div|mod|divmod)[sdt]i[34]|__(mul|ashl|ashr|lshr)[dt]i3|__(clz|ctz|popcount|ffs|bswap)[sd]i2\
|_GLOBAL_OFFSET_TABLE_|__stack_chk_(fail|guard))$")

set(allocator "^_*(malloc|calloc|realloc|free|aligned_alloc|memalign|posix_memalign|strdup|strndup|sbrk|brk|mmap)\
(_r)?$")
set(stdio "^_*(i?v?[fsd]?n?i?printf.*|f?puts|f?putc|putchar|f?getc|getchar|fopen|fclose|fread|fwrite|fflush|\
[fs]?scanf|perror|stdout|stderr|stdin|impure_ptr|[a-z]*printf_chk)$")
set(floating_point "^(__aeabi_(c?[fd][a-z]+[0-9]*[a-z]*|u?[il]2[fd])|\
__(add|sub|mul|div|neg|eq|ne|lt|le|gt|ge|cmp|unord)[sdtx]f[23]|__(float|fix)[a-z]+|\
__(extend|trunc)[sdthx]f[sdthx]f2|__pow[sdtx]f2)$")

if(NOT LIBRARY OR NOT NM)
    message(FATAL_ERROR "Give -DLIBRARY= and -DNM=.")
endif()
execute_process(COMMAND "${NM}" -A -f sysv "${LIBRARY}"
    RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE errors)
if(NOT result EQUAL 0 OR NOT output)
    message(FATAL_ERROR "${NM} cannot read ${LIBRARY}: ${errors}")
endif()

# A line is "path/lib.a:object.o:symbol |value|class|type|size|line|section"; llvm-nm has a space before the symbol.
string(REPLACE ";" "" output "${output}")
string(REGEX REPLACE "[][]" " " output "${output}")
string(REGEX MATCHALL "[^\n]+" lines "${output}")
set(needed "")
set(defined "")
set(problems "")
foreach(line IN LISTS lines)
    if(NOT line MATCHES ":([^:|]+): *([^:| ]+) *\\|[^|]*\\| *([A-Za-z]) *\\|[^|]*\\|[^|]*\\|[^|]*\\|(.*)$")
        continue()
    endif()
    set(object "${CMAKE_MATCH_1}")
    set(symbol "${CMAKE_MATCH_2}")
    set(class "${CMAKE_MATCH_3}")
    set(section "${CMAKE_MATCH_4}")
    if(class MATCHES "^[Uvw]$")
        list(APPEND needed "${object}|${symbol}")
        continue()
    endif()
    list(APPEND defined "${symbol}")
    # .data.rel.ro is constant data with addresses in it, which position-independent code has to have relocated.
    if((class MATCHES "^[bBdDsSgGcC]$" AND NOT section MATCHES "^\\.data\\.rel\\.ro")
       OR section MATCHES "^\\.t?(data|bss)$")
        list(APPEND problems "${object}: ${symbol} is writable memory (${section}); the runtime owns none")
    endif()
endforeach()
if(NOT defined)
    message(FATAL_ERROR "No symbol was found in ${LIBRARY}: the library is empty, or ${NM} does not know `-f sysv`.")
endif()

foreach(entry IN LISTS needed)
    string(REPLACE "|" ";" entry "${entry}")
    list(GET entry 0 object)
    list(GET entry 1 symbol)
    if(symbol IN_LIST defined OR symbol IN_LIST allowed_symbols OR symbol MATCHES "${allowed_pattern}")
        continue()
    elseif(symbol MATCHES "${allocator}")
        set(what "an allocator")
    elseif(symbol MATCHES "${stdio}")
        set(what "stdio")
    elseif(symbol MATCHES "${floating_point}")
        set(what "a floating-point helper")
    else()
        set(what "a symbol from outside")
    endif()
    list(APPEND problems "${object}: needs ${symbol}, ${what}")
endforeach()

if(problems)
    list(JOIN problems "\n  " text)
    cmake_path(GET LIBRARY FILENAME name)
    # Not FATAL_ERROR's own text: CMake would re-wrap the lines.
    message("${name} is not freestanding:\n  ${text}")
    message(FATAL_ERROR "See cmake/CheckFreestanding.cmake for what is allowed, and why.")
endif()
