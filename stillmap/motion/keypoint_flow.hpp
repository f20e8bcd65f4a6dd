// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/motion_cue.hpp"

#include <cstdint>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Matched points of the previous frame and this frame [pixels of the full image].
struct KeypointFlow {
  std::vector<cv::Point2f> before, now;  ///< One per tracked keypoint.
  std::vector<std::uint8_t> found;       ///< 1 if the other end was found inside the image.

  std::size_t size() const { return found.size(); }
  /// Returns the movement from the previous frame to this one [pixels].
  cv::Point2f flow(std::size_t i) const { return now[i] - before[i]; }
};

/// Optical flow between the previous frame and this one by sparse pyramidal Lucas-Kanade (Bouguet,
/// Pyramidal implementation of the affine Lucas Kanade feature tracker, Intel 2001). The results
/// depend on the two frames alone, and not on OpenCV's number of threads; the newest pyramids are
/// kept, so that each image's is built once. One thread at a time.
class FlowTracker {
 public:
  /// @param window side of the compared square [pixels of each level]
  explicit FlowTracker(int window) : window_(window) {}

  /// Tracks every keypoint of this frame back to the previous one: one entry per keypoint of
  /// input.features, which is `now`. All are lost without a previous frame.
  KeypointFlow to_previous(const MotionInput& input);
  /// Tracks every keypoint of the previous frame to this one: one entry per keypoint of
  /// input.previous->features, which is `before`. Empty without a previous frame.
  KeypointFlow from_previous(const MotionInput& input);

 private:
  struct Pyramid {
    RgbdFramePtr image;
    std::vector<cv::Mat> levels;
  };
  using PyramidPtr = std::shared_ptr<const Pyramid>;
  struct Tracked {
    std::vector<cv::Point2f> points;
    std::vector<std::uint8_t> found;
  };
  PyramidPtr pyramid_of(const RgbdFramePtr& image);
  Tracked track(const RgbdFramePtr& from, const RgbdFramePtr& to,
                const std::vector<cv::Point2f>& points);

  int window_;
  PyramidPtr newest_, second_;  // of the last two images
};

}  // namespace stillmap
