// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Matched points of two images, index by index [pixels].
struct PointPairs {
  std::vector<cv::Point2f> before, now;
  std::size_t size() const { return before.size(); }
  void add(cv::Point2f in_before, cv::Point2f in_now) {
    before.push_back(in_before);
    now.push_back(in_now);
  }
};

/// Returns H with p_now ~ H * p_before for most pairs by random sample consensus (Fischler and
/// Bolles, CACM 1981), or none with fewer than 4 pairs or without a supported model. Deterministic:
/// the generator starts from the same seed in every call.
/// @param threshold largest error of an inlier [pixels]
std::optional<cv::Matx33d> find_homography(const PointPairs& pairs, double threshold);

/// Returns the matrix of the rotation and translation of the image that is nearest to a homography:
/// T in SE(2) with the least sum of |T p - H p|^2 over the points [pixels] (Umeyama, TPAMI 1991,
/// without scale). Points at infinity under H are ignored; the identity without any other.
cv::Matx33d nearest_rigid(const cv::Matx33d& H, const std::vector<cv::Point2f>& points);

/// Returns F with p_now' F p_before = 0 for most pairs, like find_homography(), or none with fewer
/// than 8 pairs or without a supported model.
std::optional<cv::Matx33d> find_fundamental(const PointPairs& pairs, double threshold);

/// Returns |p_now - H * p_before| after the division by the third coordinate [pixels]; infinite if
/// that is 0.
double warp_error(const cv::Matx33d& H, cv::Point2f before, cv::Point2f now);

/// Returns the distance of p_now from the epipolar line (A, B, C)' = F * p_before [pixels]:
/// |p_now' F p_before| / sqrt(A^2 + B^2) (Shi et al. 2024, equations 3 and 4); 0 at
/// the epipole, where the line is undefined.
double epipolar_distance(const cv::Matx33d& F, cv::Point2f before, cv::Point2f now);

}  // namespace stillmap
