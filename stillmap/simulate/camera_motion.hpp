// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"
#include "stillmap/simulate/recorded_path.hpp"
#include "stillmap/simulate/scene.hpp"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

struct CameraMotionOptions {
  /// Motion: static, xyz, halfsphere, rpy as in TUM's dynamic sequences (Sturm et al., IROS 2012),
  /// at about their mean speeds (0.01, 0.2, 0.2, 0.1 m/s; 1, 5, 18, 20 deg/s); loop: around the
  /// room; follow: likewise, facing the person ahead (activity "companion"); trolley: below the
  /// trolley of the yard's crane, with a third of the shake, as of its motors. Else the file of a
  /// recorded trajectory, whose first pose is that of the other motions, without shake.
  std::string motion = "xyz";
  double speed = 1;                ///< Factor on the speed of the motion.
  double shake_position = 0.0010;  ///< RMS hand shake per axis [m].
  double shake_rotation = 0.0018;  ///< RMS hand shake per axis [rad].
  int seed = 1;                    ///< Seed of the hand shake.
};

/// Returns the names for CameraMotionOptions::motion.
const std::vector<std::string>& camera_motion_names();

/// Camera path as a smooth function of time.
class CameraMotion {
 public:
  /// Throws Error for a motion that is neither known nor a file, as read_path(), and for that of a
  /// trolley in a scene without one.
  CameraMotion(const CameraMotionOptions& options, const Scene& scene);
  Pose T_world_camera(double seconds) const;
  /// Returns how long the motion lasts [s]; none for one without end.
  std::optional<double> duration() const;

 private:
  /// Band-limited noise of unit RMS: sinusoids between 0.5 and 6 Hz with falling amplitude, as of a
  /// steadied hand.
  struct Tremor {
    struct Wave {
      double amplitude, frequency, phase;  // -, rad/s, rad
    };
    std::array<Wave, 12> waves;
    double at(double seconds) const;
  };

  Pose steady(double seconds) const;
  Pose half_sphere(double seconds) const;
  Pose loop(double seconds) const;
  Pose follow(double seconds) const;

  CameraMotionOptions options_;
  CameraAnchor viewpoint_;
  Pose home_;
  std::array<Tremor, 6> tremor_;
  std::vector<Eigen::Vector2f> round_;
  std::optional<Trolley> trolley_;
  std::optional<simulate::RecordedPath> recorded_;
};

/// Returns the pose of a camera at `position` that faces `target` with a level x axis.
Pose look_at(const Eigen::Vector3d& position, const Eigen::Vector3d& target);

}  // namespace stillmap
