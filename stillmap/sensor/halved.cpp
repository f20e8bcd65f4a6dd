// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/halved.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/trace.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

// Minimum size of the full image [pixels]; half of it is too small for tracking.
constexpr int kLeastWidth = 128, kLeastHeight = 96;
constexpr float kOneSurface = 1.03F;  // Maximum ratio of depths on one surface.

cv::Mat mean_of_four(const cv::Mat& image) {
  const cv::Size half(image.cols / 2, image.rows / 2);
  cv::Mat small;
  cv::resize(image({0, 0, 2 * half.width, 2 * half.height}), small, half, 0, 0, cv::INTER_AREA);
  return small;
}

float depth_of_four(const std::array<float, 4>& readings) {
  constexpr float kNone = std::numeric_limits<float>::max();
  float nearest = kNone;
  for (const float z : readings) nearest = std::min(nearest, z > 0 ? z : kNone);
  float sum = 0, count = 0;
  for (const float z : readings) {
    const bool same = z > 0 && z <= kOneSurface * nearest;
    sum += same ? z : 0.0F;
    count += same ? 1.0F : 0.0F;
  }
  return count > 0 ? sum / count : 0.0F;
}

cv::Mat halved_depth(const cv::Mat& depth) {
  cv::Mat small(depth.rows / 2, depth.cols / 2, CV_32FC1);
  for (int y = 0; y < small.rows; ++y) {
    const auto *upper = depth.ptr<float>(2 * y), *lower = depth.ptr<float>(2 * y + 1);
    auto* to = small.ptr<float>(y);
    for (int x = 0; x < small.cols; ++x) {
      to[x] = depth_of_four({upper[2 * x], upper[2 * x + 1], lower[2 * x], lower[2 * x + 1]});
    }
  }
  return small;
}

}  // namespace

Camera halved(const Camera& camera) {
  if (camera.width < kLeastWidth || camera.height < kLeastHeight) {
    throw Error(fmt::format("has images of {} x {} pixels, too small to be halved", camera.width,
                            camera.height),
                "camera '" + camera.name + "'", "leave --half and input.half_size out");
  }
  Camera half = camera;
  half.width /= 2;
  half.height /= 2;
  half.fx /= 2;
  half.fy /= 2;
  half.cx = (camera.cx - 0.5) / 2;
  half.cy = (camera.cy - 0.5) / 2;
  return half;
}

RgbdFrame halved(const RgbdFrame& frame) {
  const TraceScope scope("halve frame");
  RgbdFrame half = frame;
  half.color = mean_of_four(frame.color);
  half.gray = mean_of_four(frame.gray);
  half.depth = halved_depth(frame.depth);
  if (!frame.ignored.empty()) half.ignored = mean_of_four(frame.ignored) > 0;
  return half;
}

}  // namespace stillmap
