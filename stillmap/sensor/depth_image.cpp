// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/depth_image.hpp"

#include "stillmap/base/trace.hpp"

#include <cstdint>

namespace stillmap {
namespace {

constexpr float kSaturated = 65535;  // Raw value for "too far", which is not a distance.

}  // namespace

cv::Mat depth_in_meters(const cv::Mat& raw, double depth_factor, const DepthSensor& sensor) {
  const TraceScope scope("depth in meters");
  CV_Assert(raw.type() == CV_16UC1 || raw.type() == CV_32FC1);
  cv::Mat meters(raw.size(), CV_32FC1);
  const auto factor = static_cast<float>(depth_factor);
  const auto nearest = static_cast<float>(sensor.min_depth);
  const auto farthest = static_cast<float>(sensor.max_depth);
  for (int y = 0; y < raw.rows; ++y) {
    auto* to = meters.ptr<float>(y);
    if (raw.type() == CV_32FC1) {
      const auto* from = raw.ptr<float>(y);
      for (int x = 0; x < raw.cols; ++x) {
        const float z = from[x];
        to[x] = ((z >= nearest) & (z <= farthest)) ? z : 0.0F;
      }
      continue;
    }
    const auto* from = raw.ptr<std::uint16_t>(y);
    for (int x = 0; x < raw.cols; ++x) {
      const auto value = static_cast<float>(from[x]);
      const float z = value / factor;
      to[x] = ((value != kSaturated) & (z >= nearest) & (z <= farthest)) ? z : 0.0F;
    }
  }
  return meters;
}

void correct_disparity(const DisparityBias& bias, const Camera& camera, cv::Mat& depth) {
  if (bias == DisparityBias{}) return;
  const TraceScope scope("disparity correction");
  const DepthSensor& sensor = camera.depth_sensor;
  for (int y = 0; y < depth.rows; ++y) {
    auto* row = depth.ptr<float>(y);
    for (int x = 0; x < depth.cols; ++x) {
      if (row[x] <= 0) continue;
      const double z = 1 / (1 / row[x] - bias.offset - bias.bow * camera.squared_radius(x, y));
      row[x] = z >= sensor.min_depth && z <= sensor.max_depth ? static_cast<float>(z) : 0.0F;
    }
  }
}

}  // namespace stillmap
