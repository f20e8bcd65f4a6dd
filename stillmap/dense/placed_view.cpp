// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/placed_view.hpp"

#include "stillmap/geometry/depth_visibility.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {
namespace {

/// Minimum depth of a point with a vote [m].
constexpr float kNearest = 0.1F;
/// Side of a tile [pixels].
constexpr int kTile = 8;
/// Bound of the rounding errors [m], far below the margin.
constexpr float kRounding = 1e-4F;

int tiles_over(int pixels) { return (pixels + kTile - 1) / kTile; }

// Returns the minimum (sign -1) or maximum (sign 1) pixel coordinate of x / z over a range of z.
float bound(float x, float near, float far, int sign, float focal, float center) {
  constexpr float kFarOutside = 1e6F;
  const bool outwards = (x > 0) == (sign > 0);
  return std::clamp(focal * x / (outwards ? near : far) + center, -kFarOutside, kFarOutside);
}

}  // namespace

DepthPolynomial<float> see_through_margin(const DepthSensor& sensor) {
  // The floor [m] covers the error of the pose, the size of the voxel, and its own noise.
  constexpr double kSigmas = 3, kFloor = 0.04;
  return sensor.tolerance<float>(kSigmas, kFloor);
}

PlacedView::PlacedView(const DenseView& view, const Pose& T_world_camera)
    : view_(&view),
      margin_(see_through_margin(view.camera.depth_sensor)),
      R_world_camera_(T_world_camera.rotation()),
      t_world_camera_(T_world_camera.translation()),
      fx_(static_cast<float>(view.camera.fx)),
      fy_(static_cast<float>(view.camera.fy)),
      cx_(static_cast<float>(view.camera.cx)),
      cy_(static_cast<float>(view.camera.cy)) {
  const Pose T_camera_world = T_world_camera.inverse();
  R_camera_world_ = T_camera_world.rotation().cast<float>();
  t_camera_world_ = T_camera_world.translation().cast<float>();
  make_tiles();
}

void PlacedView::make_tiles() {
  const cv::Size size(tiles_over(view_->depth.cols), tiles_over(view_->depth.rows));
  tiles_ = {cv::Mat1w(size, std::uint16_t{65535}), cv::Mat1w(size, std::uint16_t{0}),
            cv::Mat1b(size, std::uint8_t{0})};
  for (int row = 0; row < view_->depth.rows; ++row) {
    const std::uint16_t* depth = view_->depth[row];
    const std::uint8_t* kind = view_->kind[row];
    std::uint16_t *nearest = tiles_.nearest[row / kTile], *farthest = tiles_.farthest[row / kTile];
    std::uint8_t* movers = tiles_.movers[row / kTile];
    for (int col = 0; col < view_->depth.cols; ++col) {
      nearest[col / kTile] = std::min(nearest[col / kTile], depth[col]);
      farthest[col / kTile] = std::max(farthest[col / kTile], depth[col]);
      movers[col / kTile] |= kind[col] == kMoverSurface;
    }
  }
}

// Returns the pixel at a point, if its neighbors are in the image, too.
std::optional<cv::Point> PlacedView::inner_pixel(const Eigen::Vector3f& p) const {
  if (p.z() < kNearest) return std::nullopt;
  const float scale = 1 / p.z();
  const float u = fx_ * p.x() * scale + cx_, v = fy_ * p.y() * scale + cy_;
  const auto right = static_cast<float>(view_->depth.cols) - 1.5F;
  const auto bottom = static_cast<float>(view_->depth.rows) - 1.5F;
  if (!(u >= 0.5F && v >= 0.5F && u < right && v < bottom)) return std::nullopt;
  return cv::Point(static_cast<int>(u + 0.5F), static_cast<int>(v + 0.5F));
}

bool PlacedView::shows(const Eigen::Vector3f& p) const {
  const auto pixel = inner_pixel(p);
  if (!pixel || view_->kind(*pixel) == kMoverSurface) return false;
  const float z = depth_at(*pixel);
  return visibility_of(p.z(), z, margin_.at(z)) == Visibility::kOnSurface;
}

