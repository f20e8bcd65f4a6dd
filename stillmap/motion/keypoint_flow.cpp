// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/keypoint_flow.hpp"

#include <utility>

#include <opencv2/video/tracking.hpp>

namespace stillmap {
namespace {

/// Number of pyramid levels above the full image; each halves the size.
constexpr int kLevels = 3;
/// Maximum number of iterations per level: more track no more points.
constexpr int kIterations = 5;
/// An iteration that moves a point by less than this is the last one [pixels].
constexpr double kPrecision = 0.03;
/// Smallest eigenvalue of the gradient matrix of a tracked point, as scaled by OpenCV.
constexpr double kMinTexture = 1e-4;

std::vector<cv::Point2f> positions(const Features& features) {
  std::vector<cv::Point2f> points;
  points.reserve(features.size());
  for (const Keypoint& k : features.keypoints) points.emplace_back(k.u, k.v);
  return points;
}

bool inside(const cv::Point2f& p, cv::Size size) {
  return p.x >= 0 && p.y >= 0 && p.x <= static_cast<float>(size.width - 1) &&
         p.y <= static_cast<float>(size.height - 1);
}

}  // namespace

FlowTracker::PyramidPtr FlowTracker::pyramid_of(const RgbdFramePtr& image) {
  if (newest_ && newest_->image == image) return newest_;
  if (second_ && second_->image == image) return second_;
  auto pyramid = std::make_shared<Pyramid>();
  pyramid->image = image;
  cv::buildOpticalFlowPyramid(image->gray, pyramid->levels, cv::Size(window_, window_), kLevels,
                              false);
  second_ = std::exchange(newest_, pyramid);
  return pyramid;
}

FlowTracker::Tracked FlowTracker::track(const RgbdFramePtr& from, const RgbdFramePtr& to,
                                        const std::vector<cv::Point2f>& points) {
  if (points.empty() || from->gray.size() != to->gray.size()) {
    return {points, std::vector<std::uint8_t>(points.size(), 0)};
  }
  const PyramidPtr first = pyramid_of(from), second = pyramid_of(to);
  Tracked result;
  cv::calcOpticalFlowPyrLK(
      first->levels, second->levels, points, result.points, result.found, cv::noArray(),
      cv::Size(window_, window_), kLevels,
      {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, kIterations, kPrecision}, 0, kMinTexture);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!inside(result.points[i], to->gray.size())) result.found[i] = 0;
  }
  return result;
}

KeypointFlow FlowTracker::to_previous(const MotionInput& input) {
  std::vector<cv::Point2f> now = positions(*input.features);
  if (!input.previous) return {now, now, std::vector<std::uint8_t>(now.size(), 0)};
  Tracked before = track(input.image, input.previous->image, now);
  return {std::move(before.points), std::move(now), std::move(before.found)};
}

KeypointFlow FlowTracker::from_previous(const MotionInput& input) {
  if (!input.previous) return {};
  std::vector<cv::Point2f> before = positions(*input.previous->features);
  Tracked now = track(input.previous->image, input.image, before);
  return {std::move(before), std::move(now.points), std::move(now.found)};
}

}  // namespace stillmap
