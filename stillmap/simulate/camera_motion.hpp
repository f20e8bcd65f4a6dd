// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/simulate/scene.hpp"

#include <array>
#include <string>
#include <vector>

namespace stillmap {

struct CameraMotionOptions {
  /// static, xyz, halfsphere, rpy: the motions of TUM's dynamic sequences (Sturm et al., IROS
  /// 2012), at about their mean speeds (0.01, 0.2, 0.2, 0.1 m/s; 1, 5, 18, 20 deg/s); loop: carried
  /// around the room; follow: the same, looking at whoever walks ahead (activity "companion").
  std::string motion = "xyz";
  double speed = 1;                ///< factor on the motion's rate
  double shake_position = 0.0010;  ///< hand shake per axis, RMS [m]
  double shake_rotation = 0.0018;  ///< hand shake per axis, RMS [rad]
  int seed = 1;                    ///< of the hand shake
  STILLMAP_FIELDS(motion, speed, shake_position, shake_rotation, seed)
};

/// Names that CameraMotionOptions::motion may have.
const std::vector<std::string>& camera_motion_names();

/// The camera's path, as a smooth function of time.
class CameraMotion {
 public:
  /// Throws Error for an unknown motion.
  CameraMotion(const CameraMotionOptions& options, const Scene& scene);
  Pose T_world_camera(double seconds) const;

 private:
  /// Band-limited noise of unit RMS: sinusoids between 0.5 and 6 Hz, amplitude falling with
  /// frequency, as that of a steadied hand does.
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
  Viewpoint viewpoint_;
  Pose home_;
  std::array<Tremor, 6> tremor_;
  std::vector<Eigen::Vector2f> round_;
};

/// A camera at `position` that looks at `target`, its x axis level.
Pose look_at(const Eigen::Vector3d& position, const Eigen::Vector3d& target);

}  // namespace stillmap
