// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/motion/motion_cue.hpp"

#include <vector>

namespace stillmap {

struct ResidualCueOptions {
  /// Frames over which a keypoint's place is compared with where it was. Longer finds slower
  /// movers; a keypoint is not followed for ever.
  int baseline = 10;
  /// Of the camera's own way between the two [m]: what is near seems displaced by it.
  double pose_sigma = 0.01;
  /// Log-odds of a residual that fits perfectly. The density of a mover's residuals is taken as
  /// uniform, and so low that this is the ratio at 0.
  double at_best = 1.0;
  double at_worst = -4.0;  ///< log-odds of one that fits not at all: it may be a false match
};

/// Depth and flow against the camera's own motion: a keypoint followed from frame to frame is held
/// against the place in the world where it was some frames ago. With the residual e = (u, v, d) of
/// the observation model (d = bf / depth, observation_noise()) and its covariance S, that of both
/// measurements and of the camera's way between them,
///
///     log P(e | static) - log P(e | moving) = at_best - e' S^-1 e / 2,   not below at_worst,
///
/// a normal density against a uniform one. It speaks of the surface the keypoint lies on.
class ResidualCue : public MotionCue {
 public:
  explicit ResidualCue(const ResidualCueOptions& options) : options_(options) {}
  std::string_view name() const override { return "residual"; }
  bool provides_surface_evidence() const override { return true; }
  void add_to(MotionEvidence& evidence, const MotionInput& input) override;

 private:
  /// Where a followed keypoint was, once `baseline` frames ago or more, and once more recently.
  struct Trail {
    Eigen::Vector3f older, newer;  // world
    float older_scale = 0;         // of the keypoint's pyramid level there
    float newer_scale = 0;
    std::uint16_t age = 0;  // frames since `newer`
    bool valid = false;
  };

  Trail followed(const Trail& trail, const Eigen::Vector3f& p_world, float scale) const;
  float log_odds(const Trail& trail, const Keypoint& keypoint, const MotionInput& input,
                 const Pose& T_camera_world) const;

  ResidualCueOptions options_;
  std::vector<Trail> trails_;  // per keypoint of the frame before
};

}  // namespace stillmap
