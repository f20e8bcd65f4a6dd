# Everything the rooms link to, found once. Debian 12 and Ubuntu 24.04 package names are in
# scripts/install_dependencies.sh.
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(OpenCV 4.5 REQUIRED
             COMPONENTS core imgproc imgcodecs features2d calib3d video dnn)
find_package(spdlog REQUIRED)
find_package(fmt REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(nlohmann_json REQUIRED)
if(STILLMAP_BUILD_TESTS)
  find_package(GTest REQUIRED)
endif()
if(STILLMAP_BUILD_BENCHMARKS)
  find_package(benchmark REQUIRED)
endif()
