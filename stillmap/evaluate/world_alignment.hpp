// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate.hpp"
#include "stillmap/geometry/trajectory.hpp"

#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// Returns T_truth_estimate, the transform from the estimate's world to the truth's, from full
/// poses: it minimizes the sum of the squared distances of the positions [m^2] and of the chordal
/// distances of the rotations (Hartley et al., Rotation Averaging, IJCV 2013, section 5.3), where a
/// rotation by a small angle counts as much as a displacement of 1 m times the angle [rad]. Unlike
/// an alignment of positions it is well defined for a camera that is at rest or moves along a line.
/// Throws Error if no timestamps pair.
Pose align_poses(const Trajectory& truth, const Trajectory& estimate);

/// Alignment of the two world frames for maps and movers, which depend on the full rotation.
struct WorldAlignment {
  enum class By { kGiven, kPositions, kPoses };
  By by = By::kPositions;
  /// Transform from the estimate's world to the truth's; none if the positions do not determine the
  /// rotation and one of the files has no rotations.
  std::optional<Pose> T_truth_estimate;
  double position_rmse = 0, angle_rmse = 0;  ///< Residuals of kPoses [m], [rad].
  double rotation_of_positions = 0;  ///< Error of the rotation of an alignment by positions [rad].
};

/// Returns the alignment of the ATE or that of align_poses(), whose rotation is more certain. The
/// error of the first is estimated as the ATE over the distance of the true positions from their
/// main axis, that of the second as the residual of the rotations (all RMS). A camera at rest or on
/// a line is thus aligned by poses, and a truth with the rotations of another body by positions.
/// @param ate  ATE of the two trajectories after rigid alignment
WorldAlignment align_worlds(const Trajectory& truth, const Trajectory& estimate,
                            const AteResult& ate);

/// Returns the transform of an alignment. Throws Error if there is none.
const Pose& require_alignment(const WorldAlignment& alignment);

/// Returns a line that reports an alignment by poses; empty for other alignments.
std::string alignment_text(const WorldAlignment& alignment);

/// Writes `by` (given, positions, poses) and the residuals (for nlohmann::json).
void to_json(nlohmann::json& json, const WorldAlignment& alignment);

}  // namespace stillmap
