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
/// error, RPE) and IV-D (absolute trajectory error, ATE), with the rules of the tools that the
/// benchmark's figures are made with. Both trajectories hold T_world_camera, each in a world of its
/// own, meters and seconds. Of several poses with the same stamp the last counts.
namespace stillmap {

/// How much of a sequence was tracked. An error without it is worthless: lost frames have none.
struct Coverage {
  std::size_t tracked = 0;  ///< distinct stamps in the estimate
  std::size_t total = 0;    ///< frames of the sequence
  bool estimated = false;   ///< total was not known but reckoned from the truth's time span
  /// tracked / total, at most 1; 0 for an empty sequence.
  double share() const;
};

/// Coverage of a sequence of known length (frames handed to the tracker, skipped ones included).
Coverage compute_coverage(const Trajectory& estimate, std::size_t total_frames);

/// Coverage where the number of frames is unknown: as many frames as fit into the truth's time span
/// at the estimate's median interval, round(span / interval) + 1, and never fewer than were
/// tracked. It reads too low where the truth begins before or ends after the images do; hence
/// `estimated`.
Coverage estimate_coverage(const Trajectory& estimate, const Trajectory& truth);

struct AteOptions {
  double max_difference = 0.02;  ///< stamps this far apart or further do not pair [s]
  /// Estimate's world to truth's world, where that is known; nothing is aligned then.
  std::optional<Pose> T_truth_estimate = std::nullopt;
  /// Aligns by a similarity, Sim(3): rotation, translation and scale. Not with T_truth_estimate.
  bool with_scale = false;
};

/// A pose of the estimate, the pose of the truth paired with it, and how far apart they are.
struct AtePair {
  double timestamp = 0;        ///< the estimate's [s]
  double truth_timestamp = 0;  ///< the truth's [s]
  Eigen::Vector3d p_truth;     ///< true position of the camera, truth's world [m]
  Eigen::Vector3d p_estimate;  ///< estimated position after alignment, truth's world [m]
  double error = 0;            ///< |p_estimate - p_truth| [m]
};

/// Absolute trajectory error.
struct AteResult {
  Statistics translation;      ///< [m]
  std::vector<AtePair> pairs;  ///< by the estimate's stamp
  Pose T_truth_estimate;       ///< the rigid alignment: estimate's world to truth's world
  /// Factor on the estimate's positions before T_truth_estimate: 1 unless aligned with scale.
  double scale = 1;
};

/// Absolute trajectory error: stamps are associated (closest pairs first, one to one), positions
/// aligned by the rigid motion (Horn 1987), or similarity (Umeyama 1991), that minimizes the
/// squared distances, and the distances that remain are the errors. Throws Error where a trajectory
/// is empty, the time spans do not overlap (naming both) or fewer than three pairs are found.
AteResult absolute_trajectory_error(const Trajectory& truth, const Trajectory& estimate,
                                    const AteOptions& options = {});

enum class DeltaUnit { kSeconds, kFrames };

struct RpeOptions {
  double delta = 1;                      ///< distance between the two poses compared
  DeltaUnit unit = DeltaUnit::kSeconds;  ///< what delta counts: seconds, or poses of the estimate
};

/// The motion between two poses of the estimate against the true motion between them.
struct RpePair {
  double timestamp = 0;      ///< of the earlier pose [s]
  double end_timestamp = 0;  ///< of the later pose [s]
  double translation = 0;    ///< [m]
  double rotation = 0;       ///< [degrees]
};

/// Relative pose error.
struct RpeResult {
  Statistics translation;      ///< [m]
  Statistics rotation;         ///< [degrees]
  std::vector<RpePair> pairs;  ///< by stamp
};

/// Relative pose error over a fixed delta: for each pose i of the estimate, j is the pose nearest
/// to t_i + delta, and the pair counts unless j is the last pose. Each stamp is mapped to the
/// truth's nearest; the pair is dropped where that is further away than twice the truth's median
/// interval. With A = gt_j^-1 gt_i and B = est_j^-1 est_i the error is E = B^-1 A: its
/// translation's length and its rotation's angle, arccos((trace R - 1) / 2). "Nearest" is found by
/// halving the range, and of equally near stamps the one met first wins, as in the benchmark's own
/// tool. Throws Error where a trajectory has fewer than two poses or no pair is left.
RpeResult relative_pose_error(const Trajectory& truth, const Trajectory& estimate,
                              const RpeOptions& options = {});

/// The motion of the camera from each frame to the next against the true one: the figure for
/// jitter.
struct DisplacementResult {
  Statistics error;  ///< |estimated - true displacement| in the truth's world [m]
  Statistics truth;  ///< true displacement from frame to frame [m]
  Statistics
      estimate;  ///< estimated displacement from frame to frame [m]; its max is the largest step
  double largest_step_at = 0;  ///< timestamp of the frame after the largest estimated step [s]
};

/// Displacement error from frame to frame: the estimate is rotated into the truth's world, the
/// truth interpolated at its timestamps, so that the error is not that of pairing stamps. Two poses
/// of the estimate count as successive frames if they are at most 1.5 median intervals apart.
/// Everything is zero where no pair of frames has true poses.
/// @param T_truth_estimate alignment of the two worlds, as found by the ATE
DisplacementResult displacement_error(const Trajectory& truth, const Trajectory& estimate,
                                      const Pose& T_truth_estimate);

/// What `stillmap eval` computes besides the ATE and the RPE over one second.
struct EvaluationOptions {
  /// Number of frames of the sequence, for the coverage; estimated if unknown.
  std::optional<std::size_t> total_frames = std::nullopt;
  bool per_frame = false;   ///< Also the RPE from frame to frame.
  bool with_scale = false;  ///< Also the ATE after alignment by a similarity.
  AteOptions ate = {};
};

/// All that `stillmap eval` shows of one run.
struct Evaluation {
  AteResult ate;
  std::optional<AteResult> ate_with_scale;  ///< after alignment by a similarity, where asked for
  DisplacementResult displacement;
  RpeResult rpe;  ///< over one second; without pairs where no two poses are that far apart
  std::optional<RpeResult> rpe_frame;  ///< per frame, where asked for
  Coverage coverage;
};

/// Returns ATE, RPE over one second, displacement error and coverage, and the figures asked for.
/// Throws Error as the two errors do, but not for a recording shorter than a second.
Evaluation evaluate_trajectory(const Trajectory& truth, const Trajectory& estimate,
                               const EvaluationOptions& options = {});

/// The evaluation as a text table: one line per error, one column per statistic; coverage beneath.
std::string evaluation_text(const Evaluation& evaluation);

/// For nlohmann::json: numbers in meters, degrees and seconds, units in the key names; rpe_1s is
/// null where there are no pairs. AteResult
/// and RpeResult give statistics and pair counts, not the pairs themselves.
void to_json(nlohmann::json& json, const Coverage& coverage);
void to_json(nlohmann::json& json, const AteResult& ate);
void to_json(nlohmann::json& json, const RpeResult& rpe);
void to_json(nlohmann::json& json, const DisplacementResult& displacement);
void to_json(nlohmann::json& json, const Evaluation& evaluation);

}  // namespace stillmap
