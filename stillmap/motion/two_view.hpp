// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Points of two images that show the same, index by index. Pixels.
struct PointPairs {
  std::vector<cv::Point2f> before, now;
  std::size_t size() const { return before.size(); }
  void add(cv::Point2f in_before, cv::Point2f in_now) {
    before.push_back(in_before);
    now.push_back(in_now);
  }
};

/// Random sample consensus (Fischler and Bolles, CACM 1981). The generator is seeded afresh for
/// every call, so equal pairs give equal bits, whatever else runs.
struct RansacOptions {
  double threshold = 1.5;  ///< a pair off by less supports the model [pixels]
};

/// H with p_now ~ H * p_before for most pairs; none with fewer than 4 pairs or where no model is
/// supported.
std::optional<cv::Matx33d> find_homography(const PointPairs& pairs, const RansacOptions& options);

/// F with p_now' F p_before = 0 for most pairs; none with fewer than 8 pairs or where no model is
/// supported.
std::optional<cv::Matx33d> find_fundamental(const PointPairs& pairs, const RansacOptions& options);

/// |p_now - H * p_before| after the division by the third coordinate; infinite where that is 0.
/// Pixels.
double warp_error(const cv::Matx33d& H, cv::Point2f before, cv::Point2f now);

/// Distance of p_now from the epipolar line (A, B, C)' = F * p_before, in pixels:
/// |p_now' F p_before| / sqrt(A^2 + B^2) (equation 4 of the improved-YOLOv7 system's paper); 0
/// where the line is undefined, at the epipole.
double epipolar_distance(const cv::Matx33d& F, cv::Point2f before, cv::Point2f now);

}  // namespace stillmap
