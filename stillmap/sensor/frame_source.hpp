// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// What a source left out, and why: one line per frame that could not be used.
struct SkippedFrame {
  double timestamp = 0;
  std::string reason;
};

/// Where frames come from. Pull style, one thread at a time.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// The ideal pinhole of the frames handed out (rectified: no distortion).
  virtual const Camera& camera() const = 0;
  /// The next usable frame; null at the end. A frame that cannot be used (missing, truncated, wrong
  /// size) is skipped and recorded, never thrown; stamps of the frames handed out increase
  /// strictly.
  virtual RgbdFramePtr next() = 0;
  /// Frames left at most, where known: for progress.
  virtual std::optional<std::size_t> size() const = 0;
  virtual const std::vector<SkippedFrame>& skipped() const = 0;
};

}  // namespace stillmap
