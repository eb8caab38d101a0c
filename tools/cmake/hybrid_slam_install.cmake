# SPDX-License-Identifier: Apache-2.0
# Everything that `cmake --install` puts in place. Each component has its own export file, so that a
# consumer of hybrid_slam::core needs no Ceres.
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/hybrid_slam)

get_property(targets GLOBAL PROPERTY HYBRID_SLAM_TARGETS)
foreach(target IN LISTS targets)
  get_target_property(component ${target} HYBRID_SLAM_COMPONENT)
  install(TARGETS ${target} EXPORT hybrid_slam_${component})
  list(APPEND components ${component})
endforeach()
list(REMOVE_DUPLICATES components)
foreach(component IN LISTS components)
  install(EXPORT hybrid_slam_${component} NAMESPACE hybrid_slam:: DESTINATION ${package_dir})
endforeach()

get_property(include_dirs GLOBAL PROPERTY HYBRID_SLAM_INCLUDE_DIRS)
foreach(dir IN LISTS include_dirs)
  install(DIRECTORY ${dir}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.hpp")
endforeach()

install(DIRECTORY ${PROJECT_SOURCE_DIR}/config DESTINATION ${CMAKE_INSTALL_DATADIR}/hybrid_slam)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})

if(TARGET hybrid-slam)
  file(RELATIVE_PATH lib_from_bin ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
  set_target_properties(hybrid-slam PROPERTIES INSTALL_RPATH "$ORIGIN/${lib_from_bin}")
  install(TARGETS hybrid-slam)
endif()

# A static library's PRIVATE dependencies are linked by the consumer, so he must find them as well.
if(BUILD_SHARED_LIBS)
  set(HYBRID_SLAM_SHARED ON)
else()
  set(HYBRID_SLAM_SHARED OFF)
endif()
if(TARGET hybrid_slam_fleet)
  set(HYBRID_SLAM_FLEET_BUILT ON)
else()
  set(HYBRID_SLAM_FLEET_BUILT OFF)
endif()
configure_package_config_file(
  ${CMAKE_CURRENT_LIST_DIR}/hybrid_slam-config.cmake.in
  ${PROJECT_BINARY_DIR}/hybrid_slam-config.cmake
  INSTALL_DESTINATION ${package_dir} PATH_VARS CMAKE_INSTALL_DATADIR
  NO_CHECK_REQUIRED_COMPONENTS_MACRO NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/hybrid_slam-config-version.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/hybrid_slam-config.cmake
              ${PROJECT_BINARY_DIR}/hybrid_slam-config-version.cmake
        DESTINATION ${package_dir})
