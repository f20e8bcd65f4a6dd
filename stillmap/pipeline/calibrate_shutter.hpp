// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/sensor/frame_source.hpp"

#include <functional>
#include <memory>

namespace stillmap {

/// Number of frames from which the timing of a recording's shutters is estimated.
inline constexpr int kShutterFrames = 40;

/// Estimates the timing of the shutters from the start of a recording. The frames are tracked with
/// the best timing known so far, from the first frame again whenever it changes, so that no pose
/// and no landmark bears the error of an earlier one. Deterministic.
/// @param open makes a source of the first kShutterFrames frames
/// Returns zero times if the frames show no other timing.
ShutterTiming calibrate_shutter(const std::function<std::unique_ptr<FrameSource>()>& open,
                                const SlamParameters& parameters);

/// Returns the parameters of a system that tracks and maps the camera's motion and nothing more.
SlamParameters tracking_only(SlamParameters parameters);

}  // namespace stillmap
