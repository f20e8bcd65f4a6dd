// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/fused_depth.hpp"

#include "stillmap/dense/placed_view.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {
namespace {

/// Largest difference of a measured depth from the surface that it supports: standard deviations,
/// and a part for the error of the pose [m].
constexpr double kAgreement = 4, kPoseError = 0.01;
/// Largest number of independent measurements that a mean counts as: errors that the images share,
/// of the pose and of the sensor, do not average out.
constexpr int kIndependent = 16;
/// Largest number of supporting images that is counted: one less than a counter holds, so that a
/// surface with any support can be refuted.
constexpr std::uint8_t kMost = 254;

Eigen::Matrix3d intrinsics(const Camera& camera) {
  Eigen::Matrix3d K;
  K << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1;
  return K;
}

/// Returns the depth between four pixels that show one surface [m]; 0 if they do not.
float between_pixels(const cv::Mat1f& depth, float u, float v, float max_step) {
  if (!(u >= 0 && v >= 0)) return 0;
  const int col = static_cast<int>(u), row = static_cast<int>(v);
  if (col + 1 >= depth.cols || row + 1 >= depth.rows) return 0;
  const float *above = depth[row] + col, *below = depth[row + 1] + col;
  const float low = std::min({above[0], above[1], below[0], below[1]});
  const float high = std::max({above[0], above[1], below[0], below[1]});
  if (!(low > 0) || high - low > max_step) return 0;
  const float right = u - static_cast<float>(col), down = v - static_cast<float>(row);
  return (1 - down) * ((1 - right) * above[0] + right * above[1]) +
         down * ((1 - right) * below[0] + right * below[1]);
}

/// Returns the depth at the nearest pixel [m]; 0 outside the image.
float at_pixel(const cv::Mat1f& depth, float u, float v) {
  const float right = static_cast<float>(depth.cols) - 0.5F;
  const float bottom = static_cast<float>(depth.rows) - 0.5F;
  if (!(u >= 0 && v >= 0 && u < right && v < bottom)) return 0;
  return depth(static_cast<int>(v + 0.5F), static_cast<int>(u + 0.5F));
}

}  // namespace

Warp::Warp(const Camera& from, const Camera& to, const Pose& T_to_from) {
  const Eigen::Matrix3d K = intrinsics(to), R = T_to_from.rotation();
  H_ = (K * R * intrinsics(from).inverse()).cast<float>();
  offset_ = (K * T_to_from.translation()).cast<float>();
  eye_z_ = static_cast<float>(T_to_from.inverse().translation().z());
}

FusedDepth::FusedDepth(const DenseView& view)
    : camera_(view.camera),
      sigma_(view.camera.depth_sensor.tolerance<float>(1, 0)),
      agreement_(view.camera.depth_sensor.tolerance<float>(kAgreement, kPoseError)),
      see_through_(see_through_margin(view.camera.depth_sensor)),
      inverse_(view.depth.size(), 0.0F),
      supported_(view.depth.size(), std::uint8_t{0}),
      refuted_(view.depth.size(), std::uint8_t{0}) {
  for (int row = 0; row < inverse_.rows; ++row) {
    for (int col = 0; col < inverse_.cols; ++col) {
      if (view.is_static(row, col)) set(row, col, view.depth(row, col) * DenseView::kDepthUnit);
    }
  }
}

void FusedDepth::set(int row, int col, float depth) {
  inverse_(row, col) = 1 / depth;
  supported_(row, col) = 1;
  refuted_(row, col) = 0;
}

float FusedDepth::at(int row, int col) const {
  const float inverse = inverse_(row, col);
  return inverse > 0 ? 1 / inverse : 0;
}

float FusedDepth::sigma(int row, int col) const {
  const int independent = std::min(supported(row, col), kIndependent);
  return sigma_.at(at(row, col)) / std::sqrt(static_cast<float>(independent));
}

void FusedDepth::support(int row, int col, float depth) {
  std::uint8_t& count = supported_(row, col);
  if (count < kMost) ++count;
  float& inverse = inverse_(row, col);
  inverse += (1 / depth - inverse) / static_cast<float>(count);
}

void FusedDepth::refute(int row, int col) {
  if (++refuted_(row, col) <= supported_(row, col)) return;
  inverse_(row, col) = 0;
  supported_(row, col) = refuted_(row, col) = 0;
}

void FusedDepth::add(const Camera& camera, const cv::Mat1f& depth, const cv::Mat1f& movers,
                     const Pose& T_view_camera) {
  const Warp warp(camera_, camera, T_view_camera.inverse());
  for (int row = 0; row < inverse_.rows; ++row) {
    for (int col = 0; col < inverse_.cols; ++col) {
      const float z = at(row, col);
      if (z <= 0) continue;
      const auto [u, v, expected] = warp(static_cast<float>(col), static_cast<float>(row), z);
      if (!(expected > 0)) continue;
      const float limit = agreement_.at(expected);
      const float measured = between_pixels(depth, u, v, 2 * limit);
      if (measured <= 0) {
        if (!movers.empty() && std::abs(at_pixel(movers, u, v) - expected) <= limit)
          refute(row, col);
      } else if (std::abs(measured - expected) <= limit) {
        support(row, col, warp.scaled(z, measured / expected));
      } else if (measured - see_through_.at(measured) > expected) {
        refute(row, col);
      }
    }
  }
}

}  // namespace stillmap
