// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/motion_cue.hpp"

#include <cstdint>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Sparse pyramidal Lucas-Kanade (Bouguet, Pyramidal implementation of the affine Lucas Kanade
/// feature tracker, Intel 2001).
struct FlowOptions {
  int window = 5;         ///< side of the square that is compared [pixels of each level]
  int levels = 3;         ///< of the pyramid above the full image; each halves the size
  int iterations = 5;     ///< at most, per level: more finds no more
  double check_back = 0;  ///< a point that does not come back to within this is lost; 0: no check
                          ///< [pixels]
};

/// Where points of the frame before and of this frame belong together. Pixels of the full image.
struct KeypointFlow {
  std::vector<cv::Point2f> before, now;  ///< one per keypoint that was followed
  std::vector<std::uint8_t> found;       ///< 1 where the other end was found inside the image

  std::size_t size() const { return found.size(); }
  /// Movement from the frame before to this one. Pixels.
  cv::Point2f flow(std::size_t i) const { return now[i] - before[i]; }
};

/// Optical flow between the frame before and this one. What it returns is a function of the two
/// frames alone; it only keeps the newest pyramids, so that each image's is built once. One thread
/// at a time; the result does not depend on OpenCV's number of threads.
class FlowTracker {
 public:
  explicit FlowTracker(const FlowOptions& options);

  /// Every keypoint of this frame followed back to the frame before: one entry per keypoint of
  /// input.features, `now` being the keypoint. All lost where there is no frame before.
  KeypointFlow of_this_frame(const MotionInput& input);
  /// Every keypoint of the frame before followed to this one: one entry per keypoint of
  /// input.previous->features, `before` being the keypoint. Empty where there is no frame before.
  KeypointFlow of_frame_before(const MotionInput& input);

 private:
  struct Pyramid {
    RgbdFramePtr image;
    std::vector<cv::Mat> levels;
  };
  using PyramidPtr = std::shared_ptr<const Pyramid>;
  struct Followed {
    std::vector<cv::Point2f> points;
    std::vector<std::uint8_t> found;
  };
  PyramidPtr pyramid_of(const RgbdFramePtr& image);
  Followed follow(const Pyramid& from, const Pyramid& to,
                  const std::vector<cv::Point2f>& points) const;
  Followed follow_checked(const RgbdFramePtr& from, const RgbdFramePtr& to,
                          const std::vector<cv::Point2f>& points);

  FlowOptions options_;
  PyramidPtr newest_, second_;  // of the last two images asked for
};

}  // namespace stillmap
