# SPDX-License-Identifier: MIT
# `cmake --install`: headers, libraries, and the package Canopy for find_package(), with canopy_add_application() and
# canopy_add_codec(). One prefix for each toolchain: the libraries are compiled for it.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

get_property(drivers GLOBAL PROPERTY CANOPY_DRIVERS)
set(package "${CMAKE_INSTALL_LIBDIR}/cmake/Canopy")

install(TARGETS canopy_runtime canopy_drivers ${drivers} EXPORT CanopyTargets INCLUDES DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
install(EXPORT CanopyTargets DESTINATION "${package}")
set(elsewhere "")
if(NOT CMAKE_SYSTEM_NAME STREQUAL "Linux")
    set(elsewhere REGEX "(socketcan|unixbus|open|posix|replay_files)\\.h$" EXCLUDE)
endif()
install(DIRECTORY runtime/include/canopy drivers/include/canopy DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" ${elsewhere})
install(FILES LICENSE DESTINATION "${CMAKE_INSTALL_DOCDIR}")

configure_package_config_file(cmake/CanopyConfig.cmake.in "${CMAKE_CURRENT_BINARY_DIR}/CanopyConfig.cmake"
                              INSTALL_DESTINATION "${package}" PATH_VARS CMAKE_INSTALL_INCLUDEDIR)
write_basic_package_version_file("${CMAKE_CURRENT_BINARY_DIR}/CanopyConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/CanopyConfig.cmake" "${CMAKE_CURRENT_BINARY_DIR}/CanopyConfigVersion.cmake"
              cmake/CanopyApplication.cmake cmake/CanopyCodec.cmake cmake/Python.cmake
        DESTINATION "${package}")
