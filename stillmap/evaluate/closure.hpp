// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/trajectory_error.hpp"

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// Closure error of a camera that returns to its start, as in the crane experiment of
/// SLAM3-YOLOv8 (section 4.5): distance between the ends of the estimated path, less that between
/// the ends of the true one, which need not be closed exactly.
struct ClosureError {
  double space = 0;          ///< Closure error in space [m].
  double plane = 0;          ///< Its horizontal part; z of the truth's world points up [m].
  double path = 0;           ///< Length of the true path [m].
  double path_in_plane = 0;  ///< Length of the horizontal part of the true path [m].
  /// Returns an error as a share of the length of its path [%]; 0 for a path of length 0.
  double space_percent() const;
  double plane_percent() const;
};

/// Returns the closure error of an aligned estimate: the difference between the estimated and the
/// true displacement from the first to the last tracked frame. The length of the path is that of
/// the truth between them, sampled at the poses of the estimate.
/// Throws Error if there are fewer than two pairs of poses.
ClosureError closure_error(const AteResult& ate);

/// Returns a line of text, or two with the figures in the plane.
std::string closure_text(const ClosureError& error, bool planar);

/// Writes the figures in meters and percent (for nlohmann::json).
void to_json(nlohmann::json& json, const ClosureError& error);

}  // namespace stillmap
