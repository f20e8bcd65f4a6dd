// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/far_surface.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/trace.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stillmap {
namespace {

/// Depths of one surface with that of a pixel, around it.
class OneSurface {
 public:
  OneSurface(const DepthSensor& sensor, const cv::Mat1f& depth, const FarOptions& options)
      : depth_(depth),
        window_(options.window),
        deviations_(static_cast<float>(options.deviations * std::numbers::sqrt2)),
        sigma_(sensor.tolerance<float>(1, 0)),
        support_(options.support) {}

  /// How far apart two measurements of one surface may be [m].
  float reach(float z) const { return deviations_ * sigma_.at(z); }

  /// Their mean; 0 where there are too few.
  float mean(int u, int v) const {
    const float z = depth_(v, u), limit = reach(z);
    const bool whole =
        u >= window_ && v >= window_ && u + window_ < depth_.cols && v + window_ < depth_.rows;
    if (!whole) return 0;  // of a slanted surface it would be the mean of one side
    float sum = 0;
    int count = 0, measured = 0;
    for (int row = v - window_; row <= v + window_; ++row) {
      const float* line = depth_[row];
      for (int col = u - window_; col <= u + window_; ++col) {
        const bool same = std::abs(line[col] - z) <= limit;  // false for NaN
        sum += same ? line[col] : 0;
        count += same;
        measured += line[col] > 0;
      }
    }
    const bool enough = count >= support_ * measured && count > 2 * window_;
    return enough ? sum / static_cast<float>(count) : 0;
  }

 private:
  const cv::Mat1f& depth_;
  int window_;
  float deviations_;
  DepthPolynomial<float> sigma_;
  double support_;
};

}  // namespace

cv::Mat1f far_depths(const DepthSensor& sensor, const cv::Mat1f& depth, const cv::Mat1b& excluded,
                     const PointGrid& placed, const BackProjectionOptions& back_projection,
                     const FarOptions& options) {
  const TraceScope scope("far surfaces");
  const float farthest = options.max_sigma > 0 ? sensor.depth_at_sigma(options.max_sigma) : 0;
  const auto max_jump = static_cast<float>(back_projection.max_jump);
  const OneSurface surface(sensor, depth, options);
  const cv::Mat1b moving = dilated(excluded, back_projection.mask_dilation);
  cv::Mat1f far(placed.points.size(), 0.0F);
  for (int row = 0; row < far.rows; ++row) {
    for (int col = 0; col < far.cols; ++col) {
      const int u = col * placed.stride, v = row * placed.stride;
      const float z = depth(v, u);
      const bool candidate = z <= farthest && surface.reach(z) > max_jump * z;  // false for NaN
      if (!candidate || placed.points(row, col)[2] > 0) continue;
      if (moving.empty() || moving(v, u) == 0) far(row, col) = surface.mean(u, v);
    }
  }
  return far;
}

}  // namespace stillmap
