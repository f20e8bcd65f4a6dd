// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/far_surface.hpp"

#include "stillmap/base/trace.hpp"

#include <cmath>
#include <numbers>

namespace stillmap {
namespace {

/// Depths of one surface differ by at most this many standard deviations.
constexpr double kDeviations = 3.5;
/// Half the side of the window that a depth is averaged over, without its center [pixels].
constexpr int kWindow = 2;
/// Minimum share of the known depths in the window that must belong to the surface [0..1].
constexpr double kSupport = 0.4;

/// Averages the depths of the surface around a pixel.
class SurfaceAverage {
 public:
  SurfaceAverage(const DepthSensor& sensor, const cv::Mat1f& depth)
      : depth_(depth), sigma_(sensor.tolerance<float>(1, 0)) {}

  /// Returns the largest difference of two measurements of one surface [m].
  float tolerance(float z) const {
    return static_cast<float>(kDeviations * std::numbers::sqrt2) * sigma_.at(z);
  }

  /// Returns the mean [m], or 0 with too few depths.
  float mean(int u, int v) const {
    const float z = depth_(v, u), limit = tolerance(z);
    const bool whole =
        u >= kWindow && v >= kWindow && u + kWindow < depth_.cols && v + kWindow < depth_.rows;
    if (!whole) return 0;  // A part of the window would bias the mean of a slanted surface.
    float sum = 0;
    int count = 0, measured = 0;
    for (int row = v - kWindow; row <= v + kWindow; ++row) {
      const float* line = depth_[row];
      for (int col = u - kWindow; col <= u + kWindow; ++col) {
        const bool same = std::abs(line[col] - z) <= limit;  // false for NaN
        sum += same ? line[col] : 0;
        count += same;
        measured += line[col] > 0;
      }
    }
    const bool enough = count >= kSupport * measured && count > 2 * kWindow;
    return enough ? sum / static_cast<float>(count) : 0;
  }

 private:
  const cv::Mat1f& depth_;
  DepthPolynomial<float> sigma_;
};

}  // namespace

cv::Mat1f far_depths(const DepthSensor& sensor, const cv::Mat1f& depth, const cv::Mat1b& excluded,
                     const PointGrid& placed, const BackProjectionOptions& back_projection,
                     const FarOptions& options) {
  const TraceScope scope("far surfaces");
  const float farthest = options.max_sigma > 0 ? sensor.depth_at_sigma(options.max_sigma) : 0;
  const auto max_jump = static_cast<float>(back_projection.max_jump);
  const SurfaceAverage surface(sensor, depth);
  const cv::Mat1b moving = dilated(excluded, back_projection.mask_dilation);
  cv::Mat1f far(placed.points.size(), 0.0F);
  for (int row = 0; row < far.rows; ++row) {
    for (int col = 0; col < far.cols; ++col) {
      const int u = col * placed.stride, v = row * placed.stride;
      const float z = depth(v, u);
      const bool candidate = z <= farthest && surface.tolerance(z) > max_jump * z;  // false for NaN
      if (!candidate || placed.points(row, col)[2] > 0) continue;
      if (moving.empty() || moving(v, u) == 0) far(row, col) = surface.mean(u, v);
    }
  }
  return far;
}

}  // namespace stillmap
