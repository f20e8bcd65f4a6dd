// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/optimize/residual.hpp"

#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// Observation of landmark `point` by keyframe `pose` (indices into the problem's vectors).
struct BundleObservation {
  std::uint32_t pose = 0, point = 0;
  float u = 0, v = 0;  ///< Keypoint position [pixels].
  float depth = 0;     ///< Depth along the optical axis [m]; 0 or not finite: unknown.
  float scale = 1;     ///< Scale of the keypoint's pyramid level, scale_factor^level.
  /// Probability of being static [0..1], multiplies the information; 0: ignored.
  float weight = 1;
};

struct BundleProblem {
  Camera camera;
  std::vector<Pose> T_world_camera;       ///< Initial poses.
  std::vector<std::uint8_t> pose_fixed;   ///< One per pose; at least one must be set.
  std::vector<Eigen::Vector3d> points;    ///< Initial positions in the world frame [m].
  std::vector<std::uint8_t> point_fixed;  ///< One per point, or empty: all free.
  std::vector<BundleObservation> observations;
};

struct BundleResult {
  std::vector<Pose> T_world_camera;     ///< One per pose; fixed poses are returned bit-exactly.
  std::vector<Eigen::Vector3d> points;  ///< One per point, world frame [m].
  /// One per observation: the pixel disagrees or the observation is unusable; remove the match.
  std::vector<std::uint8_t> pixel_outlier;
  /// One per observation: it has a depth that disagrees or belongs to an outlier pixel; ignore the
  /// depth.
  std::vector<std::uint8_t> depth_outlier;
  double cost_before = 0, cost_after = 0;  ///< Half the sum of robust squared residuals [sigma^2].
  int iterations = 0;                      ///< Number of iterations of both passes.
  bool interrupted = false;  ///< Whether `stop` returned true; the result is then the best so far.
  double setup_ms = 0, robust_ms = 0, plain_ms = 0;
};

/// Called between iterations, in the calling thread; returns true to stop early.
using StopRequest = std::function<bool()>;

/// Bundle adjustment: minimizes the residuals of residual.hpp over poses and points, first with
/// robust kernels for pixel and disparity, then by plain least squares on the inliers. Points are
/// eliminated by the Schur complement (Triggs et al., Bundle Adjustment: A Modern Synthesis, 2000).
/// Deterministic and single-threaded: equal input gives equal bits. Poses and points without usable
/// observations stay unchanged. Throws Error if sizes or indices are inconsistent, if a pose is not
/// finite, or if no pose is fixed (the gauge would be free).
BundleResult adjust_bundle(const BundleProblem& problem, const StopRequest& stop = {});

}  // namespace stillmap
