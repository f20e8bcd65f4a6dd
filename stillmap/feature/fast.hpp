// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/cpu.hpp"

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// A corner in one image [pixels].
struct Corner {
  int x = 0, y = 0;
  int score = 0;  ///< Score: see FastDetector.
  bool operator==(const Corner&) const = default;
};

/// FAST-9/16 (Rosten and Drummond, Machine learning for high-speed corner detection, ECCV 2006): a
/// pixel is a corner at threshold t if 9 contiguous pixels of the 16 on a circle of radius 3 are
/// all brighter by more than t, or all darker. Its score is the smallest t at which it is no
/// corner: the maximum over all arcs of 9 of the smallest difference.
///
/// Only local maxima of the score in their 3 x 3 neighborhood are kept; of equal neighbors the last
/// in raster order. The image is divided into cells; corners below `threshold` are kept only in
/// cells without any above it.
class FastDetector {
 public:
  /// @param threshold, threshold_low  gray values, 1 to 254
  /// @param cell    side of the cells [pixels]
  /// @param border  minimum distance of corners from the border, at least 4 [pixels]
  FastDetector(int threshold, int threshold_low, int cell, int border,
               CpuPath path = best_cpu_path());

  /// Returns the corners of an 8UC1 image in raster order, valid until the next call.
  const std::vector<Corner>& detect(const cv::Mat& image);

  /// Returns the score of every pixel of the last image (8UC1), 0 where it is no corner at
  /// `threshold_low`; valid within one pixel of the corner area, until the next call.
  const cv::Mat& scores() const { return scores_; }

 private:
  void detect_in_band(int y0, cv::Size size);
  void highest_to_limit();

  int threshold_, threshold_low_, cell_, border_;
  CpuPath path_;
  cv::Mat scores_;
  std::vector<std::uint8_t> score_buffer_;
  std::vector<std::uint8_t> maxima_;  // of one band of cells
  std::vector<std::uint8_t> limit_;   // by column of the band
  std::vector<Corner> corners_;
};

/// Writes the scores of the pixels of `area` in `image` to the same pixels of `scores` (both 8UC1,
/// of equal size); 0 where not above `threshold`. The area must be at least 3 pixels from the
/// border.
void fast_scores(const cv::Mat& image, const cv::Rect& area, int threshold, cv::Mat& scores,
                 CpuPath path);

}  // namespace stillmap
