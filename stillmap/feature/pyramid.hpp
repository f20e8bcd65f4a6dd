// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/cpu.hpp"
#include "stillmap/feature/features.hpp"
#include "stillmap/feature/resample.hpp"

#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// An image and its smaller copies, each made from the one before by bilinear interpolation. Keeps
/// its memory from image to image.
class ImagePyramid {
 public:
  explicit ImagePyramid(CpuPath path = best_cpu_path()) : path_(path) {}

  /// Level 0 is `image` itself (8UC1, not copied: it must outlive the use of the pyramid). Levels
  /// that would be smaller than `min_side` pixels are left out.
  void build(const cv::Mat& image, const PyramidShape& shape, int min_side);

  int levels() const { return levels_; }
  const cv::Mat& operator[](int level) const { return images_[level]; }

  /// Where a position on a level lies in the full-size image. Pixel centers have whole coordinates,
  /// so the outer edges of the images, at -0.5 and size - 0.5, fall together, not the centers of
  /// their corner pixels: u = (x + 0.5) * width_0 / width_l - 0.5.
  cv::Point2f to_full_size(cv::Point2f p, int level) const;

 private:
  CpuPath path_;
  std::vector<cv::Mat> images_;
  std::vector<Shrinker> shrinkers_;  // by level
  int levels_ = 0;
};

}  // namespace stillmap
