// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/world_alignment.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/evaluate/only_positions.hpp"
#include "stillmap/geometry/association.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

/// Displacement that counts as much as a rotation by one radian [m]: 1 cm counts as much as 0.6
/// degrees, about the ratio of the errors of RGB-D SLAM and of motion capture.
constexpr double kMetersPerRadian = 1;
/// Rotation error from which positions alone do not determine the rotation [rad]: 3 degrees
/// displace a point at 4 m by 0.2 m.
constexpr double kUndetermined = 0.05;

struct PosePair {
  Pose truth, estimate;
};

std::vector<PosePair> paired(const Trajectory& truth, const Trajectory& estimate) {
  const auto stamp = [](const StampedPose& pose) { return pose.timestamp; };
  std::vector<double> true_stamps(truth.size()), stamps(estimate.size());
  std::transform(truth.begin(), truth.end(), true_stamps.begin(), stamp);
  std::transform(estimate.begin(), estimate.end(), stamps.begin(), stamp);
  std::vector<PosePair> pairs;
  for (const auto& [i, j] : associate(true_stamps, stamps))
    pairs.push_back({truth[i].T_world_camera, estimate[j].T_world_camera});
  if (pairs.empty()) {
    throw Error("the true and the estimated poses have no stamp in common",
                "alignment of the trajectories", "check that both files are of one recording");
  }
  return pairs;
}

Pose aligned(const std::vector<PosePair>& pairs) {
  const auto n = static_cast<double>(pairs.size());
  Eigen::Vector3d mean_truth = Eigen::Vector3d::Zero(), mean_estimate = Eigen::Vector3d::Zero();
  for (const PosePair& pair : pairs) {
    mean_truth += pair.truth.translation() / n;
    mean_estimate += pair.estimate.translation() / n;
  }
  // |R_a - R R_b|^2 (Frobenius norm) is twice the squared angle between them, if it is small.
  constexpr double kWeight = kMetersPerRadian * kMetersPerRadian / 2;
  Eigen::Matrix3d W = Eigen::Matrix3d::Zero();
  for (const auto& [a, b] : pairs) {
    W += (a.translation() - mean_truth) * (b.translation() - mean_estimate).transpose();
    W += kWeight * a.rotation() * b.rotation().transpose();
  }
  const Eigen::Matrix3d R = nearest_rotation(W);
  return {R, mean_truth - R * mean_estimate};
}

/// Returns the error of the rotation about the main axis of the positions [rad]: the error of the
/// positions divided by their distance from this axis (both RMS).
double rotation_error(const AteResult& ate) {
  const auto n = static_cast<double>(ate.pairs.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const AtePair& pair : ate.pairs) mean += pair.p_truth / n;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const AtePair& pair : ate.pairs)
    covariance += (pair.p_truth - mean) * (pair.p_truth - mean).transpose() / n;
  const Eigen::Vector3d squares =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance, Eigen::EigenvaluesOnly)
          .eigenvalues()
          .cwiseMax(0);  // in increasing order
  const double distance = std::sqrt(squares(0) + squares(1));
  // Positions without error on a line do not determine this rotation; the bound avoids 0 / 0.
  constexpr double kLeast = 1e-6;  // [m]
  return std::max(ate.translation.rmse, kLeast) / std::max(distance, kLeast);
}

}  // namespace

Pose align_poses(const Trajectory& truth, const Trajectory& estimate) {
  return aligned(paired(truth, estimate));
}

WorldAlignment align_worlds(const Trajectory& truth, const Trajectory& estimate,
                            const AteResult& ate) {
  WorldAlignment alignment{.T_truth_estimate = ate.T_truth_estimate,
                           .rotation_of_positions = rotation_error(ate)};
  if (has_only_positions(truth, estimate)) {
    if (alignment.rotation_of_positions >= kUndetermined) alignment.T_truth_estimate.reset();
    return alignment;
  }
  const std::vector<PosePair> pairs = paired(truth, estimate);
  const Pose T = aligned(pairs);
  const auto n = static_cast<double>(pairs.size());
  double distances = 0, angles = 0;
  for (const PosePair& pair : pairs) {
    const Pose error = pair.truth.inverse() * (T * pair.estimate);
    distances += error.translation().squaredNorm() / n;
    angles += error.angle() * error.angle() / n;
  }
  alignment.position_rmse = std::sqrt(distances);
  alignment.angle_rmse = std::sqrt(angles);
  if (alignment.angle_rmse > alignment.rotation_of_positions) return alignment;
  alignment.by = WorldAlignment::By::kPoses;
  alignment.T_truth_estimate = T;
  return alignment;
}

const Pose& require_alignment(const WorldAlignment& alignment) {
  if (alignment.T_truth_estimate) return *alignment.T_truth_estimate;
  throw Error(
      "the positions of the camera do not determine the rotation of the map, and one of the files "
      "has no rotations",
      "alignment of the two worlds",
      "name a truth with rotations, or add --one-world if both have the same world frame");
}

std::string alignment_text(const WorldAlignment& alignment) {
  if (alignment.by != WorldAlignment::By::kPoses) return "";
  constexpr double kDegrees = 180 / std::numbers::pi;
  return fmt::format(
      "the following is aligned by whole poses, with differences of {:.4f} m and {:.2f} degrees "
      "(RMS); positions alone determine the rotation to {:.2g} degrees\n",
      alignment.position_rmse, kDegrees * alignment.angle_rmse,
      kDegrees * std::min(alignment.rotation_of_positions, std::numbers::pi));
}

void to_json(nlohmann::json& json, const WorldAlignment& alignment) {
  constexpr const char* kNames[] = {"given", "positions", "poses"};
  json = {{"by", kNames[static_cast<int>(alignment.by)]}};
  if (alignment.by != WorldAlignment::By::kPoses) return;
  json["position_rmse_m"] = alignment.position_rmse;
  json["angle_rmse_deg"] = alignment.angle_rmse * 180 / std::numbers::pi;
}

}  // namespace stillmap
