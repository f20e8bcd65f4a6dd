// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/depth_camera.hpp"

#include "stillmap/simulate/random.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace stillmap {
namespace {

/// Target brightness of the automatic exposure [gray levels].
constexpr double kMeanGray = 110;

using simulate::Random, simulate::scramble;
constexpr double kJump = 0.05;  // relative depth step between neighbors that makes an edge

/// Normal deviates from a table, read from a position that depends on seed, frame, row and channel,
/// so that they are fast and independent of the order of the rows.
class NormalNoise {
 public:
  NormalNoise(std::uint64_t seed, std::uint64_t frame, std::uint64_t channel)
      : key_(scramble(seed) ^ scramble(frame * 16 + channel + 1)) {}

  /// Returns the deviates of one row: consecutive entries from a random position on.
  class Row {
   public:
    explicit Row(std::uint64_t start) : index_(start) {}
    float next() { return table()[++index_ % kSize]; }

   private:
    std::uint64_t index_;
  };
  Row row(int y) const { return Row(scramble(key_ + static_cast<std::uint64_t>(y))); }

 private:
  static constexpr std::size_t kSize = 1 << 16;
  static const std::vector<float>& table() {
    static const std::vector<float> kTable = [] {
      Random random(20120516);
      std::vector<float> values(kSize);
      for (float& value : values) value = static_cast<float>(random.normal());
      return values;
    }();
    return kTable;
  }
  std::uint64_t key_;
};

/// Returns the pixels in the shadow of the projector or the second camera, where a nearer surface
/// lies in the same direction. It is one baseline to the right, so a pixel (u, z) has the column
/// u - f b / z there.
void cast_shadow(const float* z, int width, double bf, std::vector<std::uint8_t>& lit) {
  double front = std::numeric_limits<double>::infinity();
  for (int u = width - 1; u >= 0; --u) {
    if (z[u] <= 0) continue;
    const double column = u - bf / static_cast<double>(z[u]);
    lit[static_cast<std::size_t>(u)] = column < front;
    front = std::min(front, column);
  }
}

/// Relation of the surface at a pixel to its four neighbors.
struct Neighborhood {
  bool edge = false;  // a jump to one of them
  double slope2 =
      0;  // (|gradient| f / z)^2: squared tangent of the angle between surface and image plane
};

Neighborhood look_around(const cv::Mat& depth, int y, int x, double focal) {
  const auto at = [&](int v, int u) {
    return static_cast<double>(
        depth.at<float>(std::clamp(v, 0, depth.rows - 1), std::clamp(u, 0, depth.cols - 1)));
  };
  const double z = at(y, x);
  const double left = std::abs(at(y, x - 1) - z), right = std::abs(at(y, x + 1) - z);
  const double up = std::abs(at(y - 1, x) - z), down = std::abs(at(y + 1, x) - z);
  const double gx = std::min(left, right), gy = std::min(up, down);  // the smoother side
  const double scale = focal / z;
  return {std::max({left, right, up, down}) > kJump * z, (gx * gx + gy * gy) * scale * scale};
}

/// Returns the depth rounded to the resolution of the sensor [m]; 0 if it has no such reading.
double quantized(double z, const DepthSensor& sensor) {
  if (sensor.depth_step > 0) return std::round(z / sensor.depth_step) * sensor.depth_step;
  if (sensor.disparity_step <= 0) return z;
  const double bf = sensor.focal * sensor.baseline, step = sensor.disparity_step;
  const double disparity = static_cast<int>(bf / (z * step) + 0.5) * step;
  return disparity > 0 ? bf / disparity : 0;
}

/// Returns the depth with the systematic error of the sensor [m].
double biased(double z, double x, double y, const Camera& camera, const DepthBias& bias) {
  const double bf = camera.depth_sensor.focal * camera.depth_sensor.baseline;
  if (bf <= 0 || (bias.offset == 0 && bias.bow == 0)) return z;
  const double dx = x - camera.cx, dy = y - camera.cy;
  const double corner2 = (camera.width * camera.width + camera.height * camera.height) / 4.0;
  return bf / (bf / z + bias.offset + bias.bow * (dx * dx + dy * dy) / corner2);
}

}  // namespace

