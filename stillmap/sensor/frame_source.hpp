// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/finding.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// An image, or a line of a list, that was skipped.
struct SkippedFrame {
  double timestamp = 0;  ///< Of the frame [s]; 0 for a line without a timestamp.
  std::string reason;
  /// False if only a depth image was skipped: its color image is a frame without depth.
  bool frame_lost = true;
  /// Whether the frame is readable, but was not taken in time from a live camera.
  bool late = false;
};

/// A source of frames (pull style). One thread at a time.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// Returns the ideal pinhole camera of the returned frames (rectified: no distortion).
  virtual const Camera& camera() const = 0;
  /// Returns the next usable frame; null at the end. An unusable image (missing, truncated, wrong
  /// size) is skipped and recorded, never thrown: without its color image the frame is lost,
  /// without its depth image the frame has depth 0 everywhere. Timestamps of returned frames
  /// increase strictly.
  virtual RgbdFramePtr next() = 0;
  /// Leaves out the frames before a time, except the last one, without reading their images; they
  /// keep their indices. A source that reads no faster that way leaves out none.
  virtual void skip_before(double /*timestamp*/) {}
  /// Returns the maximum number of remaining frames, if known, for progress output.
  virtual std::optional<std::size_t> size() const = 0;
  virtual const std::vector<SkippedFrame>& skipped() const = 0;
  /// Returns one sentence for the user for each choice and each assumption of the source.
  virtual std::vector<std::string> notes() const { return {}; }
  /// Returns what in the recording or the given camera looks wrong before a frame is read.
  virtual std::vector<Finding> findings() const { return {}; }
};

}  // namespace stillmap
