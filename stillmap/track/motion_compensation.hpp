// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/features.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/optimize/residual.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

namespace stillmap {

/// Depth assumed for the translation of a pixel without depth [m]. Rotation needs none.
inline constexpr double kTypicalDepth = 2;

/// Maps a point of the camera frame `dt` [s] after a moment to the camera frame of that moment:
/// exp(xi dt) p to second order, for the velocity xi = (v, w) of the camera in its own frame [m/s,
/// rad/s]. The next term is below 0.1 pixels at 3 rad/s and 20 ms.
template <typename Scalar>
Eigen::Vector3<Scalar> moved_point(const Eigen::Vector3<Scalar>& p, Scalar dt,
                                   const Eigen::Vector3<Scalar>& v,
                                   const Eigen::Vector3<Scalar>& w) {
  const Eigen::Vector3<Scalar> velocity = v + w.cross(p);
  return p + dt * velocity + Scalar(0.5) * dt * dt * w.cross(velocity);
}

/// Removes the effects of the camera's motion during the exposure of a frame.
///
/// Row v of an image of height h is exposed (v / h - 1/2) * readout after the middle of the image.
/// A point p in the camera frame of that moment is at exp(xi dt) p in the camera frame of the
/// timestamp, for the twist xi of the camera. The depth of a keypoint is read where its point lies
/// in the depth image, which is exposed at another time.
class MotionCompensation {
 public:
  /// @param twist velocity (v, w) of the camera in its own frame [m/s, rad/s]
  MotionCompensation(const RgbdFrame& image, const Camera& camera, const Vector6d& twist)
      : image_(image), camera_(camera), v_(twist.head<3>()), w_(twist.tail<3>()) {}

  /// Returns whether keypoints change at all: not for a global shutter and depth of the same time.
  bool has_effect(const ShutterTiming& timing) const {
    return timing.readout != 0 || image_.depth_delay + timing.depth_delay != 0;
  }

  /// Returns a recorded keypoint as a camera would observe it that exposes all rows of the color
  /// and the depth image at the timestamp of the frame.
  Keypoint keypoint(const Keypoint& recorded, const ShutterTiming& timing) const;
  Features features(const Features& recorded, const ShutterTiming& timing) const;

  /// Returns the root mean square distance by which keypoints are moved [pixels].
  double rms(const Features& recorded, const ShutterTiming& timing) const;

 private:
  Eigen::Vector3d at_moment(const Eigen::Vector3d& p, double dt) const;
  double depth_seen_from(const Eigen::Vector3d& p, double depth_delay) const;

  const RgbdFrame& image_;
  const Camera& camera_;
  Eigen::Vector3d v_, w_;
};

}  // namespace stillmap
