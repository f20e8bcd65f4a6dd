// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// A skipped frame and the reason: one line per unusable frame.
struct SkippedFrame {
  double timestamp = 0;
  std::string reason;
};

/// A source of frames (pull style). One thread at a time.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// Returns the ideal pinhole camera of the returned frames (rectified: no distortion).
  virtual const Camera& camera() const = 0;
  /// Returns the next usable frame; null at the end. An unusable frame (missing, truncated, wrong
  /// size) is skipped and recorded, never thrown; timestamps of returned frames increase strictly.
  virtual RgbdFramePtr next() = 0;
  /// Returns the maximum number of remaining frames, if known, for progress output.
  virtual std::optional<std::size_t> size() const = 0;
  virtual const std::vector<SkippedFrame>& skipped() const = 0;
};

}  // namespace stillmap
