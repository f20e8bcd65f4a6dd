// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/depth_registration.hpp"

#include <benchmark/benchmark.h>

namespace stillmap {
namespace {

// A depth image of a size [pixels], registered to color images of a width [pixels] and its shape.
void register_depth(benchmark::State& state) {
  const int width = static_cast<int>(state.range(0)), height = static_cast<int>(state.range(1));
  const RecordedCamera depth{.width = width,
                             .height = height,
                             .fx = 0.75 * width,
                             .fy = 0.75 * width,
                             .cx = width / 2.0,
                             .cy = height / 2.0,
                             .lens = {}};
  Camera color;
  color.width = static_cast<int>(state.range(2));
  color.height = color.width * height / width;
  color.fx = color.fy = 500.0 * color.width / 640;
  color.cx = color.width / 2.0;
  color.cy = color.height / 2.0;
  const Pose T_color_depth(Eigen::Quaterniond(Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitY())),
                           Eigen::Vector3d(0.015, 0, 0));
  const DepthRegistration registration(depth, T_color_depth, color);
  cv::Mat1f image(height, width);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image(y, x) = (x / 40 + y / 40) % 7 == 0 ? 0.0F : 1 + x / 640.0F + y / 480.0F;
  for (auto _ : state) benchmark::DoNotOptimize(registration(image));
}
BENCHMARK(register_depth)
    ->Args({640, 480, 320})
    ->Args({640, 480, 640})
    ->Args({640, 480, 1280})
    ->Args({640, 480, 1920})
    ->Args({1280, 720, 640})
    ->Args({1280, 720, 1280})
    ->Args({1280, 720, 1920})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace stillmap
