# SPDX-License-Identifier: Apache-2.0
include(GNUInstallDirs)

# Warnings, language level and sanitizers of everything that we build; none of it reaches a consumer.
function(hybrid_slam_target_options target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
                         -Woverloaded-virtual -Wconversion -Wno-sign-conversion
                         $<$<BOOL:${HYBRID_SLAM_WERROR}>:-Werror>)
  if(HYBRID_SLAM_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${HYBRID_SLAM_SANITIZE}
                           -fno-omit-frame-pointer -fno-sanitize-recover=all)
    target_link_options(${target} PRIVATE -fsanitize=${HYBRID_SLAM_SANITIZE})
  endif()
  if(HYBRID_SLAM_FUZZ)
    target_compile_options(${target} PRIVATE -fsanitize=fuzzer-no-link)
  endif()
endfunction()

# A component of the package is a folder of the root: core, frontend, backend or drivers; what is made in
# the root itself belongs to hybrid_slam, the component for all.
function(hybrid_slam_assign_component target name)
  file(RELATIVE_PATH folder ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  string(REGEX REPLACE "/.*" "" component "${folder}")
  if(component STREQUAL "")
    set(component hybrid_slam)
  endif()
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name} HYBRID_SLAM_COMPONENT ${component})
  set_property(GLOBAL APPEND PROPERTY HYBRID_SLAM_TARGETS ${target})
endfunction()

# hybrid_slam_library(NAME SOURCES a.cpp ... [PUBLIC target ...] [PRIVATE target ...])
# One module: target hybrid_slam_NAME, alias and export hybrid_slam::NAME, headers in
# include/hybrid_slam/NAME.
function(hybrid_slam_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  set(target hybrid_slam_${name})
  add_library(${target} ${ARG_SOURCES})
  add_library(hybrid_slam::${name} ALIAS ${target})
  target_compile_features(${target} PUBLIC cxx_std_17)
  target_include_directories(${target} PUBLIC
    $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(${target} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  # Before 1.0 a minor version may change the ABI, so it is part of the soname.
  set_target_properties(${target} PROPERTIES
    POSITION_INDEPENDENT_CODE ON
    INSTALL_RPATH "$ORIGIN"
    VERSION ${PROJECT_VERSION}
    SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  hybrid_slam_target_options(${target})
  hybrid_slam_assign_component(${target} ${name})
  set_property(GLOBAL APPEND PROPERTY HYBRID_SLAM_INCLUDE_DIRS ${CMAKE_CURRENT_SOURCE_DIR}/include)
endfunction()

# hybrid_slam_use_asio(NAME): Asio without Boost, in the same variant for all modules, since one program must
# not see two. Each io_context is of one thread; and fences are what the thread sanitizer cannot follow.
function(hybrid_slam_use_asio name)
  find_path(ASIO_INCLUDE_DIR asio.hpp REQUIRED DOC "Asio without Boost (libasio-dev)")
  mark_as_advanced(ASIO_INCLUDE_DIR)
  target_include_directories(hybrid_slam_${name} SYSTEM PRIVATE ${ASIO_INCLUDE_DIR})
  target_compile_definitions(hybrid_slam_${name} PRIVATE ASIO_STANDALONE ASIO_NO_DEPRECATED ASIO_DISABLE_FENCED_BLOCK)
endfunction()

# hybrid_slam_group(NAME target ...): one name for several modules, so that a component is one target.
function(hybrid_slam_group name)
  set(target hybrid_slam_${name})
  add_library(${target} INTERFACE)
  add_library(hybrid_slam::${name} ALIAS ${target})
  target_link_libraries(${target} INTERFACE ${ARGN})
  hybrid_slam_assign_component(${target} ${name})
endfunction()
