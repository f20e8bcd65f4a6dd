// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/pose_graph.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/geometry/adjoint.hpp"
#include "stillmap/optimize/ceres_pose.hpp"

#include <memory>

namespace stillmap {
namespace {

/// Translation standard deviation of an edge of weight 1 [m].
constexpr double kTranslationSigma = 0.01;
/// Rotation standard deviation of an edge of weight 1 [rad].
constexpr double kRotationSigma = 0.005;
/// Maximum number of iterations.
constexpr int kIterations = 50;
/// Optimization ends when a step reduces the cost by less than this ratio.
constexpr double kCostTolerance = 1e-8;

/// Returns the inverse right Jacobian of SE(3): log(exp(x) exp(d)) = x + J^-1 d to first order.
/// Series in ad(x) to fourth order (Barfoot, State Estimation for Robotics, 2017, eq. 7.84-7.86
/// with the Bernoulli numbers); the error is 1e-4 at an angle of one radian, and residuals are
/// smaller.
Matrix6d inverse_right_jacobian(const Vector6d& x) {
  Matrix6d ad = Matrix6d::Zero();
  ad.topLeftCorner<3, 3>() = ad.bottomRightCorner<3, 3>() = skew(x.tail<3>());
  ad.topRightCorner<3, 3>() = skew(x.head<3>());
  const Matrix6d ad2 = ad * ad;
  return Matrix6d::Identity() + 0.5 * ad + ad2 / 12 - ad2 * ad2 / 720;
}

/// One edge as a Ceres cost of two poses.
class EdgeCost final : public ceres::SizedCostFunction<6, 7, 7> {
 public:
  explicit EdgeCost(const PoseGraphEdge& edge) : T_b_a_measured_(edge.T_a_b.inverse()) {
    const double root = std::sqrt(edge.weight);
    scale_.head<3>().setConstant(root / kTranslationSigma);
    scale_.tail<3>().setConstant(root / kRotationSigma);
  }

  /// Both poses are perturbed on the left, and T_a^-1 exp(d) T_b = T_a^-1 T_b exp(Ad(T_b^-1) d).
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Pose T_a = to_pose(parameters[0]), T_b = to_pose(parameters[1]);
    const Vector6d e = (T_b_a_measured_ * (T_a.inverse() * T_b)).log();
    Eigen::Map<Vector6d>{residuals} = scale_.cwiseProduct(e);
    if (jacobians == nullptr) return true;
    const Matrix6d J = scale_.asDiagonal() * inverse_right_jacobian(e) * adjoint(T_b.inverse());
    for (int i = 0; i < 2; ++i) {
      if (jacobians[i] == nullptr) continue;
      Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>> block(jacobians[i]);
      block.leftCols<6>() = i == 0 ? Matrix6d(-J) : J;
      block.col(6).setZero();
    }
    return true;
  }

 private:
  Pose T_b_a_measured_;
  Vector6d scale_;
};

void check(const PoseGraphProblem& problem) {
  const std::size_t nodes = problem.T_world_node.size();
  const auto outside = [&](const PoseGraphEdge& e) { return e.a >= nodes || e.b >= nodes; };
  if (problem.fixed.size() != nodes ||
      std::any_of(problem.edges.begin(), problem.edges.end(), outside)) {
    throw Error("sizes or indices are inconsistent", "solve_pose_graph",
                "give one flag per node, and edges between nodes");
  }
  if (std::find(problem.fixed.begin(), problem.fixed.end(), 1) == problem.fixed.end()) {
    throw Error("no node is fixed", "solve_pose_graph",
                "fix the node that defines the world frame");
  }
}

ceres::Solver::Options solver_options() {
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  // Single-threaded, so that sums are reproducible.
  solver.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  solver.max_num_iterations = kIterations;
  solver.function_tolerance = kCostTolerance;
  solver.num_threads = 1;
  solver.logging_type = ceres::SILENT;
  return solver;
}

}  // namespace

PoseGraphResult solve_pose_graph(const PoseGraphProblem& problem) {
  const TraceScope scope("pose graph");
  check(problem);
  PoseGraphResult result{problem.T_world_node};
  std::vector<PoseBlock> blocks;
  for (const Pose& T : problem.T_world_node) blocks.push_back(to_block(T));
  ceres::Problem graph;
  for (const PoseGraphEdge& edge : problem.edges) {
    if (problem.fixed[edge.a] && problem.fixed[edge.b]) continue;
    graph.AddResidualBlock(new EdgeCost(edge), nullptr, blocks[edge.a].data(),
                           blocks[edge.b].data());
  }
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (!graph.HasParameterBlock(blocks[i].data())) continue;
    graph.SetManifold(blocks[i].data(), new PoseManifold);
    if (problem.fixed[i]) graph.SetParameterBlockConstant(blocks[i].data());
  }
  if (graph.NumResidualBlocks() == 0) return result;
  ceres::Solver::Summary summary;
  ceres::Solve(solver_options(), &graph, &summary);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (!problem.fixed[i] && graph.HasParameterBlock(blocks[i].data()))
      result.T_world_node[i] = to_pose(blocks[i].data());
  }
  result.cost_before = summary.initial_cost;
  result.cost_after = summary.final_cost;
  result.iterations = summary.num_successful_steps + summary.num_unsuccessful_steps;
  return result;
}

}  // namespace stillmap
