// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/stereo_matcher.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/trace.hpp"

#include <cmath>
#include <cstdint>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

// Returns the number of disparities to search [pixels], a multiple of 16 as OpenCV wants it.
int disparity_count(const Camera& camera) {
  const double largest = camera.bf() / camera.depth_sensor.min_depth;
  return 16 * static_cast<int>(std::ceil(largest / 16));
}

bool is_much_more(double share, double other) {
  constexpr double kMatches = 0.2, kFactor = 2;
  return share >= kMatches && share >= kFactor * other;
}

}  // namespace

bool MatchShares::tell_given() const { return is_much_more(given, exchanged); }

bool MatchShares::tell_exchanged() const { return is_much_more(exchanged, given); }

StereoMatcher::StereoMatcher(const Camera& camera) : camera_(camera) {
  // Penalties for steps of one and of several pixels: 8 and 32 times the pixels of a block, as in
  // OpenCV's example. The other values are within the ranges that OpenCV's manual recommends.
  constexpr int kBlock = 5, kSmallStep = 8 * kBlock * kBlock, kLargeStep = 32 * kBlock * kBlock;
  constexpr int kLeftRightDifference = 1, kPreFilter = 31, kUniqueness = 10;  // pixels, -, percent
  constexpr int kSpeckle = 100, kSpeckleStep = 1;                             // pixels
  matcher_ = cv::StereoSGBM::create(0, disparity_count(camera), kBlock, kSmallStep, kLargeStep,
                                    kLeftRightDifference, kPreFilter, kUniqueness, kSpeckle,
                                    kSpeckleStep, cv::StereoSGBM::MODE_SGBM_3WAY);
}

cv::Mat StereoMatcher::depth(const cv::Mat& left, const cv::Mat& right) {
  const TraceScope scope("stereo matching");
  constexpr double kScale = cv::StereoMatcher::DISP_SCALE;
  cv::Mat disparity;  // 16SC1, in sixteenths of a pixel
  matcher_->compute(left, right, disparity);
  const auto scaled_bf = static_cast<float>(kScale * camera_.bf());
  const auto nearest = static_cast<float>(camera_.depth_sensor.min_depth);
  const auto farthest = static_cast<float>(camera_.depth_sensor.max_depth);
  cv::Mat1f meters(disparity.size(), 0.0F);
  for (int y = 0; y < disparity.rows; ++y) {
    const auto* from = disparity.ptr<std::int16_t>(y);
    auto* to = meters.ptr<float>(y);
    for (int x = 0; x < disparity.cols; ++x) {
      if (from[x] <= 0) continue;
      const float z = scaled_bf / static_cast<float>(from[x]);
      if (z >= nearest && z <= farthest) to[x] = z;
    }
  }
  return meters;
}

MatchShares StereoMatcher::match_shares(const cv::Mat& left, const cv::Mat& right) {
  const auto share = [](const cv::Mat& depth) {
    return cv::countNonZero(depth) / static_cast<double>(depth.total());
  };
  return {share(depth(left, right)), share(depth(right, left))};
}

void StereoMatcher::check_order(const cv::Mat& left, const cv::Mat& right) {
  if (order_is_checked_) return;
  order_is_checked_ = true;
  const MatchShares shares = match_shares(left, right);
  if (!shares.tell_exchanged()) return;
  throw Error(fmt::format("the left and right images are exchanged: {:.0f} % of the pixels of the "
                          "first pair match, and {:.0f} % the other way round",
                          100 * shares.given, 100 * shares.exchanged),
              "stereo pair " + camera_.name, "exchange the two folders or topics");
}

cv::Mat depth_of_pair(const StereoRig& rig, StereoMatcher& matcher, const cv::Mat& left,
                      const cv::Mat& right) {
  cv::Mat gray_left, gray_right;
  cv::cvtColor(left, gray_left, cv::COLOR_BGR2GRAY);
  cv::cvtColor(rectified(rig, 1, right), gray_right, cv::COLOR_BGR2GRAY);
  matcher.check_order(gray_left, gray_right);
  cv::Mat depth = matcher.depth(gray_left, gray_right);
  if (!rig.outside.empty()) depth.setTo(0, rig.outside);
  return depth;
}

}  // namespace stillmap
