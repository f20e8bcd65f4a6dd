// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"

#include <cstdint>
#include <vector>

namespace stillmap {

/// Relative pose measurement T_a_b between two nodes (indices into the problem's poses).
struct PoseGraphEdge {
  std::uint32_t a = 0, b = 0;
  Pose T_a_b;
  double weight = 1;  ///< Factor of the information; at 1 the error is 1 cm and 0.005 rad.
};

struct PoseGraphProblem {
  std::vector<Pose> T_world_node;    ///< Initial poses.
  std::vector<std::uint8_t> fixed;   ///< One per node; at least one must be set.
  std::vector<PoseGraphEdge> edges;  ///< Every node must be connected to a fixed node.
};

struct PoseGraphResult {
  std::vector<Pose> T_world_node;          ///< Fixed poses are returned bit-exactly.
  double cost_before = 0, cost_after = 0;  ///< Half the sum of squared residuals [sigma^2].
  int iterations = 0;
};

/// Pose graph optimization: minimizes the residuals e = log(T_a_b^-1 T_world_a^-1 T_world_b)
/// (Grisetti et al., A Tutorial on Graph-Based SLAM, 2010; SE(3), since the scale is known) by
/// Levenberg-Marquardt with Ceres. Deterministic: one thread, equal input gives equal bits. Throws
/// Error if sizes or indices are inconsistent, or if no pose is fixed.
PoseGraphResult solve_pose_graph(const PoseGraphProblem& problem);

}  // namespace stillmap
