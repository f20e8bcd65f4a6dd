// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>

namespace stillmap {

/// The way of a bridge crane's trolley: along the bridge (x), then with the bridge along the rails
/// (y), back along the bridge, and back along the rails, so that a rectangle is closed. Every side
/// starts and ends at rest; after one round the trolley stays at its start.
struct Trolley {
  Eigen::Vector3d start;  ///< Position at time 0 [m].
  double bridge = 3;      ///< Signed length of the way along the bridge [m].
  double rails = 4;       ///< Signed length of the way along the rails [m].
  double speed = 0.4;     ///< Mean speed on a side [m/s].

  /// Returns the position at a time [s]; the start before time 0.
  Eigen::Vector3d at(double seconds) const;
  /// Returns the duration of one round [s].
  double round() const;
};

}  // namespace stillmap
