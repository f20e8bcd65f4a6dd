// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/optimize/residual.hpp"

#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// Keyframe `pose` sees landmark `point` (indices into the problem's vectors).
struct BundleObservation {
  std::uint32_t pose = 0, point = 0;
  float u = 0, v = 0;  ///< [pixels]
  float depth = 0;     ///< along the optical axis [m]; 0 or not finite: none
  float scale = 1;     ///< of the keypoint's pyramid level, scale_factor^level
  float weight =
      1;  ///< probability of standing still, 0 to 1, multiplies the information; 0: ignored
};

struct BundleProblem {
  Camera camera;
  std::vector<Pose> T_world_camera;       ///< first guesses
  std::vector<std::uint8_t> pose_fixed;   ///< one per pose; at least one must be set
  std::vector<Eigen::Vector3d> points;    ///< first guesses, world frame [m]
  std::vector<std::uint8_t> point_fixed;  ///< one per point, or empty: all free
  std::vector<BundleObservation> observations;
};

struct BundleOptions {
  ObservationNoise noise{};
  int robust_iterations = 5;  ///< at most, with Huber's kernels, all observations
  int plain_iterations =
      10;  ///< at most, then, plain least squares on the inliers; 0: leave that pass out
  double cost_tolerance =
      1e-6;  ///< a pass ends when a step lowers the cost by less than this share
  double pixel_chi2 = kPixelChi2;          ///< inlier bound of the pixel part [sigma^2]
  double disparity_chi2 = kDisparityChi2;  ///< inlier bound of the disparity part [sigma^2]
  STILLMAP_FIELDS(noise, robust_iterations, plain_iterations, cost_tolerance, pixel_chi2,
                  disparity_chi2)
};

struct BundleResult {
  std::vector<Pose> T_world_camera;     ///< one per pose; fixed ones as given, to the bit
  std::vector<Eigen::Vector3d> points;  ///< one per point
  /// One per observation: the pixel does not agree (or the observation was unusable): drop the
  /// match.
  std::vector<std::uint8_t> pixel_outlier;
  /// One per observation: it has a depth that does not agree, or whose pixel does not: ignore the
  /// depth.
  std::vector<std::uint8_t> depth_outlier;
  double cost_before = 0, cost_after = 0;  ///< half the sum of robust squared residuals [sigma^2]
  int iterations = 0;                      ///< both passes together
  bool interrupted = false;                ///< `stop` answered true; the result is the best so far
  double setup_ms = 0, robust_ms = 0, plain_ms = 0;
};

/// Asked between iterations whether to end early. May be called from the calling thread only.
using StopRequest = std::function<bool()>;

/// Poses and points that together fit the observations best, least squares in the residuals of
/// residual.hpp: first with a robust kernel each for pixel and disparity, then plain on the
/// inliers. Points are eliminated first (Schur complement; Triggs et al., Bundle Adjustment: A
/// Modern Synthesis, 2000). Deterministic, single-threaded: equal input gives equal bits, however
/// many cores there are. Poses and points without usable observations come back as they were.
/// Throws Error if sizes or indices do not fit together, if a pose is not finite, or if no pose is
/// fixed (the world frame would be free to drift).
BundleResult adjust_bundle(const BundleProblem& problem, const BundleOptions& options = {},
                           const StopRequest& stop = {});

}  // namespace stillmap
