// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/finding.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/sensor/depth_evidence.hpp"
#include "stillmap/sensor/frame_source.hpp"

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// Returns the likely unit of timestamps with this median interval; empty for seconds.
std::string unit_of_timestamps(double interval);

/// Returns the finding that the steps between raw depths contradict the depth factor of the camera;
/// none if they do not.
/// @param of_steps  depth factor as of depth_factor_of_steps()
std::optional<Finding> depth_factor_finding(double of_steps, double factor);

/// Returns whether a gap of this many frames in a row is worth a warning: half a second of a usual
/// camera or more, and a tenth of all frames or more.
bool is_long_gap(std::size_t frames, std::size_t all);

/// Returns whether so many frames are unusable that the rest may not be what was recorded: more
/// than a fifth, such as after a clock was set back or the image size changed.
bool are_many_unusable(std::size_t unusable, std::size_t all);
/// The same for the lost frames of a list. Those before the first usable one, at `begin` [s], do
/// not count if they are too few for is_long_gap(): the map begins after them.
bool are_many_unusable(const std::vector<SkippedFrame>& skipped, double begin, std::size_t all);

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

  /// Returns the findings.
  std::vector<Finding> findings() const;

 private:
  /// Frames in a row, and the time of the first [s].
  struct Gap {
    std::size_t frames = 0;
    double begin = 0;
    void add(double time, Gap& longest);
  };
  static std::map<std::string, double> evidence_of(const Gap& gap);
  /// Every 16th pixel of both images of a frame, in both directions.
  struct Coarse {
    cv::Mat1f depth;
    cv::Mat1b gray;
  };
  void examine(const RgbdFrame& frame);
  void compare_with_last(double time, const Coarse& coarse);
  void compare_with_last_two(const Coarse& coarse);
  std::optional<Finding> depth_finding() const;
  std::optional<Finding> frozen_finding() const;
  std::optional<Finding> repeats_finding() const;
  std::optional<Finding> alternation_finding() const;
  std::optional<Finding> time_finding() const;
  std::optional<Finding> steps_finding() const;
  std::optional<Finding> coarse_finding() const;

  Camera camera_;
  std::size_t frames_ = 0, with_depth_ = 0, examined_ = 0, next_examined_ = 0;
  std::size_t flat_ = 0;  // of the examined frames: those with one depth everywhere
  Coarse last_coarse_, last_but_one_;
  std::vector<double> intervals_;  // [s]
  double last_ = 0;                // time of the last frame [s]
  std::vector<bool> seen_;         // by raw depth
  ByteOrderEvidence byte_order_;
  RegistrationEvidence registration_;
  Gap gap_, longest_;
  Gap frozen_, longest_frozen_;    // frames in a row whose depth repeats, unlike their color
  Gap stopped_, longest_stopped_;  // frames in a row whose color repeats
  std::size_t repeats_ = 0, repeated_ = 0;  // frames whose color repeats; images that they repeat
  bool repeats_last_ = false;               // the last frame is one of them
  std::size_t alternating_ = 0;  // frames that resemble the last but one, and not the last
};

}  // namespace stillmap
