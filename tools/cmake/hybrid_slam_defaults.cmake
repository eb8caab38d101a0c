# SPDX-License-Identifier: Apache-2.0
# What only the top-level project may decide; as a subproject we take what the parent has chosen.
get_property(multi_config GLOBAL PROPERTY GENERATOR_IS_MULTI_CONFIG)
if(NOT CMAKE_BUILD_TYPE AND NOT multi_config)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Debug, Release, RelWithDebInfo or MinSizeRel" FORCE)
endif()

set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_CXX_EXTENSIONS OFF)

find_program(HYBRID_SLAM_CCACHE ccache DOC "Compiler cache, used when found")
mark_as_advanced(HYBRID_SLAM_CCACHE)
if(HYBRID_SLAM_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # Tests have precompiled headers, which ccache takes only when it is told to.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros
                                  ${HYBRID_SLAM_CCACHE})
endif()
