# Language level, warnings, sanitizers and the compiler cache: all compiler options.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()

# A compiler cache accelerates rebuilds and new clones: paths are relative to the source folder, so build
# folders and clones share it. Precompiled headers need the sloppiness.
find_program(STILLMAP_CCACHE ccache)
if(STILLMAP_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER
      ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${PROJECT_SOURCE_DIR}
      CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
      ${STILLMAP_CCACHE})
endif()

# No -march=native anywhere: hot loops are dispatched at run time, so one binary serves every x86-64.
add_library(stillmap_options INTERFACE)
# GCC 12 reports false overflows of std::string (its bugs 105329 and 105651): two warnings are off.
set(warnings -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual -Wcast-qual
             -Wno-array-bounds $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict> $<$<BOOL:${STILLMAP_WARNINGS_AS_ERRORS}>:-Werror>)
target_compile_features(stillmap_options INTERFACE cxx_std_20)
target_compile_options(stillmap_options INTERFACE
  ${warnings} -fno-math-errno -fpch-preprocess
  # The garbage collector of GCC takes a tenth of the time of a source; this is more memory than most sources need [kB].
  $<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=524288>)
# Results are the same bytes on 64-bit ARM as on x86-64, whose base instruction set has no fused products and sums.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64")
  target_compile_options(stillmap_options INTERFACE -ffp-contract=off -U__ARM_FEATURE_FMA)
endif()
target_include_directories(stillmap_options INTERFACE "${PROJECT_SOURCE_DIR}")

set(STILLMAP_SANITIZE "" CACHE STRING "Sanitizers, as for -fsanitize= (address,undefined or thread)")
if(STILLMAP_SANITIZE)
  add_compile_options(-fsanitize=${STILLMAP_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  # Sanitizer instrumentation causes false warnings of GCC's flow analysis (its bug 105562): two are off.
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    add_compile_options(-Wno-stringop-overflow -Wno-maybe-uninitialized)
  endif()
  add_link_options(-fsanitize=${STILLMAP_SANITIZE})
endif()
