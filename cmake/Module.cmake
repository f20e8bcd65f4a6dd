# stillmap_module(NAME [DEPENDS module...] [LINK target...] [TEST_DEPENDS module...] [TEST_LINK target...])
#
# Builds the library stillmap_NAME from the folder's *.cpp, its tests from *_test.cpp (one program,
# stillmap_NAME_test) and its micro benchmarks from *_benchmark.cpp (stillmap_NAME_benchmark).
# DEPENDS lists the modules that this one uses; LINK the third-party targets.
# TEST_DEPENDS and TEST_LINK list those that only tests and benchmarks use.
function(stillmap_module name)
  cmake_parse_arguments(MODULE "" "" "DEPENDS;LINK;TEST_DEPENDS;TEST_LINK" ${ARGN})
  set(target stillmap_${name})

  file(GLOB sources CONFIGURE_DEPENDS *.cpp *.hpp)
  file(GLOB tests CONFIGURE_DEPENDS *_test.cpp)
  file(GLOB benchmarks CONFIGURE_DEPENDS *_benchmark.cpp)
  if(tests OR benchmarks)
    list(REMOVE_ITEM sources ${tests} ${benchmarks})
  endif()

  add_library(${target} STATIC ${sources})
  list(TRANSFORM MODULE_DEPENDS PREPEND stillmap_)
  list(TRANSFORM MODULE_TEST_DEPENDS PREPEND stillmap_)
  target_link_libraries(${target} PUBLIC stillmap_options ${MODULE_DEPENDS} ${MODULE_LINK})
  stillmap_precompile(${target})
  # The installed library is made of all modules (Install.cmake).
  set_property(GLOBAL APPEND PROPERTY STILLMAP_MODULES ${target})
  set_property(GLOBAL APPEND PROPERTY STILLMAP_MODULE_LIBRARIES ${MODULE_LINK})

  if(STILLMAP_BUILD_TESTS AND tests)
    add_executable(${target}_test ${tests})
    target_link_libraries(${target}_test PRIVATE ${target} ${MODULE_TEST_DEPENDS} ${MODULE_TEST_LINK}
                          GTest::gmock GTest::gtest_main)
    stillmap_precompile(${target}_test)
    gtest_discover_tests(${target}_test TEST_PREFIX "${name}." DISCOVERY_TIMEOUT 60
                         PROPERTIES LABELS ${name})
  endif()
  if(STILLMAP_BUILD_BENCHMARKS AND benchmarks)
    add_executable(${target}_benchmark ${benchmarks})
    target_link_libraries(${target}_benchmark PRIVATE ${target} ${MODULE_TEST_DEPENDS} ${MODULE_TEST_LINK}
                          benchmark::benchmark benchmark::benchmark_main)
    stillmap_precompile(${target}_benchmark)
  endif()
endfunction()

# One precompiled header for the whole project: Eigen, OpenCV's core and the standard containers are in
# nearly every file. The module base owns it, and links neither Eigen nor OpenCV: it only sees their headers.
function(stillmap_precompile target)
  target_include_directories(${target} SYSTEM PRIVATE ${OpenCV_INCLUDE_DIRS}
    $<TARGET_PROPERTY:Eigen3::Eigen,INTERFACE_INCLUDE_DIRECTORIES>)
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
