# `cmake --install`: the command, libraries and headers of the modules, and a CMake package for
# find_package(Stillmap); modules are its targets: Stillmap::pipeline, Stillmap::evaluate, ...
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/Stillmap)

if(TARGET stillmap)
  set_target_properties(stillmap PROPERTIES INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}/stillmap")
  install(TARGETS stillmap)
endif()
install(TARGETS stillmap_options EXPORT StillmapTargets)
install(EXPORT StillmapTargets NAMESPACE Stillmap:: DESTINATION ${package_folder})

configure_package_config_file(cmake/StillmapConfig.cmake.in StillmapConfig.cmake
                              INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(StillmapConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/StillmapConfig.cmake"
              "${PROJECT_BINARY_DIR}/StillmapConfigVersion.cmake"
        DESTINATION ${package_folder})

# Builds and runs a project that uses the installed package. Not with sanitizers, since that
# project would have to be built with them too.
if(STILLMAP_BUILD_TESTS AND NOT STILLMAP_SANITIZE)
  set(prefix "${PROJECT_BINARY_DIR}/installed")
  add_test(NAME install COMMAND "${CMAKE_COMMAND}" --install "${PROJECT_BINARY_DIR}" --prefix "${prefix}")
  add_test(NAME installed_package
           COMMAND "${CMAKE_CTEST_COMMAND}"
                   --build-and-test "${PROJECT_SOURCE_DIR}/cmake/installed_package_test"
                                    "${PROJECT_BINARY_DIR}/installed_package_test"
                   --build-generator "${CMAKE_GENERATOR}"
                   --build-options "-DCMAKE_PREFIX_PATH=${prefix}" "-DCMAKE_BUILD_TYPE=${CMAKE_BUILD_TYPE}"
                   --test-command installed_package_test)
  set_tests_properties(install PROPERTIES FIXTURES_SETUP installed)
  set_tests_properties(installed_package PROPERTIES FIXTURES_REQUIRED installed)
endif()
