// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/pose_ransac.hpp"

#include "stillmap/geometry/trajectory.hpp"

#include <array>

#include <opencv2/calib3d.hpp>

namespace stillmap {
namespace {

/// Reprojection error of a pose from few points, as a multiple of a keypoint's own.
constexpr double kGuessFactor = 1.5;
/// Inlier bound: 99 % quantile of the chi-square distribution with two degrees of freedom.
constexpr double kChi2 = 9.21;

/// Returns whether a point in the camera frame projects near a pixel.
bool seen_at(const Camera& camera, const Eigen::Vector3d& p_camera, const Eigen::Vector2d& uv,
             double scale) {
  if (p_camera.z() < kNearPlane) return false;
  const double sigma = kGuessFactor * ObservationNoise{}.pixel_sigma * scale;
  return (camera.project(p_camera) - uv).squaredNorm() <= kChi2 * sigma * sigma;
}

std::vector<std::uint8_t> agreeing(const Camera& camera, std::span<const RigidPair> pairs,
                                   const Pose& T_a_b) {
  const Pose T_b_a = T_a_b.inverse();
  std::vector<std::uint8_t> inlier;
  for (const RigidPair& pair : pairs) {
    inlier.push_back(seen_at(camera, T_a_b * pair.p_b, pair.uv_a, pair.scale_a) &&
                     seen_at(camera, T_b_a * pair.p_a, pair.uv_b, pair.scale_b));
  }
  return inlier;
}

/// Returns the motion fitted to the pairs of the given indices.
template <typename Indices>
Pose fit_rigid(std::span<const RigidPair> pairs, const Indices& indices) {
  Eigen::Matrix3Xd a(3, indices.size()), b(3, indices.size());
  for (std::size_t i = 0; i < indices.size(); ++i) {
    a.col(static_cast<Eigen::Index>(i)) = pairs[indices[i]].p_a;
    b.col(static_cast<Eigen::Index>(i)) = pairs[indices[i]].p_b;
  }
  return align_points(a, b);
}

/// Refits to all inliers as long as their number grows.
void polish(const Camera& camera, std::span<const RigidPair> pairs, Consensus<Pose>& consensus) {
  constexpr int kRounds = 5;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<std::size_t> indices;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (consensus.inlier[i]) indices.push_back(i);
    }
    const Pose T_a_b = fit_rigid(pairs, indices);
    auto inlier = agreeing(camera, pairs, T_a_b);
    const auto inliers = static_cast<int>(std::count(inlier.begin(), inlier.end(), 1));
    if (inliers < consensus.inliers) return;
    const bool same = inliers == consensus.inliers;
    consensus = {T_a_b, std::move(inlier), inliers, consensus.iterations};
    if (same) return;
  }
}

/// Returns the poses that project the three points to their pixels.
std::vector<Pose> three_point_poses(const Camera& camera, std::span<const AbsolutePair> pairs,
                                    const std::array<std::size_t, 3>& sample) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (const std::size_t i : sample) {
    points.emplace_back(pairs[i].p_world.x(), pairs[i].p_world.y(), pairs[i].p_world.z());
    pixels.emplace_back((pairs[i].uv.x() - camera.cx) / camera.fx,
                        (pairs[i].uv.y() - camera.cy) / camera.fy);
  }
  std::vector<cv::Vec3d> turns, shifts;
  cv::solveP3P(points, pixels, cv::Matx33d::eye(), cv::noArray(), turns, shifts, cv::SOLVEPNP_AP3P);
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    const Eigen::Vector3d w(turns[i][0], turns[i][1], turns[i][2]);
    const Eigen::Vector3d t(shifts[i][0], shifts[i][1], shifts[i][2]);
    if (w.allFinite() && t.allFinite()) poses.push_back(Pose(so3_exp(w), t).inverse());
  }
  return poses;
}

}  // namespace

std::optional<Consensus<Pose>> find_rigid_motion(const Camera& camera,
                                                 std::span<const RigidPair> pairs,
                                                 int min_inliers) {
  auto consensus = ransac<3, Pose>(
      pairs.size(), min_inliers,
      [&](const auto& sample) { return std::vector<Pose>{fit_rigid(pairs, sample)}; },
      [&](const Pose& T_a_b) { return agreeing(camera, pairs, T_a_b); });
  if (consensus) polish(camera, pairs, *consensus);
  return consensus;
}

int count_agreeing(const Camera& camera, std::span<const RigidPair> pairs, const Pose& T_a_b) {
  const auto inlier = agreeing(camera, pairs, T_a_b);
  return static_cast<int>(std::count(inlier.begin(), inlier.end(), 1));
}

std::optional<Consensus<Pose>> find_absolute_pose(const Camera& camera,
                                                  std::span<const AbsolutePair> pairs,
                                                  int min_inliers) {
  return ransac<3, Pose>(
      pairs.size(), min_inliers,
      [&](const auto& sample) { return three_point_poses(camera, pairs, sample); },
      [&](const Pose& T_world_camera) {
        const Pose T_camera_world = T_world_camera.inverse();
        std::vector<std::uint8_t> inlier;
        for (const AbsolutePair& p : pairs)
          inlier.push_back(seen_at(camera, T_camera_world * p.p_world, p.uv, p.scale));
        return inlier;
      });
}

}  // namespace stillmap
