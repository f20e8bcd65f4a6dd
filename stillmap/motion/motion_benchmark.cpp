// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/dead_leaves.hpp"
#include "stillmap/feature/orb_extractor.hpp"
#include "stillmap/motion/motion_estimator.hpp"
#include "stillmap/motion/test_frames.hpp"

#include <benchmark/benchmark.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Returns a frame of a large texture under a moving camera, 6 pixels a frame with a rotation and a
/// zoom. The texture is shown at two speeds, so that no homography or fundamental matrix fits all.
RgbdFramePtr frame_at(std::size_t index) {
  static const cv::Mat world = dead_leaves({900, 700}, 1);
  const auto t = static_cast<double>(index);
  cv::Mat view = cv::getRotationMatrix2D({450, 350}, 0.3 * t, 1 + 0.002 * t);
  view.at<double>(0, 2) -= 120 - 6 * t;
  view.at<double>(1, 2) -= 100 - 2 * t;
  auto frame = std::make_shared<RgbdFrame>();
  frame->index = index;
  cv::warpAffine(world, frame->gray, view, {640, 480});
  cv::Mat near;
  view.at<double>(0, 2) += 4 * t;
  cv::warpAffine(world, near, view, {640, 480});
  near(cv::Rect(160, 120, 240, 360)).copyTo(frame->gray(cv::Rect(160, 120, 240, 360)));
  frame->depth = cv::Mat(480, 640, CV_32FC1, cv::Scalar(2));
  return frame;
}

std::vector<FramePtr> make_frames(std::size_t count) {
  OrbExtractor extractor;
  std::vector<FramePtr> frames;
  for (std::size_t i = 0; i < count; ++i) {
    auto frame = std::make_shared<Frame>();
    frame->image = frame_at(i);
    frame->features =
        std::make_shared<Features>(extractor.extract(frame->image->gray, frame->image->depth));
    frame->instances = test::segmented({test::box_of("person", {160, 120, 240, 360})});
    frames.push_back(frame);
  }
  return frames;
}

/// Motion estimation of consecutive frames as in a run, where each image's pyramid is built once.
void run_cue(benchmark::State& state, const char* cue) {
  cv::setNumThreads(1);
  const auto frames = make_frames(8);
  MotionOptions options;
  options.cues = {cue};
  MotionEstimator estimator(options);
  FramePtr previous;
  std::size_t i = 0, step = 1, dropped = 0;
  for (auto _ : state) {
    const FramePtr& frame = frames[i];
    const auto evidence = estimator.estimate(
        test::input_of(frame->image, frame->features, frame->instances, previous));
    dropped =
        static_cast<std::size_t>(std::count(evidence.weight.begin(), evidence.weight.end(), 0.0F));
    previous = frame;
    if (i + step >= frames.size()) step = static_cast<std::size_t>(-1);  // back and forth
    if (i == 0) step = 1;
    i += step;
  }
  state.counters["keypoints"] = static_cast<double>(frames[0]->features->size());
  state.counters["dropped"] = static_cast<double>(dropped);
}
BENCHMARK_CAPTURE(run_cue, semantic, "semantic")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run_cue, box_flow, "box-flow")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run_cue, gated_semantic, "gated-semantic")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run_cue, epipolar, "epipolar")->Unit(benchmark::kMillisecond);

/// Optical flow alone, both pyramids included.
void run_flow(benchmark::State& state) {
  cv::setNumThreads(1);
  const auto frames = make_frames(2);
  KeypointFlow flow;
  for (auto _ : state) {
    FlowTracker tracker(static_cast<int>(state.range(0)));
    flow = tracker.to_previous(
        test::input_of(frames[1]->image, frames[1]->features, nullptr, frames[0]));
  }
  state.counters["found"] =
      static_cast<double>(std::count(flow.found.begin(), flow.found.end(), 1));
}
BENCHMARK(run_flow)->ArgName("window")->Arg(5)->Arg(9)->Arg(13)->Unit(benchmark::kMillisecond);

PointPairs pairs_of(const std::vector<FramePtr>& frames) {
  FlowTracker tracker(5);
  const KeypointFlow flow = tracker.to_previous(
      test::input_of(frames[1]->image, frames[1]->features, nullptr, frames[0]));
  PointPairs pairs;
  for (std::size_t i = 0; i < flow.size(); ++i) {
    if (flow.found[i] != 0) pairs.add(flow.before[i], flow.now[i]);
  }
  return pairs;
}

void run_homography(benchmark::State& state) {
  const PointPairs pairs = pairs_of(make_frames(2));
  for (auto _ : state) benchmark::DoNotOptimize(find_homography(pairs, 3));
}
BENCHMARK(run_homography)->Unit(benchmark::kMillisecond);

void run_fundamental(benchmark::State& state) {
  const PointPairs pairs = pairs_of(make_frames(2));
  for (auto _ : state) benchmark::DoNotOptimize(find_fundamental(pairs, 1));
}
BENCHMARK(run_fundamental)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace stillmap
