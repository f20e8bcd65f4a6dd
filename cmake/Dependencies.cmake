# All third-party targets of the modules. Debian 12 and Ubuntu 24.04 package names are in
# scripts/install_dependencies.sh.
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(OpenCV 4.5 REQUIRED
             COMPONENTS core imgproc features2d calib3d video dnn
             OPTIONAL_COMPONENTS imgcodecs)  # for tests: with it come hundreds of libraries
if(NOT OpenCV_SHARED)  # the one of scripts/build_wheel_dependencies.sh
  find_package(Protobuf REQUIRED)
endif()
find_package(fmt REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(nlohmann_json REQUIRED)
find_library(STILLMAP_APRILTAG NAMES apriltag REQUIRED)
find_library(STILLMAP_DEFLATE NAMES deflate REQUIRED)  # Debian 12's has no CMake package yet
# Images
find_package(PNG REQUIRED)
find_package(JPEG REQUIRED)
find_package(TIFF REQUIRED)
find_package(OpenEXR 3 REQUIRED)
# Compression and databases of recordings
find_library(STILLMAP_BZ2 NAMES bz2 REQUIRED)
find_library(STILLMAP_LZ4 NAMES lz4 REQUIRED)
find_library(STILLMAP_ZSTD NAMES zstd REQUIRED)
find_library(STILLMAP_SQLITE3 NAMES sqlite3 REQUIRED)
find_package(realsense2 QUIET)  # without it there is no source realsense:
if(realsense2_FOUND)
  set(STILLMAP_REALSENSE realsense2::realsense2)
endif()
set(CMAKE_MESSAGE_LOG_LEVEL WARNING)  # Ceres would list every library that its solvers could use
find_package(Ceres 2.1 QUIET REQUIRED)
unset(CMAKE_MESSAGE_LOG_LEVEL)
find_package(octomap 1.9 REQUIRED)
find_package(meshoptimizer REQUIRED)
find_package(CLI11 REQUIRED)
if(STILLMAP_BUILD_TESTS)
  find_package(GTest REQUIRED)
endif()
if(STILLMAP_BUILD_BENCHMARKS)
  find_package(benchmark REQUIRED)
endif()

# OpenVINO, the fast back end for segmentation, is optional. Debian has no package; the wheel that
# scripts/install_dependencies.sh puts into build/venv carries headers, libraries and a CMake package, and
# its Python package returns their path. A given or cached OpenVINO_DIR is preferred.
set(STILLMAP_VENV "${PROJECT_SOURCE_DIR}/build/venv" CACHE PATH
    "Virtual environment in which the wheels of OpenVINO and ONNX Runtime are looked for")
if(STILLMAP_WITH_OPENVINO)
  if(CMAKE_CROSSCOMPILING)
    set(openvino_cmake_path /opt/openvino/cmake)  # in the root of scripts/make_arm64_root.sh
  elseif(NOT OpenVINO_DIR AND EXISTS "${STILLMAP_VENV}/bin/python")
    execute_process(
      COMMAND "${STILLMAP_VENV}/bin/python" -c
              "from openvino.utils import get_cmake_path; print(get_cmake_path())"
      OUTPUT_VARIABLE openvino_cmake_path OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  endif()
  find_package(OpenVINO QUIET COMPONENTS Runtime HINTS "${openvino_cmake_path}")
  # What reading ONNX networks and running them on the CPU, on Intel's GPUs (cache.json: tuned kernels) and
  # NPUs takes (on ARM: on the CPU); `make install` copies these.
  set(STILLMAP_OPENVINO_LIBRARIES libopenvino.so.* libopenvino_onnx_frontend.so.* libopenvino_intel_cpu_plugin.so
      libopenvino_arm_cpu_plugin.so libopenvino_intel_gpu_plugin.so cache.json libopenvino_intel_npu_plugin.so
      libtbb*.so* libhwloc.so*)
  if(OpenVINO_FOUND)
    message(STATUS "OpenVINO ${OpenVINO_VERSION}: ${OpenVINO_DIR}")
  else()
    message(STATUS "OpenVINO: not found, segmentation uses OpenCV's networks")
  endif()
endif()

# ONNX Runtime is opened at run time only. Programs in the build folder find the one in the virtual environment
# by these links.
if(NOT CMAKE_CROSSCOMPILING)
  file(GLOB onnxruntime_files "${STILLMAP_VENV}/lib/python3*/site-packages/onnxruntime/capi/libonnxruntime*.so*")
  foreach(file IN LISTS onnxruntime_files)
    cmake_path(GET file FILENAME name)
    string(REGEX REPLACE "^libonnxruntime[.]so.*" "libonnxruntime.so.1" name "${name}")
    file(CREATE_LINK "${file}" "${PROJECT_BINARY_DIR}/${name}" SYMBOLIC)
  endforeach()
endif()
