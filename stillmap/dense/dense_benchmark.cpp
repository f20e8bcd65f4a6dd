// SPDX-License-Identifier: Apache-2.0
// Addition of one keyframe of 640 x 480 pixels to the dense map, whole and in parts, on one thread.
#include "stillmap/dense/dense_map.hpp"

#include <memory>

#include <benchmark/benchmark.h>
#include <opencv2/core/utility.hpp>

namespace stillmap {
namespace {

// Returns a wavy wall with a box in front, 5 mm of noise, and a mask over a quarter of the width.
RgbdFrame wall_and_box() {
  RgbdFrame frame;
  frame.color = cv::Mat(480, 640, CV_8UC3);
  cv::Mat1f depth(480, 640);
  cv::RNG random(1);
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      const bool box = u > 350 && u < 500 && v > 200 && v < 400;
      const double wall = 2.2 + 0.3 * std::sin(0.02 * u) + 0.001 * v;
      depth(v, u) = static_cast<float>((box ? 1.2 : wall) + random.gaussian(0.005));
      frame.color.at<cv::Vec3b>(v, u) = cv::Vec3b(static_cast<uchar>(u), static_cast<uchar>(v), 90);
    }
  }
  frame.depth = depth;
  return frame;
}

cv::Mat1b mask_of_a_person() {
  cv::Mat1b mask(480, 640, uchar{0});
  mask(cv::Rect(100, 60, 160, 420)).setTo(255);
  return mask;
}

const Camera kCamera{.name = "benchmark", .fx = 528, .fy = 528, .cx = 321, .cy = 239.5};

void BM_KeyframeAdded(benchmark::State& state) {
  cv::setNumThreads(1);
  const RgbdFrame frame = wall_and_box();
  const cv::Mat1b mask = mask_of_a_person();
  DenseOptions options;
  options.back_projection.stride = static_cast<int>(state.range(0));
  DenseMap map(kCamera, options);
  for (auto _ : state) map.add(0, frame, mask);
  state.counters["pixels"] = static_cast<double>(map.statistics().pixels);
}
BENCHMARK(BM_KeyframeAdded)->ArgName("stride")->DenseRange(1, 4)->Unit(benchmark::kMillisecond);

void BM_BackProject(benchmark::State& state) {
  cv::setNumThreads(1);
  const RgbdFrame frame = wall_and_box();
  const cv::Mat1b mask = mask_of_a_person();
  for (auto _ : state) benchmark::DoNotOptimize(back_project(kCamera, frame, mask));
}
BENCHMARK(BM_BackProject)->Unit(benchmark::kMillisecond);

void BM_RemoveOutliers(benchmark::State& state) {
  const PointGrid grid = back_project(kCamera, wall_and_box(), mask_of_a_person());
  for (auto _ : state) {
    PointGrid copy{.points = grid.points.clone(), .stride = grid.stride};
    benchmark::DoNotOptimize(remove_outliers(copy));
  }
}
BENCHMARK(BM_RemoveOutliers)->Unit(benchmark::kMillisecond);

// Addition of one more keyframe, which overlaps the others by nine tenths, to the live map.
void BM_LiveMapGrown(benchmark::State& state) {
  const RgbdFrame frame = wall_and_box();
  const auto keyframes = static_cast<std::uint64_t>(state.range(0));
  const auto sideways = [](std::uint64_t id) {
    return Pose(Eigen::Quaterniond::Identity(), {0.1 * static_cast<double>(id), 0, 0});
  };
  for (auto _ : state) {
    state.PauseTiming();
    auto map = std::make_unique<DenseMap>(kCamera);
    for (std::uint64_t id = 0; id < keyframes; ++id) map->add(id, frame, {}, sideways(id));
    state.ResumeTiming();
    map->add(keyframes, frame, {}, sideways(keyframes));
    state.PauseTiming();
    map.reset();
    state.ResumeTiming();
  }
}
BENCHMARK(BM_LiveMapGrown)
    ->ArgName("keyframes")
    ->Arg(1)
    ->Arg(20)
    ->Arg(100)
    ->Iterations(3)
    ->Unit(benchmark::kMillisecond);

void BM_ComposeTwentyKeyframes(benchmark::State& state) {
  const RgbdFrame frame = wall_and_box();
  DenseMap map(kCamera);
  for (std::uint64_t id = 0; id < 20; ++id) map.add(id, frame, {});
  const auto sideways = [](std::uint64_t id) {
    return Pose(Eigen::Quaterniond::Identity(), {0.1 * static_cast<double>(id), 0, 0});
  };
  for (auto _ : state) {
    benchmark::DoNotOptimize(cloud_of(map.place(sideways)));
  }
}
BENCHMARK(BM_ComposeTwentyKeyframes)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace stillmap
