// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/statistics.hpp"
#include "stillmap/geometry/trajectory.hpp"

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

/// The error figures of the TUM RGB-D benchmark: Sturm, Engelhard, Endres, Burgard, Cremers, A
/// Benchmark for the Evaluation of RGB-D SLAM Systems, IROS 2012, sections IV-C (relative pose
/// error, RPE) and IV-D (absolute trajectory error, ATE), computed by the rules of the benchmark's
/// own tools. Both trajectories contain T_world_camera, each in a world of its own, in meters and
/// seconds. Of several poses with the same timestamp the last counts.
namespace stillmap {

/// Tracked share of a sequence. An error means little without it, since lost frames have no error.
struct Coverage {
  std::size_t tracked = 0;  ///< Number of distinct timestamps in the estimate.
  std::size_t total = 0;    ///< Number of frames of the sequence.
  bool estimated = false;   ///< The total was unknown and estimated from the truth's time span.
  /// Returns tracked / total, at most 1; 0 for an empty sequence.
  double share() const;
};

/// Returns the coverage of a sequence of known length, which includes skipped frames.
Coverage compute_coverage(const Trajectory& estimate, std::size_t total_frames);

/// Returns the coverage of a sequence of unknown length. The length is estimated from the truth's
/// time span and the estimate's median interval, round(span / interval) + 1, and is at least the
/// number of tracked frames. The coverage is too low if the truth begins before the images or ends
/// after them, hence `estimated`.
Coverage estimate_coverage(const Trajectory& estimate, const Trajectory& truth);

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

/// Error of the camera's displacement from each frame to the next, which measures jitter.
struct DisplacementResult {
  Statistics error;  ///< |estimated - true displacement| in the truth's world [m].
  Statistics truth;  ///< True displacement from frame to frame [m].
  /// Estimated displacement from frame to frame [m]; its maximum is the largest step.
  Statistics estimate;
  double largest_step_at = 0;  ///< Timestamp of the frame after the largest estimated step [s].
};

/// Returns the displacement error from frame to frame. The estimate is rotated into the truth's
/// world and the truth interpolated at its timestamps, so that the error contains none from the
/// association of timestamps. Two poses of the estimate count as successive frames if they are at
/// most 1.5 median intervals apart. All figures are zero if no pair of frames has true poses.
/// @param T_truth_estimate alignment of the two worlds, as found by the ATE
DisplacementResult displacement_error(const Trajectory& truth, const Trajectory& estimate,
                                      const Pose& T_truth_estimate);

/// Options of evaluate_trajectory().
struct EvaluationOptions {
  /// Number of frames of the sequence, for the coverage; estimated if unknown.
  std::optional<std::size_t> total_frames = std::nullopt;
  bool per_frame = false;   ///< Computes the RPE from frame to frame as well.
  bool with_scale = false;  ///< Computes the ATE after alignment by a similarity as well.
  AteOptions ate = {};
};

/// Figures of one run, as `stillmap eval` shows them.
struct Evaluation {
  AteResult ate;
  std::optional<AteResult> ate_with_scale;  ///< ATE after alignment by a similarity, if requested.
  DisplacementResult displacement;
  RpeResult rpe;  ///< RPE over one second; without pairs if the estimate is shorter than that.
  std::optional<RpeResult> rpe_frame;  ///< RPE from frame to frame, if requested.
  Coverage coverage;
};

/// Returns ATE, RPE over one second, displacement error and coverage, and the requested figures.
/// Throws Error as absolute_trajectory_error() and relative_pose_error() do, but not for a
/// recording shorter than one second.
Evaluation evaluate_trajectory(const Trajectory& truth, const Trajectory& estimate,
                               const EvaluationOptions& options = {});

/// Returns a text table with one line per error and one column per statistic, and the coverage
/// below.
std::string evaluation_text(const Evaluation& evaluation);

/// Writes the figures in meters, degrees and seconds, with units in the key names (for
/// nlohmann::json). rpe_1s is null if there are no pairs. AteResult and RpeResult give statistics
/// and the number of pairs, not the pairs themselves.
void to_json(nlohmann::json& json, const Coverage& coverage);
void to_json(nlohmann::json& json, const AteResult& ate);
void to_json(nlohmann::json& json, const RpeResult& rpe);
void to_json(nlohmann::json& json, const DisplacementResult& displacement);
void to_json(nlohmann::json& json, const Evaluation& evaluation);

}  // namespace stillmap
