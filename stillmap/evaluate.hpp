// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"
#include "stillmap/geometry/trajectory.hpp"

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

/// The error figures of the TUM RGB-D benchmark: Sturm, Engelhard, Endres, Burgard, Cremers, A
/// Benchmark for the Evaluation of RGB-D SLAM Systems, IROS 2012, sections IV-C (relative pose
/// error, RPE) and IV-D (absolute trajectory error, ATE), computed by the rules of the benchmark's
/// own tools. Both trajectories contain T_world_camera, each in a world of its own, in meters and
/// seconds. Of several poses with the same timestamp the last counts.
namespace stillmap {

/// Summary statistics of a set of errors, in the unit of the errors; all zero for an empty set.
struct Statistics {
  double rmse = 0;
  double mean = 0;
  double median = 0;  ///< Median; the mean of the middle two if the count is even.
  double sd = 0;      ///< Population standard deviation (division by count).
  double min = 0;
  double max = 0;
  std::size_t count = 0;
};

/// Alignment of the absolute trajectory error.
struct AteOptions {
  /// Known transform from the estimate's world to the truth's; it replaces the alignment.
  std::optional<Pose> T_truth_estimate = std::nullopt;
  /// Aligns by a similarity, Sim(3): rotation, translation and scale. Excludes T_truth_estimate.
  bool with_scale = false;
};

/// A pose of the estimate with the true pose paired with it and their distance.
struct AtePair {
  double timestamp = 0;        ///< Timestamp of the estimate [s].
  double truth_timestamp = 0;  ///< Timestamp of the truth [s].
  Eigen::Vector3d p_truth;     ///< True position of the camera in the truth's world [m].
  Eigen::Vector3d p_estimate;  ///< Estimated position after alignment, in the truth's world [m].
  double error = 0;            ///< |p_estimate - p_truth| [m].
};

/// Absolute trajectory error.
struct AteResult {
  Statistics translation;      ///< Statistics of the errors [m].
  std::vector<AtePair> pairs;  ///< Pairs in order of the estimate's timestamps.
  Pose T_truth_estimate;       ///< Rigid transform from the estimate's world to the truth's.
  /// Factor on the estimate's positions before T_truth_estimate: 1 unless aligned with scale.
  double scale = 1;
};

/// Returns the absolute trajectory error: timestamps less than 0.02 s apart are associated (closest
/// pairs first, one to one), positions aligned by the rigid motion (Horn 1987), or similarity
/// (Umeyama 1991), that minimizes the squared distances, and the remaining distances are the
/// errors. Throws Error if a trajectory is empty, the time spans do not overlap (naming both) or
/// fewer than three pairs are found.
AteResult absolute_trajectory_error(const Trajectory& truth, const Trajectory& estimate,
                                    const AteOptions& options = {});

/// Distance between the two compared poses of the relative pose error: one second, or one pose of
/// the estimate.
enum class RpeDelta { kSecond, kFrame };

/// Difference between the estimated and the true motion between two poses of the estimate.
struct RpePair {
  double timestamp = 0;      ///< Timestamp of the earlier pose [s].
  double end_timestamp = 0;  ///< Timestamp of the later pose [s].
  double translation = 0;    ///< Length of the error's translation [m].
  double rotation = 0;       ///< Angle of the error's rotation [degrees].
};

/// Relative pose error.
struct RpeResult {
  Statistics translation;      ///< Statistics of the translation errors [m].
  Statistics rotation;         ///< Statistics of the rotation errors [degrees].
  std::vector<RpePair> pairs;  ///< Pairs in order of their timestamps.
};

/// Returns the relative pose error over a fixed delta: for each pose i of the estimate, j is the
/// pose nearest to t_i + delta, and the pair counts unless j is the last pose. Each timestamp is
/// mapped to the nearest one of the truth; the pair is dropped if that is further away than twice
/// the truth's median interval. With A = gt_j^-1 gt_i and B = est_j^-1 est_i the error is
/// E = B^-1 A: the length of its translation and the angle of its rotation,
/// arccos((trace R - 1) / 2). The nearest timestamp is found by bisection, and of equally near ones
/// the first visited wins, as in the benchmark's own tool. Throws Error if a trajectory has fewer
/// than two poses or no pair is left.
RpeResult relative_pose_error(const Trajectory& truth, const Trajectory& estimate,
                              RpeDelta delta = RpeDelta::kSecond);

}  // namespace stillmap
