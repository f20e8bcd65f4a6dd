// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/trajectory.hpp"

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// Covariance of a pose; see UncertainPose::covariance.
struct StampedCovariance {
  double timestamp = 0;  ///< [s]
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/// Reads trajectory_covariance.txt of a run: lines of a timestamp and 21 numbers. Throws Error with
/// file and line for an invalid line, and for a file without lines.
std::vector<StampedCovariance> read_covariances(const std::filesystem::path& file);

/// Errors of poses e = (v, w) beside their covariances P. The normalized estimation error squared
/// (NEES) e' P^-1 e follows a chi-square distribution if the covariances are right (Bar-Shalom, Li,
/// Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 5.4.2).
struct CovarianceFigures {
  std::size_t poses = 0;         ///< Number of poses with a truth and a covariance.
  double nees = 0;               ///< Mean over the poses; 6 is expected.
  double nees_translation = 0;   ///< Mean, with the covariance of v alone; 3 is expected.
  double nees_rotation = 0;      ///< Mean, with the covariance of w alone; 3 is expected.
  double share_within_95 = 0;    ///< Share of poses whose NEES is below 12.59; 0.95 is expected.
  double translation_rmse = 0;   ///< RMS of |v| [m].
  double translation_sigma = 0;  ///< RMS of |v| that the covariances predict [m].
  double rotation_rmse = 0;      ///< RMS of |w| [rad].
  double rotation_sigma = 0;     ///< RMS of |w| that the covariances predict [rad].
};

/// Compares the errors of the poses with their covariances, after the alignment of least NEES. The
/// truth is interpolated at the timestamps of the estimate; covariances are
/// found by timestamp. Throws Error if no pose has both a truth and a covariance.
CovarianceFigures covariance_figures(const Trajectory& truth, const Trajectory& estimate,
                                     const std::vector<StampedCovariance>& covariances);

/// Returns the figures as a few lines of text.
std::string covariance_text(const CovarianceFigures& figures);

/// Writes all figures with units in the key names (for nlohmann::json).
void to_json(nlohmann::json& json, const CovarianceFigures& figures);

}  // namespace stillmap
