// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/covariance_error.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/number.hpp"
#include "stillmap/evaluate/pose_at.hpp"
#include "stillmap/evaluate/world_alignment.hpp"
#include "stillmap/geometry/adjoint.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include <Eigen/Cholesky>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// Quantile of 95 % of the chi-square distribution with six degrees of freedom.
constexpr double kQuantile95 = 12.592;
/// Two stamps are those of one frame if they differ by less than half the last written digit [s].
constexpr double kSameStamp = 1e-6;

StampedCovariance parse_covariance(const std::string& line, const std::string& where) {
  std::istringstream in(line);
  StampedCovariance read;
  const auto take = [&](double& number) {
    std::string word;
    const auto value = in >> word ? number_of(word) : std::nullopt;
    number = value.value_or(0);
    return value && std::isfinite(number);
  };
  bool valid = take(read.timestamp);
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = row; column < 6; ++column) {
      double& value = read.covariance(row, column);
      valid = valid && take(value);
      read.covariance(column, row) = value;
    }
  }
  std::string rest;
  if (!valid || in >> rest)
    throw Error("is no line of a timestamp and 21 numbers", where,
                "name trajectory_covariance.txt of a run");
  return read;
}

/// Returns the covariance of a time; none if there is none, or it is not positive definite (that of
/// the first frame of a map is zero).
const StampedCovariance* covariance_at(const std::vector<StampedCovariance>& covariances,
                                       double timestamp) {
  const auto found = std::lower_bound(
      covariances.begin(), covariances.end(), timestamp - kSameStamp,
      [](const StampedCovariance& entry, double time) { return entry.timestamp < time; });
  if (found == covariances.end() || found->timestamp > timestamp + kSameStamp) return nullptr;
  return found->covariance.llt().info() == Eigen::Success ? &*found : nullptr;
}

/// An estimated and the true pose of one frame, with the covariance of the estimate.
struct CheckedPose {
  Pose T_world_camera, T_true;
  Matrix6d covariance;

  /// Returns the error (v, w): T_true = T_truth_estimate T_world_camera exp(v, w).
  Vector6d error(const Pose& T_truth_estimate) const {
    return ((T_truth_estimate * T_world_camera).inverse() * T_true).log();
  }
};

std::vector<CheckedPose> checked_poses(const Trajectory& truth, const Trajectory& estimate,
                                       const std::vector<StampedCovariance>& covariances) {
  std::vector<CheckedPose> poses;
  for (const auto& [timestamp, T_world_camera] : estimate) {
    const StampedCovariance* entry = covariance_at(covariances, timestamp);
    const auto T_true = pose_at(truth, timestamp);
    if (entry != nullptr && T_true) poses.push_back({T_world_camera, *T_true, entry->covariance});
  }
  return poses;
}

/// Returns the alignment of least sum of normalized squared errors, by Gauss-Newton from another
/// one: T_truth_estimate exp(x) changes the error of a pose by -Ad(T_world_camera^-1) x.
Pose refined_alignment(Pose T_truth_estimate, const std::vector<CheckedPose>& poses) {
  constexpr int kIterations = 5;
  for (int i = 0; i < kIterations; ++i) {
    Matrix6d H = Matrix6d::Zero();
    Vector6d b = Vector6d::Zero();
    for (const CheckedPose& pose : poses) {
      const Matrix6d J = adjoint(pose.T_world_camera.inverse());
      const Matrix6d J_information = pose.covariance.llt().solve(J).transpose();
      H += J_information * J;
      b += J_information * pose.error(T_truth_estimate);
    }
    T_truth_estimate = T_truth_estimate * Pose::exp(H.ldlt().solve(b));
  }
  return T_truth_estimate;
}

double rms(double sum_of_squares, std::size_t count) {
  return std::sqrt(sum_of_squares / static_cast<double>(count));
}

}  // namespace

std::vector<StampedCovariance> read_covariances(const std::filesystem::path& file) {
  std::istringstream in(read_file(file));
  std::vector<StampedCovariance> covariances;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    const auto first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#') continue;
    covariances.push_back(parse_covariance(line, fmt::format("{}:{}", file.string(), number)));
  }
  if (covariances.empty())
    throw Error("contains no covariance", file.string(), "name trajectory_covariance.txt of a run");
  std::stable_sort(covariances.begin(), covariances.end(),
                   [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; });
  return covariances;
}

CovarianceFigures covariance_figures(const Trajectory& truth, const Trajectory& estimate,
                                     const std::vector<StampedCovariance>& covariances) {
  const std::vector<CheckedPose> poses = checked_poses(truth, estimate, covariances);
  if (poses.empty()) {
    throw Error("no pose has a truth and a covariance at its timestamp", "covariances",
                "name the trajectory and trajectory_covariance.txt of one run");
  }
  const Pose T_truth_estimate = refined_alignment(align_poses(truth, estimate), poses);
  CovarianceFigures figures;
  figures.poses = poses.size();
  for (const CheckedPose& pose : poses) {
    const Matrix6d& P = pose.covariance;
    const Vector6d e = pose.error(T_truth_estimate);
    const double nees = e.dot(P.llt().solve(e));
    const Eigen::Vector3d v = e.head<3>(), w = e.tail<3>();
    const Eigen::Matrix3d P_v = P.topLeftCorner<3, 3>(), P_w = P.bottomRightCorner<3, 3>();
    figures.nees += nees;
    figures.nees_translation += v.dot(P_v.llt().solve(v));
    figures.nees_rotation += w.dot(P_w.llt().solve(w));
    figures.share_within_95 += nees < kQuantile95 ? 1 : 0;
    figures.translation_rmse += v.squaredNorm();
    figures.translation_sigma += P_v.trace();
    figures.rotation_rmse += w.squaredNorm();
    figures.rotation_sigma += P_w.trace();
  }
  for (double* mean :
       {&figures.nees, &figures.nees_translation, &figures.nees_rotation, &figures.share_within_95})
    *mean /= static_cast<double>(figures.poses);
  for (double* root : {&figures.translation_rmse, &figures.translation_sigma,
                       &figures.rotation_rmse, &figures.rotation_sigma})
    *root = rms(*root, figures.poses);
  return figures;
}

std::string covariance_text(const CovarianceFigures& f) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  return fmt::format(
      "covariances of {}: normalized error squared {:.2f} (6 expected), of the translation "
      "{:.2f}, of the rotation {:.2f} (3 expected each)\n"
      "  {:.1f} % of the poses within their 95 % region; translation {:.2f} mm predicted, {:.2f} "
      "mm measured; rotation {:.3f} deg predicted, {:.3f} deg measured (RMS)\n",
      counted(f.poses, "pose"), f.nees, f.nees_translation, f.nees_rotation,
      100 * f.share_within_95, 1000 * f.translation_sigma, 1000 * f.translation_rmse,
      kDegrees * f.rotation_sigma, kDegrees * f.rotation_rmse);
}

void to_json(nlohmann::json& json, const CovarianceFigures& f) {
  json = {{"poses", f.poses},
          {"nees", f.nees},
          {"nees_translation", f.nees_translation},
          {"nees_rotation", f.nees_rotation},
          {"share_within_95", f.share_within_95},
          {"translation_rmse_m", f.translation_rmse},
          {"translation_sigma_m", f.translation_sigma},
          {"rotation_rmse_rad", f.rotation_rmse},
          {"rotation_sigma_rad", f.rotation_sigma}};
}

}  // namespace stillmap
