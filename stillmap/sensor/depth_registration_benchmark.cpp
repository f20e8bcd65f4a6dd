// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/depth_registration.hpp"

#include <benchmark/benchmark.h>

namespace stillmap {
namespace {

// A depth image of 640 x 480 pixels, registered to color images of a width [pixels].
void register_depth(benchmark::State& state) {
  const RecordedCamera depth{
      .width = 640, .height = 480, .fx = 480, .fy = 480, .cx = 320, .cy = 240, .lens = {}};
  Camera color;
  color.width = static_cast<int>(state.range(0));
  color.height = color.width * 3 / 4;
  color.fx = color.fy = 500.0 * color.width / 640;
  color.cx = color.width / 2.0;
  color.cy = color.height / 2.0;
  const Pose T_color_depth(Eigen::Quaterniond(Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitY())),
                           Eigen::Vector3d(0.015, 0, 0));
  const DepthRegistration registration(depth, T_color_depth, color);
  cv::Mat1f image(480, 640);
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 640; ++x)
      image(y, x) = (x / 40 + y / 40) % 7 == 0 ? 0.0F : 1 + x / 640.0F + y / 480.0F;
  for (auto _ : state) benchmark::DoNotOptimize(registration(image));
}
BENCHMARK(register_depth)->Arg(320)->Arg(640)->Arg(1280)->Arg(1920)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace stillmap
