// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/calibrate_shutter.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/pipeline/prefetch.hpp"
#include "stillmap/pipeline/slam_system.hpp"

#include <utility>

namespace stillmap {
namespace {

/// Maximum number of times that the frames are tracked. Each halves the remaining error at least.
constexpr int kRounds = 5;

/// Tracks the frames until they show another timing than that of the parameters. Returns it, or
/// that of the parameters.
ShutterTiming next_timing(std::unique_ptr<FrameSource> source, const SlamParameters& parameters) {
  Prefetch frames(std::move(source));
  SlamSystem slam(frames.camera(), parameters, nullptr);
  while (const RgbdFramePtr frame = frames.next()) {
    slam.push(frame);
    if (slam.shutter() != parameters.tracker.shutter) break;
  }
  return slam.shutter();
}

}  // namespace

SlamParameters tracking_only(SlamParameters parameters) {
  parameters.dense_cloud = false;
  parameters.final_adjustment = false;
  parameters.mapper.remove_depth_error = false;
  parameters.smooth_trajectory = false;
  parameters.movers.enabled = false;
  parameters.schedule.realtime = false;
  return parameters;
}

ShutterTiming calibrate_shutter(const std::function<std::unique_ptr<FrameSource>()>& open,
                                const SlamParameters& parameters) {
  const TraceScope scope("shutter calibration");
  SlamParameters tracking = tracking_only(parameters);
  for (int round = 0; round < kRounds; ++round) {
    const ShutterTiming timing = next_timing(open(), tracking);
    if (timing == tracking.tracker.shutter) break;
    tracking.tracker.shutter = timing;
  }
  return tracking.tracker.shutter;
}

}  // namespace stillmap