VoxelVote PlacedView::at(const Eigen::Vector3f& p) const {
  const auto pixel = inner_pixel(p);
  if (!pixel) return VoxelVote::kNone;
  const float z = depth_at(*pixel);
  switch (visibility_of(p.z(), z, margin_.at(z))) {
    case Visibility::kUnknown:
    case Visibility::kOccluded:
      return VoxelVote::kNone;
    case Visibility::kOnSurface:
      return view_->kind(*pixel) == kMoverSurface ? VoxelVote::kMover : VoxelVote::kNone;
    case Visibility::kSeenThrough:
      break;
  }
  // All nine pixels around must agree, as an edge may be half a pixel away.
  for (int row = pixel->y - 1; row <= pixel->y + 1; ++row) {
    for (int col = pixel->x - 1; col <= pixel->x + 1; ++col) {
      const float around = depth_at({col, row});
      if (visibility_of(p.z(), around, margin_.at(around)) != Visibility::kSeenThrough)
        return VoxelVote::kNone;
    }
  }
  return VoxelVote::kSeenThrough;
}

// Returns bounds of the pixels that at() reads for the points of the ball.
PlacedView::Window PlacedView::window_around(const Eigen::Vector3f& p, float radius) const {
  const float near = p.z() - radius, far = p.z() + radius;
  const auto low = [&](float x, float focal, float center) {
    return static_cast<int>(std::floor(bound(x - radius, near, far, -1, focal, center))) - 1;
  };
  const auto high = [&](float x, float focal, float center) {
    return static_cast<int>(std::ceil(bound(x + radius, near, far, 1, focal, center))) + 1;
  };
  return {low(p.x(), fx_, cx_), high(p.x(), fx_, cx_), low(p.y(), fy_, cy_), high(p.y(), fy_, cy_)};
}

PlacedView::Extremes PlacedView::extremes_in(const Window& window) const {
  const int last_col = std::min(window.right, view_->depth.cols - 1) / kTile;
  const int last_row = std::min(window.bottom, view_->depth.rows - 1) / kTile;
  std::uint16_t nearest = 65535, farthest = 0;
  bool movers = false;
  for (int row = std::max(window.top, 0) / kTile; row <= last_row; ++row) {
    for (int col = std::max(window.left, 0) / kTile; col <= last_col; ++col) {
      nearest = std::min(nearest, tiles_.nearest(row, col));
      farthest = std::max(farthest, tiles_.farthest(row, col));
      movers |= tiles_.movers(row, col) != 0;
    }
  }
  return {static_cast<float>(nearest) * DenseView::kDepthUnit,
          static_cast<float>(farthest) * DenseView::kDepthUnit, movers};
}

std::optional<VoxelVote> PlacedView::within(const Eigen::Vector3f& p, float radius) const {
  radius += kRounding;
  const float near = p.z() - radius, far = p.z() + radius;
  if (far < kNearest || view_->depth.empty()) return VoxelVote::kNone;
  if (near < kNearest) return std::nullopt;
  const Window window = window_around(p, radius);
  const int cols = view_->depth.cols, rows = view_->depth.rows;
  if (window.right < 0 || window.left >= cols || window.bottom < 0 || window.top >= rows)
    return VoxelVote::kNone;
  const Extremes z = extremes_in(window);
  if (z.farthest + margin_.at(z.farthest) < near) return VoxelVote::kNone;
  if (!z.movers && z.farthest - margin_.at(z.farthest) <= near) return VoxelVote::kNone;
  const bool in_view =
      window.left >= 0 && window.right < cols && window.top >= 0 && window.bottom < rows;
  if (in_view && z.nearest - margin_.at(z.nearest) > far) return VoxelVote::kSeenThrough;
  return std::nullopt;
}

}  // namespace stillmap
