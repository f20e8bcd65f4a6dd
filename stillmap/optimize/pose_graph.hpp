// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/geometry/pose.hpp"

#include <cstdint>
#include <vector>

namespace stillmap {

/// "From a, b is seen at T_a_b": indices into the problem's poses.
struct PoseGraphEdge {
  std::uint32_t a = 0, b = 0;
  Pose T_a_b;
  double weight = 1;  ///< multiplies the information
};

struct PoseGraphProblem {
  std::vector<Pose> T_world_node;    ///< first guesses
  std::vector<std::uint8_t> fixed;   ///< one per node; at least one must be set
  std::vector<PoseGraphEdge> edges;  ///< every node must hang on a fixed one by some way
};

struct PoseGraphOptions {
  double translation_sigma = 0.01;  ///< of an edge of weight 1 [m]
  double rotation_sigma = 0.005;    ///< of an edge of weight 1 [rad]
  int iterations = 50;              ///< at most
  double cost_tolerance = 1e-8;     ///< ends when a step lowers the cost by less than this share
  STILLMAP_FIELDS(translation_sigma, rotation_sigma, iterations, cost_tolerance)
};

struct PoseGraphResult {
  std::vector<Pose> T_world_node;          ///< fixed ones as given, to the bit
  double cost_before = 0, cost_after = 0;  ///< half the sum of squared residuals [sigma^2]
  int iterations = 0;
};

/// The poses that fit relative measurements best, least squares in the residuals
/// e = log(T_a_b^-1 T_world_a^-1 T_world_b) (Grisetti et al., A Tutorial on Graph-Based SLAM, 2010,
/// with poses in SE(3); scale is known, so six degrees of freedom each), by Levenberg-Marquardt
/// with Ceres. Deterministic: one thread, equal input gives equal bits. Throws Error if sizes or
/// indices do not fit together, or if no pose is fixed.
PoseGraphResult solve_pose_graph(const PoseGraphProblem& problem,
                                 const PoseGraphOptions& options = {});

}  // namespace stillmap
