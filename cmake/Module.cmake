# stillmap_module(NAME [DEPENDS module...] [LINK target...] [NO_PCH])
#
# Builds the library stillmap_NAME from the folder's *.cpp, its tests from *_test.cpp (one program,
# stillmap_NAME_test) and its micro benchmarks from *_benchmark.cpp (stillmap_NAME_benchmark).
# DEPENDS lists the modules that this one uses; LINK the third-party targets.
# TEST_DEPENDS lists modules used by tests only.
function(stillmap_module name)
  cmake_parse_arguments(MODULE "NO_PCH" "" "DEPENDS;LINK;TEST_DEPENDS;TEST_LINK" ${ARGN})
  set(target stillmap_${name})

  file(GLOB sources CONFIGURE_DEPENDS *.cpp *.hpp)
  file(GLOB tests CONFIGURE_DEPENDS *_test.cpp)
  file(GLOB benchmarks CONFIGURE_DEPENDS *_benchmark.cpp)
  if(tests OR benchmarks)
    list(REMOVE_ITEM sources ${tests} ${benchmarks})
  endif()

  add_library(${target} STATIC ${sources})
  set_target_properties(${target} PROPERTIES LINKER_LANGUAGE CXX)
  list(TRANSFORM MODULE_DEPENDS PREPEND stillmap_)
  list(TRANSFORM MODULE_TEST_DEPENDS PREPEND stillmap_)
  target_link_libraries(${target} PUBLIC stillmap_options ${MODULE_DEPENDS} ${MODULE_LINK}
                        Eigen3::Eigen ${OpenCV_LIBS} fmt::fmt Threads::Threads)
  target_include_directories(${target} SYSTEM PUBLIC ${OpenCV_INCLUDE_DIRS})
  stillmap_precompile(${target} ${MODULE_NO_PCH})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  install(TARGETS ${target} EXPORT StillmapTargets)
  install(DIRECTORY ./ DESTINATION include/stillmap/${name} FILES_MATCHING PATTERN *.hpp)

  if(STILLMAP_BUILD_TESTS AND tests)
    add_executable(${target}_test ${tests})
    target_link_libraries(${target}_test PRIVATE ${target} ${MODULE_TEST_DEPENDS} ${MODULE_TEST_LINK}
                          GTest::gmock GTest::gtest_main)
    stillmap_precompile(${target}_test ${MODULE_NO_PCH})
    gtest_discover_tests(${target}_test TEST_PREFIX "${name}." DISCOVERY_TIMEOUT 60
                         PROPERTIES LABELS ${name})
  endif()
  if(STILLMAP_BUILD_BENCHMARKS AND benchmarks)
    add_executable(${target}_benchmark ${benchmarks})
    target_link_libraries(${target}_benchmark PRIVATE ${target} ${MODULE_TEST_DEPENDS}
                          benchmark::benchmark benchmark::benchmark_main)
    stillmap_precompile(${target}_benchmark ${MODULE_NO_PCH})
  endif()
endfunction()

# One precompiled header for the whole project: Eigen, OpenCV's core and the standard containers are in
# nearly every file. Module base owns it; modules with their own compiler flags opt out.
function(stillmap_precompile target no_pch)
  if(no_pch)
    return()
  endif()
  if(target STREQUAL stillmap_base)
    target_precompile_headers(${target} PRIVATE
      <algorithm> <array> <cmath> <cstdint> <filesystem> <functional> <map> <memory> <optional>
      <span> <string> <string_view> <unordered_map> <utility> <vector>
      <Eigen/Core> <Eigen/Dense> <Eigen/Geometry> <opencv2/core.hpp> <fmt/format.h>)
  else()
    # CMake compiles programs with -fPIE, libraries with -fPIC; one precompiled header needs one of them.
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE OFF)
    target_compile_options(${target} PRIVATE -fPIC)
    target_precompile_headers(${target} REUSE_FROM stillmap_base)
  endif()
endfunction()
