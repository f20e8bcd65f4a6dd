// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/view_depth_error.hpp"

#include "stillmap/base/trace.hpp"

#include <cmath>
#include <utility>
#include <vector>

namespace stillmap {
namespace {

using namespace compared_depths;  // NOLINT(google-build-using-namespace)

/// Views are compared if they turn by angles between these [rad], so that surfaces are in different
/// parts of the images.
constexpr double kLeastTurn = 0.05, kMostTurn = 1;
/// Number of views that a view is compared with, and distance of the compared pixels.
constexpr std::size_t kPartners = 12;
constexpr int kStep = 6;
/// Steepness of a surface: largest relative difference of the depths of neighbors.
constexpr double kSteepest = 0.02;

Eigen::Vector2d size_of(const cv::Mat1w& depth) { return {depth.cols, depth.rows}; }

/// Returns the depth of a pixel on a flat static surface [m]; 0 for others.
double flat_depth(const DenseView& view, int row, int col) {
  if (row < 1 || col < 1 || row + 1 >= view.depth.rows || col + 1 >= view.depth.cols) return 0;
  const double z = view.depth(row, col);
  for (const auto& [r, c] :
       {std::pair(row - 1, col), {row + 1, col}, {row, col - 1}, {row, col + 1}}) {
    if (!view.is_static(r, c) || std::abs(view.depth(r, c) - z) > kSteepest * z) return 0;
  }
  return view.is_static(row, col) ? z * DenseView::kDepthUnit : 0;
}

void compare(const PosedView& a, const PosedView& b, std::vector<DepthDifference>& differences) {
  const Pose T_b_a = b.T_world_camera.inverse() * a.T_world_camera;
  const Camera& camera = b.view->camera;
  const double least = kLeastShift * camera.width;
  for (int row = kStep / 2; row < a.view->depth.rows; row += kStep) {
    for (int col = kStep / 2; col < a.view->depth.cols; col += kStep) {
      const double z = flat_depth(*a.view, row, col);
      if (z < kNearest || z > kFarthest) continue;
      const Eigen::Vector3d p = T_b_a * a.view->camera.unproject(col, row, z);
      if (p.z() < kNearest) continue;
      const Eigen::Vector2d uv = camera.project(p);
      if (!camera.contains(uv.x(), uv.y()) || (uv - Eigen::Vector2d(col, row)).norm() < least)
        continue;
      const double seen = flat_depth(*b.view, static_cast<int>(std::lround(uv.y())),
                                     static_cast<int>(std::lround(uv.x())));
      if (seen <= 0) continue;
      const DepthDifference difference({1.0 * col, 1.0 * row, z}, {uv.x(), uv.y(), seen}, p.z(),
                                       size_of(b.view->depth));
      if (std::abs(difference.inverse_depth) <= kMostDifference) differences.push_back(difference);
    }
  }
}

/// Returns the numbers of the views that a view is compared with.
std::vector<std::size_t> partners(std::span<const PosedView> views, std::size_t view) {
  std::vector<std::size_t> found;
  const Pose T_camera_world = views[view].T_world_camera.inverse();
  for (std::size_t other = 0; other < views.size(); ++other) {
    const Pose between = T_camera_world * views[other].T_world_camera;
    if (between.angle() > kLeastTurn && between.angle() < kMostTurn &&
        between.translation().norm() < kFarthestCamera)
      found.push_back(other);
  }
  const std::size_t step = (found.size() + kPartners - 1) / kPartners;
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < found.size(); i += step) chosen.push_back(found[i]);
  return chosen;
}

}  // namespace

cv::Mat1w without_error(const cv::Mat1w& depth, const SmoothDepthError& error) {
  cv::Mat1w result(depth.size(), std::uint16_t{0});
  for (int row = 0; row < depth.rows; ++row) {
    for (int col = 0; col < depth.cols; ++col) {
      if (depth(row, col) == 0) continue;
      const double measured = depth(row, col) * double{DenseView::kDepthUnit};
      result(row, col) =
          packed_depth(static_cast<float>(error.removed_from(measured, col, row, size_of(depth))));
    }
  }
  return result;
}

std::optional<SmoothDepthError> depth_error_of(std::span<const PosedView> views) {
  const TraceScope scope("smooth depth error");
  std::vector<DepthDifference> differences;
  for (std::size_t view = 0; view < views.size(); ++view) {
    for (const std::size_t other : partners(views, view)) {
      compare(views[view], views[other], differences);
      views[other].view->drop_pages();
    }
    views[view].view->drop_pages();
  }
  return fit_depth_error(differences);
}

}  // namespace stillmap