cv::Mat measure_depth(const cv::Mat& depth, const Camera& camera, std::uint64_t seed,
                      std::uint64_t frame, const DepthBias& bias) {
  const DepthSensor& sensor = camera.depth_sensor;
  if (sensor.principle == DepthPrinciple::kIdeal) return depth.clone();
  cv::Mat measured = cv::Mat::zeros(depth.size(), CV_32FC1);
  const NormalNoise axial(seed, frame, 0), lateral(seed, frame, 1);
  const double steepest = std::tan(std::min(sensor.grazing, 89.9) * std::numbers::pi / 180);
  std::vector<std::uint8_t> lit(static_cast<std::size_t>(depth.cols), 1);
  for (int y = 0; y < depth.rows; ++y) {
    if (sensor.baseline > 0)
      cast_shadow(depth.ptr<float>(y), depth.cols, camera.fx * sensor.baseline, lit);
    auto axial_row = axial.row(y), lateral_row = lateral.row(y);
    Random loss(seed ^ scramble(frame), static_cast<std::uint64_t>(y));
    auto* out = measured.ptr<float>(y);
    for (int x = 0; x < depth.cols; ++x) {
      const double du = sensor.lateral_sigma * static_cast<double>(lateral_row.next());
      const double dv = sensor.lateral_sigma * static_cast<double>(lateral_row.next());
      const double deviate = static_cast<double>(axial_row.next());
      const int u = std::clamp(static_cast<int>(x + du + 0.5), 0, depth.cols - 1);
      const int v = std::clamp(static_cast<int>(y + dv + 0.5), 0, depth.rows - 1);
      const double z = biased(depth.at<float>(v, u), u, v, camera, bias);
      if (z < sensor.min_depth || z > sensor.max_depth || lit[static_cast<std::size_t>(x)] == 0)
        continue;
      const Neighborhood around = look_around(depth, v, u, camera.fx);
      if (around.slope2 > steepest * steepest) continue;
      if (around.edge && loss.chance(sensor.edge_loss)) continue;
      out[x] = static_cast<float>(quantized(z + sensor.sigma(z) * deviate, sensor));
    }
  }
  return measured;
}

cv::Mat measure_color(const cv::Mat& color, double seconds, const ColorNoise& model,
                      std::uint64_t seed, std::uint64_t frame) {
  cv::Mat measured(color.size(), CV_8UC3);
  const NormalNoise noise(seed, frame, 2);
  const double tau = 2 * std::numbers::pi;
  const cv::Scalar channels = cv::mean(color);
  const double mean = (channels[0] + channels[1] + channels[2]) / 3;
  const double exposure =
      model.auto_exposure > 0 ? std::pow(kMeanGray / std::max(1.0, mean), model.auto_exposure) : 1;
  const auto gain = static_cast<float>(
      exposure * (1 + model.exposure_drift * 0.5 *
                          (std::sin(tau * seconds / 6.7) + std::sin(tau * seconds / 15.1 + 1))));
  const auto sigma = [&](int value) {
    return static_cast<float>(std::sqrt(model.sigma * model.sigma + model.gain * value));
  };
  std::array<float, 256> sigmas{};
  for (std::size_t i = 0; i < 256; ++i) sigmas[i] = sigma(static_cast<int>(i));
  for (int y = 0; y < color.rows; ++y) {
    auto row = noise.row(y);
    const auto* in = color.ptr<float>(y);
    auto* out = measured.ptr<std::uint8_t>(y);
    for (int i = 0; i < 3 * color.cols; ++i) {
      const float value = std::min(255.0F, in[i] * gain);
      const float noisy = value + sigmas[static_cast<std::size_t>(value)] * row.next();
      out[i] = cv::saturate_cast<std::uint8_t>(noisy);
    }
  }
  return measured;
}

}  // namespace stillmap
