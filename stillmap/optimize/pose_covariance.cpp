// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/pose_covariance.hpp"

#include <algorithm>
#include <array>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace stillmap {
namespace {

/// The image is divided into kPartsPerSide x kPartsPerSide parts, of which at least kMinParts must
/// have inliers.
constexpr int kPartsPerSide = 4, kMinParts = 4;

/// Variance of the landmarks' errors, relative to that of the residuals, which do not show it:
/// landmarks were made from the same keypoints. Chosen by measurement on rendered kitchens and an
/// office: lab/records/recordings.md.
constexpr double kLandmarkVariance = 0.25;

/// Normal equations H xi = -g of the inliers in a part of the image, for the left perturbation xi
/// of T_camera_world.
struct PartNormal {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();

  bool empty() const { return H(0, 0) == 0; }
};
using Parts = std::array<PartNormal, kPartsPerSide * kPartsPerSide>;

void add(const Camera& camera, const Pose& T_camera_world, const PoseObservation& o,
         bool with_depth, PartNormal& part) {
  const Measurement m =
      make_measurement(camera, observation_noise(camera, o.depth), o.u, o.v, o.depth, o.scale);
  const Eigen::Vector3d p = T_camera_world * o.p_world;
  const Eigen::Vector3d residual = predict(camera, p) - m.uvd;
  const Matrix36d J = pose_jacobian(projection_jacobian(camera, p), p);
  const Eigen::Vector3d information(m.pixel_information, m.pixel_information,
                                    with_depth ? m.disparity_information : 0);
  const Eigen::Matrix<double, 6, 3> jt_w = J.transpose() * (o.weight * information).asDiagonal();
  part.H += jt_w * J;
  part.g += jt_w * residual;
}

std::size_t part_of(const Camera& camera, const PoseObservation& o) {
  const auto part = [](float at, int size) {
    return std::clamp(static_cast<int>(kPartsPerSide * at / static_cast<float>(size)), 0,
                      kPartsPerSide - 1);
  };
  return static_cast<std::size_t>(kPartsPerSide * part(o.v, camera.height) +
                                  part(o.u, camera.width));
}

Parts parts_of(const Camera& camera, std::span<const PoseObservation> observations,
               const PoseSolution& solution) {
  const Pose T_camera_world = solution.T_world_camera.inverse();
  Parts parts;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (!solution.inlier[i]) continue;
    add(camera, T_camera_world, observations[i], solution.depth_inlier[i] > 0,
        parts.at(part_of(camera, observations[i])));
  }
  return parts;
}

/// Returns the jackknife variance of unit weight, the mean of all six directions, without a prior;
/// 0 if too few parts have inliers.
double jackknife_variance(const Parts& parts) {
  PartNormal all;
  int used = 0;
  for (const PartNormal& part : parts) {
    all.H += part.H;
    all.g += part.g;
    if (!part.empty()) ++used;
  }
  if (used < kMinParts) return 0;
  const Vector6d minimum = -all.H.ldlt().solve(all.g);
  double sum = 0;
  for (const PartNormal& part : parts) {
    if (part.empty()) continue;
    // From the minimum of all parts to that without this part.
    const Vector6d step = (all.H - part.H).ldlt().solve(part.g - all.g) - minimum;
    if (step.allFinite()) sum += step.dot(all.H * step);
  }
  return (used - 1) * sum / (6 * used);
}

}  // namespace

Matrix6d pose_covariance(const Camera& camera, std::span<const PoseObservation> observations,
                         const PoseSolution& solution) {
  const double variance = std::max(solution.rms * solution.rms,
                                   jackknife_variance(parts_of(camera, observations, solution)));
  return (1 + kLandmarkVariance) * variance * solution.information.inverse();
}

}  // namespace stillmap
