// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/surface_refinement.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/dense/depth_weight.hpp"
#include "stillmap/dense/projected_points.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {
namespace {

/// Largest difference of a measured depth from the point: standard deviations, and a part for the
/// errors of the poses [m].
constexpr double kSigmas = 3, kPoseError = 0.01;

/// Returns the depth of the surface that the four pixels around a point show [m], interpolated in
/// inverse depths, which are linear over a plane; 0 if they do not show one.
/// @param tolerance  largest difference of the four depths from that of the point [m]
float depth_at(const DenseView& view, const ProjectedPoint& point, float tolerance) {
  float inverse = 0;
  for (int i = 0; i < 4; ++i) {
    const int row = point.row + i / 2, col = point.col + i % 2;
    const std::uint8_t kind = view.kind(row, col);
    const float z = view.depth(row, col) * DenseView::kDepthUnit;
    if (kind == kNoSurface || kind == kMoverSurface || !(std::abs(z - point.z) <= tolerance))
      return 0;
    inverse += point.share(i) / z;
  }
  return 1 / inverse;
}

}  // namespace

std::vector<Eigen::Vector3f> refined_points(const std::vector<Eigen::Vector3f>& points,
                                            const std::vector<PosedView>& views) {
  const TraceScope scope("surface refinement");
  const PointGroups groups(points);
  std::vector<Eigen::Vector4f> sums(groups.size(), Eigen::Vector4f::Zero());
  for (const PosedView& posed : views) {
    const DenseView& view = *posed.view;
    const auto tolerance = view.camera.depth_sensor.tolerance<float>(kSigmas, kPoseError);
    const DepthWeight weight(view.camera.depth_sensor);
    const Eigen::Vector3f eye = posed.T_world_camera.translation().cast<float>();
    const auto add = [&](std::size_t i, const ProjectedPoint& projected) {
      const float z = depth_at(view, projected, tolerance.at(projected.z));
      if (z <= 0) return;
      const Eigen::Vector3f shift = (z / projected.z - 1) * (groups.point(i) - eye);
      sums[i] += weight.at(z) * shift.homogeneous();
    };
    groups.for_each_in(ViewProjection(posed), all_threads(), add);
    view.drop_pages();
  }
  std::vector<Eigen::Vector3f> refined = points;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (sums[i][3] > 0) refined[groups.place(i)] += sums[i].head<3>() / sums[i][3];
  }
  return refined;
}

}  // namespace stillmap
