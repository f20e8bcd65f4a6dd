// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/keypoint_flow.hpp"

#include <utility>

#include <opencv2/video/tracking.hpp>

namespace stillmap {
namespace {

/// An iteration that moves a point by less than this is the last one [pixels].
constexpr double kPrecision = 0.03;
/// Smallest eigenvalue of the gradient matrix at which a point is followed, as OpenCV scales it.
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

FlowTracker::FlowTracker(const FlowOptions& options) : options_(options) {}

FlowTracker::PyramidPtr FlowTracker::pyramid_of(const RgbdFramePtr& image) {
  if (newest_ && newest_->image == image) return newest_;
  if (second_ && second_->image == image) return second_;
  auto pyramid = std::make_shared<Pyramid>();
  pyramid->image = image;
  cv::buildOpticalFlowPyramid(image->gray, pyramid->levels,
                              cv::Size(options_.window, options_.window), options_.levels, false);
  second_ = std::exchange(newest_, pyramid);
  return pyramid;
}

FlowTracker::Followed FlowTracker::follow(const Pyramid& from, const Pyramid& to,
                                          const std::vector<cv::Point2f>& points) const {
  Followed result;
  cv::calcOpticalFlowPyrLK(
      from.levels, to.levels, points, result.points, result.found, cv::noArray(),
      cv::Size(options_.window, options_.window), options_.levels,
      {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, options_.iterations, kPrecision}, 0,
      kMinTexture);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!inside(result.points[i], to.image->gray.size())) result.found[i] = 0;
  }
  return result;
}

FlowTracker::Followed FlowTracker::follow_checked(const RgbdFramePtr& from, const RgbdFramePtr& to,
                                                  const std::vector<cv::Point2f>& points) {
  if (points.empty() || from->gray.size() != to->gray.size()) {
    return {points, std::vector<std::uint8_t>(points.size(), 0)};
  }
  const PyramidPtr there = pyramid_of(from), here = pyramid_of(to);
  Followed result = follow(*there, *here, points);
  if (options_.check_back <= 0) return result;
  const Followed back = follow(*here, *there, result.points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool returned =
        back.found[i] != 0 && cv::norm(back.points[i] - points[i]) <= options_.check_back;
    if (!returned) result.found[i] = 0;
  }
  return result;
}

KeypointFlow FlowTracker::of_this_frame(const MotionInput& input) {
  std::vector<cv::Point2f> now = positions(*input.features);
  if (!input.previous) return {now, now, std::vector<std::uint8_t>(now.size(), 0)};
  Followed before = follow_checked(input.image, input.previous->image, now);
  return {std::move(before.points), std::move(now), std::move(before.found)};
}

KeypointFlow FlowTracker::of_frame_before(const MotionInput& input) {
  if (!input.previous) return {};
  std::vector<cv::Point2f> before = positions(*input.previous->features);
  Followed now = follow_checked(input.previous->image, input.image, before);
  return {std::move(before), std::move(now.points), std::move(now.found)};
}

}  // namespace stillmap
