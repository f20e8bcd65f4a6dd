// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/finding.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/sensor/frame_source.hpp"

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

enum class CalibrationVerdict {
  kKept,           ///< The recording agrees with the given value.
  kCorrected,      ///< The given value is wrong, and the estimate is certain.
  kNotObservable,  ///< The recording shows too little of the parameter.
};

/// One parameter of a camera file, as a recording shows it.
struct CalibratedParameter {
  std::string key;  ///< Key in the camera file.
  double given = 0, estimated = 0;
  double sigma = 0;  ///< Standard deviation of the estimate.
  CalibrationVerdict verdict = CalibrationVerdict::kNotObservable;
};

struct CalibrationReport {
  Camera camera;  ///< The recording's camera with the corrected values.
  /// fx, fy, cx, cy [pixels], disparity_offset, disparity_bow [1/m], readout, depth_delay [s].
  std::vector<CalibratedParameter> parameters;
  std::size_t frames = 0;        ///< Number of frames of the last pass with a pose.
  std::size_t observations = 0;  ///< Number of observations of landmarks that were adjusted.
  /// Estimate of fx that was too far from the given value to be used [pixels]; none without one.
  std::optional<double> discarded_focal_length;
  std::optional<Finding> carried_parts;  ///< If there is this finding, the estimates are invalid.
};

/// Estimates a camera's parameters from a recording made with it. The frames are tracked and mapped
/// with the best values known so far, from the first frame again after each correction: first until
/// the timing of the shutters does not change, then until intrinsics and depth do not.
/// Deterministic. A uniform scale of the depth cannot be observed
/// (optimize/camera_calibration.hpp). Where the camera tells the timing of its shutters, it is not
/// estimated.
/// @param open     makes the source of the recording's frames for a camera of the recorded images
/// @param recorded the camera to start with
CalibrationReport calibrate_recording(
    const std::function<std::unique_ptr<FrameSource>(const Camera& recorded)>& open,
    const Camera& recorded, const SlamParameters& parameters);

/// Returns whether the recording shows the focal lengths of the camera.
bool shows_focal_length(const CalibrationReport& report);

/// Returns whether a focal length or the principal point is certainly wrong, see
/// is_wrong_intrinsic(): maps made with this camera are distorted.
bool shows_wrong_intrinsics(const CalibrationReport& report);

/// Returns sentences about the certain errors of the camera for a user, such as "depth reads 3 %
/// short at 4 m". Empty if there are none.
std::vector<std::string> calibration_findings(const CalibrationReport& report);

}  // namespace stillmap
