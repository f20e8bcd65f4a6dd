// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/dead_leaves.hpp"
#include "stillmap/feature/matching.hpp"
#include "stillmap/feature/orb_extractor.hpp"

#include <benchmark/benchmark.h>
#include <opencv2/features2d.hpp>

namespace stillmap {
namespace {

/// Discs and rectangles with half the contrast and camera noise: about as many corners as a
/// furnished room.
cv::Mat textured_image() {
  cv::Mat image = dead_leaves({640, 480}, 1);
  TestRandom random(2);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      std::uint8_t& pixel = image.at<std::uint8_t>(y, x);
      pixel = cv::saturate_cast<std::uint8_t>(64 + pixel / 2 + random.uniform(-3, 3));
    }
  }
  return image;
}

void run_extractor(benchmark::State& state, CpuPath path) {
  cv::setNumThreads(1);
  const cv::Mat image = textured_image(), depth(image.size(), CV_32FC1, cv::Scalar(2));
  OrbExtractor extractor({}, path);
  std::size_t keypoints = 0;
  for (auto _ : state) keypoints = extractor.extract(image, depth).size();
  state.counters["keypoints"] = static_cast<double>(keypoints);
}
BENCHMARK_CAPTURE(run_extractor, stillmap_best, best_cpu_path())->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run_extractor, stillmap_portable, CpuPath::kPortable)
    ->Unit(benchmark::kMillisecond);

void run_opencv_orb(benchmark::State& state) {
  cv::setNumThreads(1);
  const cv::Mat image = textured_image();
  const auto orb = cv::ORB::create(1000, 1.2F, 8, 31, 0, 2, cv::ORB::HARRIS_SCORE, 31, 20);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  for (auto _ : state) orb->detectAndCompute(image, cv::noArray(), keypoints, descriptors);
  state.counters["keypoints"] = static_cast<double>(keypoints.size());
}
BENCHMARK(run_opencv_orb)->Unit(benchmark::kMillisecond);

void run_brute_force(benchmark::State& state, CpuPath path) {
  const Features features = OrbExtractor().extract(textured_image());
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        match_brute_force(features.descriptors, features.descriptors, {}, path));
  }
}
BENCHMARK_CAPTURE(run_brute_force, best, best_cpu_path())->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run_brute_force, portable, CpuPath::kPortable)->Unit(benchmark::kMillisecond);

void run_opencv_brute_force(benchmark::State& state) {
  cv::setNumThreads(1);
  const Features features = OrbExtractor().extract(textured_image());
  const cv::Mat descriptors(static_cast<int>(features.size()), 32, CV_8UC1,
                            const_cast<Descriptor*>(features.descriptors.data()));
  const cv::BFMatcher matcher(cv::NORM_HAMMING);
  std::vector<std::vector<cv::DMatch>> matches;
  for (auto _ : state) matcher.knnMatch(descriptors, descriptors, matches, 2);
}
BENCHMARK(run_opencv_brute_force)->Unit(benchmark::kMillisecond);

void run_projection(benchmark::State& state) {
  const Features features = OrbExtractor().extract(textured_image());
  std::vector<ProjectionQuery> queries;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Keypoint& k = features.keypoints[i];
    queries.push_back({.u = k.u + 3,
                       .v = k.v - 2,
                       .radius = 15 * static_cast<float>(std::pow(1.2, k.level)),
                       .min_level = k.level - 1,
                       .max_level = k.level + 1,
                       .descriptor = features.descriptors[i],
                       .angle = k.angle});
  }
  const ProjectionMatchOptions options{.ratio = 0.8, .check_rotation = true};
  for (auto _ : state) benchmark::DoNotOptimize(match_by_projection(queries, features, options));
}
BENCHMARK(run_projection)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace stillmap
