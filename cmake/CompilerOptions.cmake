# Language level, warnings, sanitizers and the compiler cache: everything that goes to the compiler.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()

# A compiler cache makes rebuilds and clean clones cheap; the sloppiness is what precompiled headers need.
find_program(STILLMAP_CCACHE ccache)
if(STILLMAP_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER
      ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
      ${STILLMAP_CCACHE})
endif()

# No -march=native anywhere: hot loops are dispatched at run time, so one binary serves every x86-64.
add_library(stillmap_options INTERFACE)
target_compile_options(stillmap_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual -Wcast-qual
  $<$<BOOL:${STILLMAP_WARNINGS_AS_ERRORS}>:-Werror>
  -fno-math-errno -fpch-preprocess)
target_include_directories(stillmap_options INTERFACE ${PROJECT_SOURCE_DIR})

set(STILLMAP_SANITIZE "" CACHE STRING "Sanitizers, as for -fsanitize= (address,undefined or thread)")
if(STILLMAP_SANITIZE)
  add_compile_options(-fsanitize=${STILLMAP_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${STILLMAP_SANITIZE})
endif()
