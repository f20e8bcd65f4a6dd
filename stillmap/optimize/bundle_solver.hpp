// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/optimize/bundle_adjustment.hpp"
#include "stillmap/optimize/normal_equations.hpp"

#include <cstdint>
#include <vector>

/// The minimizer behind adjust_bundle(): internal to the module.
namespace stillmap {

/// One usable observation, in terms of T_camera_world.
struct BundleTerm {
  std::uint32_t pose = 0, point = 0;
  std::uint32_t observation = 0;  ///< Index into the problem's list
  Measurement measurement;
  double weight = 1;
  Parts parts;  ///< Parts that are used in the next pass.
};

/// The constant part of the problem.
struct BundleModel {
  Camera camera;
  std::vector<BundleTerm> terms;         ///< Sorted by point, then pose, then observation.
  std::vector<std::uint8_t> pose_free;   ///< Whether a pose is optimized and has a term.
  std::vector<std::uint8_t> point_free;  ///< Whether a point is optimized and has a term.
};

/// The optimized variables.
struct BundleState {
  std::vector<Pose> T_camera_world;
  std::vector<Eigen::Vector3d> points;
};

/// End of the two passes of bundle adjustment; tests iterate further to compare minima.
struct BundleLimits {
  /// Maximum number of iterations of the first pass, with Huber kernels on all observations (as in
  /// ORB-SLAM2).
  int robust_iterations = 5;
  /// Maximum number of iterations of the second pass, plain least squares on the inliers (as in
  /// ORB-SLAM2).
  int plain_iterations = 10;
  /// A pass ends when a step reduces the cost by less than this ratio.
  double cost_tolerance = 1e-6;
};

/// Kernels and end of one pass.
struct PassLimits {
  Kernels kernels;
  int iterations;         ///< Maximum number of iterations.
  double cost_tolerance;  ///< See BundleLimits.
};

struct PassSummary {
  int iterations = 0;
  bool interrupted = false;
};

/// Returns half the sum of (robust) squared residuals [sigma^2].
double bundle_cost(const BundleModel& model, const BundleState& state, const Kernels& kernels);

/// Levenberg-Marquardt on the Schur complement (schur_solver.cpp).
PassSummary minimize_with_schur(const BundleModel& model, const PassLimits& limits,
                                const StopRequest& stop, BundleState& state);

/// Minimizes one pass, starting from `state`, which holds the result afterwards.
using BundleMinimizer = PassSummary (*)(const BundleModel& model, const PassLimits& limits,
                                        const StopRequest& stop, BundleState& state);

/// adjust_bundle() with another minimizer, for comparison in tests and benchmarks.
BundleResult adjust_bundle_with(BundleMinimizer minimize, const BundleProblem& problem,
                                const BundleLimits& limits, const StopRequest& stop = {});

}  // namespace stillmap
