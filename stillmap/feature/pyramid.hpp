// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/cpu.hpp"
#include "stillmap/feature/features.hpp"
#include "stillmap/feature/resample.hpp"

#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// An image pyramid; each level is computed from the previous one by bilinear interpolation. Reuses
/// its memory.
class ImagePyramid {
 public:
  explicit ImagePyramid(CpuPath path = best_cpu_path()) : path_(path) {}

  /// Level 0 is `image` itself (8UC1, not copied: it must outlive the use of the pyramid). Levels
  /// smaller than `min_side` pixels are omitted.
  void build(const cv::Mat& image, const PyramidShape& shape, int min_side);

  int levels() const { return levels_; }
  const cv::Mat& operator[](int level) const { return images_[level]; }

  /// Returns the position in the full-size image of a position at a level. Pixel centers are
  /// integers, so the outer edges of the images, at -0.5 and size - 0.5, coincide: u = (x + 0.5) *
  /// width_0 / width_l - 0.5.
  cv::Point2f to_full_size(cv::Point2f p, int level) const;

 private:
  CpuPath path_;
  std::vector<cv::Mat> images_;
  std::vector<Shrinker> shrinkers_;  // by level
  int levels_ = 0;
};

}  // namespace stillmap
