// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/keypoint_flow.hpp"

#include "stillmap/base/error.hpp"

#include <utility>

#include <opencv2/video/tracking.hpp>

namespace stillmap {
namespace {

const FlowOptions& checked(const FlowOptions& o) {
  if (o.window < 3 || o.levels < 0 || o.iterations < 1) {
    throw Error("optical flow needs a window of 3 or more, levels of 0 or more and an iteration",
                "motion.*.flow", "window 5, levels 3 and iterations 10 are usual");
  }
  return o;
}

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

FlowTracker::FlowTracker(const FlowOptions& options) : options_(checked(options)) {}

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
      {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, options_.iterations, options_.precision}, 0,
      options_.texture);
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
