// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/motion/motion_cue.hpp"

#include <vector>

namespace stillmap {

/// Residuals of depth and flow under the camera's own motion: the position of a tracked keypoint is
/// compared with its position some frames ago. With the residual e = (u, v, d) of the
/// observation model (d = bf / depth, observation_noise()) and its covariance S, that of both
/// measurements and of the camera's motion between them,
///
///     log P(e | static) - log P(e | moving) = max(kBestLogOdds - e' S^-1 e / 2, kWorstLogOdds),
///
/// a normal density against a uniform one. The evidence counts for the surface of the keypoint.
class ResidualCue : public MotionCue {
 public:
  /// Standard deviation of the camera's motion between the two frames [m]; chosen on simulated
  /// scenes.
  static constexpr double kPoseSigma = 0.01;
  /// Log-odds of a residual of 0. The density of a mover's residuals is taken as uniform, and so
  /// low that this is the ratio at 0; chosen on simulated scenes.
  static constexpr double kBestLogOdds = 1.0;

  std::string_view name() const override { return "residual"; }
  bool provides_surface_evidence() const override { return true; }
  void add_to(MotionEvidence& evidence, const MotionInput& input) override;

 private:
  /// Two earlier positions of a tracked keypoint, the older one at least kBaseline frames ago.
  struct Trail {
    Eigen::Vector3f older, newer;  // odometry frame [m]
    float older_scale = 0;         // scale of the keypoint's pyramid level there
    float newer_scale = 0;
    std::uint16_t age = 0;  // number of frames since `newer`
    bool valid = false;
  };

  static Trail extended(const Trail& trail, const Eigen::Vector3f& p_odometry, float scale);
  static float log_odds(const Trail& trail, const Keypoint& keypoint, const MotionInput& input,
                        const Pose& T_camera_odometry);

  std::vector<Trail> trails_;  // per keypoint of the previous frame
};

}  // namespace stillmap
