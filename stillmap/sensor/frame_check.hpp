// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/sensor/depth_evidence.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace stillmap {

/// Returns the likely unit of timestamps with this median interval; empty for seconds.
std::string unit_of_timestamps(double interval);

/// Returns the sentence that the steps between raw depths contradict the depth factor of the
/// camera; empty if they do not.
/// @param of_steps  depth factor as of depth_factor_of_steps()
std::string depth_factor_problem(double of_steps, double factor);

/// Collects what the frames of a source show together about errors of their timestamps and depths.
/// Such frames are mapped without an error, and the result is wrong: of another scale or speed, or
/// of landmarks alone.
class FrameCheck {
 public:
  /// @param camera  as of FrameSource::camera()
  explicit FrameCheck(const Camera& camera);

  /// Adds the next frame. Takes some microseconds, and some milliseconds for 40 frames that are
  /// examined closely: the first of every 3 frames, and after twenty of them of every 30.
  void add(const RgbdFrame& frame);

  /// Returns the problems found, each as one sentence with its fix; empty without any.
  std::vector<std::string> problems() const;

 private:
  /// Frames in a row, and the time of the first [s].
  struct Gap {
    std::size_t frames = 0;
    double begin = 0;
    void add(double time, Gap& longest);
  };
  void examine(const RgbdFrame& frame);
  std::string time_problem() const;
  std::string gap_problem() const;
  std::string frozen_problem() const;
  bool is_long(const Gap& gap) const;
  void compare_with_last(const RgbdFrame& frame);

  Camera camera_;
  std::size_t frames_ = 0, with_depth_ = 0, examined_ = 0, next_examined_ = 0;
  std::size_t flat_ = 0;           // of the examined frames: those with one depth everywhere
  cv::Mat1f last_depth_;           // every 16th pixel of the last frame
  cv::Mat1b last_gray_;            // likewise
  std::vector<double> intervals_;  // [s]
  double last_ = 0;                // time of the last frame [s]
  std::vector<bool> seen_;         // by raw depth
  RegistrationEvidence registration_;
  Gap gap_, longest_;
  Gap frozen_, longest_frozen_;  // frames in a row whose depth repeats, unlike their color
};

}  // namespace stillmap
