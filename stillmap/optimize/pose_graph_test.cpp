// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/pose_graph.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/optimize/synthetic.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// A camera moved around a circle of 10 m; each pose is measured relative to the previous one, and
/// the first relative to the last.
struct Ring {
  std::vector<Pose> truth;
  PoseGraphProblem problem;  ///< Initial poses from the chained measurements.

  Ring(int nodes, double meters, double radians, unsigned seed) {
    std::mt19937 rng(seed);
    for (int i = 0; i < nodes; ++i) {
      const double turn = 2 * std::numbers::pi * i / nodes;
      truth.emplace_back(so3_exp({0, turn, 0.1 * std::sin(3 * turn)}),
                         Eigen::Vector3d(10 * std::sin(turn), 0.2 * turn, 10 * std::cos(turn)));
    }
    problem.T_world_node = {truth[0]};
    problem.fixed.assign(truth.size(), 0);
    problem.fixed[0] = 1;
    for (std::uint32_t i = 1; i < truth.size(); ++i) {
      const Pose error = synthetic::random_pose(rng, meters, radians);
      problem.edges.push_back({i - 1, i, truth[i - 1].inverse() * truth[i] * error});
      problem.T_world_node.push_back(problem.T_world_node.back() * problem.edges.back().T_a_b);
    }
    const auto last = static_cast<std::uint32_t>(truth.size() - 1);
    problem.edges.push_back({last, 0, truth[last].inverse() * truth[0], 1000});
  }

  double rmse(const std::vector<Pose>& poses) const {
    double sum = 0;
    for (std::size_t i = 0; i < truth.size(); ++i)
      sum += (poses[i].translation() - truth[i].translation()).squaredNorm();
    return std::sqrt(sum / static_cast<double>(truth.size()));
  }
};

TEST(PoseGraph, ExactMeasurementsGiveTheExactTruthFromADistantGuess) {
  Ring ring(100, 0, 0, 1);
  std::mt19937 rng(2);
  for (std::size_t i = 1; i < ring.truth.size(); ++i)
    ring.problem.T_world_node[i] = ring.truth[i] * synthetic::random_pose(rng, 0.5, 0.3);
  const PoseGraphResult result = solve_pose_graph(ring.problem);
  EXPECT_LT(result.cost_after, 1e-6 * result.cost_before);
  for (std::size_t i = 0; i < ring.truth.size(); ++i)
    EXPECT_LT((ring.truth[i].inverse() * result.T_world_node[i]).log().norm(), 1e-5) << i;
}

/// Errors of single steps add up to some decimeters; the loop removes the common part and leaves
/// the deviation of a random walk fixed at both ends: half in the mean.
TEST(PoseGraph, ALoopRemovesDrift) {
  double open = 0, closed = 0;
  for (unsigned seed = 0; seed < 8; ++seed) {
    const Ring ring(150, 0.01, 0.004, seed);
    const PoseGraphResult result = solve_pose_graph(ring.problem);
    open += ring.rmse(ring.problem.T_world_node);
    closed += ring.rmse(result.T_world_node);
    const Pose end_error = ring.truth.back().inverse() * result.T_world_node.back();
    EXPECT_LT(end_error.translation().norm(), 0.01) << "it has a strong edge to the first";
  }
  EXPECT_LT(closed, 0.6 * open);
}

TEST(PoseGraph, FixedPosesAreBitExactAndWeightsCount) {
  PoseGraphProblem problem;
  const Pose one(Eigen::Quaterniond::Identity(), {1, 0, 0});
  const Pose three(Eigen::Quaterniond::Identity(), {3, 0, 0});
  problem.T_world_node = {Pose(), one, three};
  problem.fixed = {1, 0, 1};
  // Edges of one meter each, but three meters apart.
  problem.edges = {{0, 1, one, 3}, {1, 2, one, 1}};
  const PoseGraphResult result = solve_pose_graph(problem);
  EXPECT_EQ(result.T_world_node[2].translation(), three.translation());
  EXPECT_NEAR(result.T_world_node[1].translation().x(), 1.25, 1e-4) << "a quarter of the error";
}

TEST(PoseGraph, IsDeterministic) {
  const Ring ring(100, 0.02, 0.01, 7);
  const auto first = solve_pose_graph(ring.problem), second = solve_pose_graph(ring.problem);
  for (std::size_t i = 0; i < ring.truth.size(); ++i)
    EXPECT_EQ(first.T_world_node[i].translation(), second.T_world_node[i].translation());
}

TEST(PoseGraph, RefusesAGraphWithoutFixedNode) {
  Ring ring(10, 0, 0, 1);
  ring.problem.fixed[0] = 0;
  EXPECT_THROW(solve_pose_graph(ring.problem), Error);
  ring.problem.fixed[0] = 1;
  ring.problem.edges[3].b = 99;
  EXPECT_THROW(solve_pose_graph(ring.problem), Error);
}

}  // namespace
}  // namespace stillmap
