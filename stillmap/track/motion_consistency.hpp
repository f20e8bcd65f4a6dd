// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/trajectory.hpp"

#include <optional>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// Recognizes poses that contradict the motion of the camera before them, such as one that people
/// in front of the camera drag along for a moment.
///
/// A pose is compared with that of constant velocity. The squared difference over its covariance is
/// compared with the median of the last seconds, in which the accelerations of the camera are
/// contained.
class MotionConsistency {
 public:
  /// Adds the next pose. Returns its covariance, enlarged so that the pose agrees with the motion,
  /// or none if it agrees.
  std::optional<Eigen::Matrix<double, 6, 6>> contradiction(const UncertainPose& pose);

  /// Moves the earlier poses along with a correction of the map.
  void move(const Pose& T_corrected_world);
  /// Forgets the motion: the next pose is in another world.
  void reset();

 private:
  void follow(const UncertainPose& pose);

  std::optional<UncertainPose> last_;                 // the last one that agreed, or its prediction
  std::optional<Eigen::Matrix<double, 6, 1>> twist_;  // [m/s, rad/s]
  std::vector<double> chi2_;                          // of the last poses, the newest last
  int contradictions_ = 0;                            // without a pose that agrees between them
};

}  // namespace stillmap
