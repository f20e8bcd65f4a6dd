// SPDX-License-Identifier: Apache-2.0
#include "stillmap/warn/zone_view.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {
namespace {

constexpr double kStep = 0.25;    // distance of the points [m]
constexpr int kMostSteps = 40;    // along each side; larger zones get a larger distance
constexpr double kHeight = 1;     // of the points above the zone's lower end, at most [m]
constexpr double kHidden = 0.3;   // a surface that is so much nearer hides a point [m]
constexpr double kNearest = 0.1;  // least depth of a point in front of the camera [m]

/// Whether the camera sees the space at a point.
bool is_seen(const Eigen::Vector3d& p_camera, const Camera& camera, const cv::Mat1f& depth) {
  if (p_camera.z() < kNearest) return false;
  const Eigen::Vector2d pixel = camera.project(p_camera);
  const int col = static_cast<int>(std::lround(pixel.x()));
  const int row = static_cast<int>(std::lround(pixel.y()));
  if (col < 0 || row < 0 || col >= depth.cols || row >= depth.rows) return false;
  return depth(row, col) > 0 && depth(row, col) > p_camera.z() - kHidden;
}

}  // namespace

double seen_share(const Zone& zone, const Camera& camera, const Pose& T_world_camera,
                  const cv::Mat1f& depth) {
  const Eigen::Vector3d u = zone.up.unitOrthogonal(), v = zone.up.cross(u);
  Eigen::AlignedBox2d area;
  for (const Eigen::Vector3d& corner : zone.polygon)
    area.extend(Eigen::Vector2d(u.dot(corner), v.dot(corner)));
  const double height =
      zone.up.dot(zone.polygon.front()) + zone.low + std::min(kHeight, (zone.high - zone.low) / 2);
  const Pose T_camera_world = T_world_camera.inverse();
  const double narrow = area.sizes().minCoeff(), wide = area.sizes().maxCoeff();
  const double step = std::max(std::min(kStep, narrow / 4), wide / kMostSteps);
  int all = 0, seen = 0;
  for (double x = area.min().x() + step / 2; x < area.max().x(); x += step) {
    for (double y = area.min().y() + step / 2; y < area.max().y(); y += step) {
      const Eigen::Vector3d p = x * u + y * v + height * zone.up;
      if (level_distance(zone, p) > 0) continue;
      ++all;
      seen += is_seen(T_camera_world * p, camera, depth) ? 1 : 0;
    }
  }
  return all == 0 ? 0 : static_cast<double>(seen) / all;
}

}  // namespace stillmap
