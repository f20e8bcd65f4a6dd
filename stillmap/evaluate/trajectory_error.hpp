// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate.hpp"
#include "stillmap/evaluate/statistics.hpp"
#include "stillmap/evaluate/world_alignment.hpp"
#include "stillmap/geometry/trajectory.hpp"

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

/// Further figures of a run, and their texts; see stillmap/evaluate.hpp.
namespace stillmap {

/// Returns the poses in order of their timestamps; of several poses with one timestamp the last.
Trajectory one_pose_per_stamp(Trajectory trajectory);

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
  WorldAlignment world;                     ///< Alignment of maps and movers.
  std::optional<AteResult> ate_with_scale;  ///< ATE after alignment by a similarity, if requested.
  DisplacementResult displacement;
  RpeResult rpe;  ///< RPE over one second; without pairs if the estimate is shorter than that.
  std::optional<RpeResult> rpe_frame;  ///< RPE from frame to frame, if requested.
  bool only_positions = false;         ///< has_only_positions(); then there is no RPE.
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
