// SPDX-License-Identifier: Apache-2.0
#include "stillmap/geometry/assignment.hpp"

#include <limits>

namespace stillmap {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Rows are added one by one. The potentials keep every reduced cost (cost - row - column) at zero
/// or above, and at zero on the assigned pairs, so a path of zero reduced cost is a cheapest path.
class Assigner {
 public:
  explicit Assigner(const Eigen::MatrixXd& cost)
      : cost_(cost),
        row_potential_(Eigen::VectorXd::Zero(cost.rows())),
        column_potential_(Eigen::VectorXd::Zero(cost.cols())),
        row_of_(static_cast<std::size_t>(cost.cols()), -1) {}

  std::vector<int> assign() {
    for (int row = 0; row < cost_.rows(); ++row) augment(row);
    std::vector<int> column_of(static_cast<std::size_t>(cost_.rows()), -1);
    for (int column = 0; column < cost_.cols(); ++column) {
      const int row = row_of_[static_cast<std::size_t>(column)];
      if (row >= 0) column_of[static_cast<std::size_t>(row)] = column;
    }
    return column_of;
  }

 private:
  /// Searches with Dijkstra's algorithm from an unassigned row to the nearest unassigned column,
  /// then switches the pairs along the path.
  void augment(int start) {
    const auto columns = static_cast<std::size_t>(cost_.cols());
    std::vector<double> distance(columns, kInfinity);
    std::vector<int> previous(columns, -1);  // previous column on the path; -1: the start
    std::vector<char> settled(columns, 0);
    int row = start, last = -1, end = -1;
    double reached = 0;
    while (end < 0) {
      int nearest = -1;
      for (int c = 0; c < cost_.cols(); ++c) {
        const auto k = static_cast<std::size_t>(c);
        if (settled[k]) continue;
        const double through = reached + cost_(row, c) - row_potential_(row) - column_potential_(c);
        if (through < distance[k]) {
          distance[k] = through;
          previous[k] = last;
        }
        if (nearest < 0 || distance[k] < distance[static_cast<std::size_t>(nearest)]) nearest = c;
      }
      const auto k = static_cast<std::size_t>(nearest);
      reached = distance[k];
      settled[k] = 1;
      last = nearest;
      row = row_of_[k];
      if (row < 0) end = nearest;
    }
    update_potentials(start, distance, settled, reached);
    hand_over(start, end, previous);
  }

  void update_potentials(int start, const std::vector<double>& distance,
                         const std::vector<char>& settled, double reached) {
    row_potential_(start) += reached;
    for (int c = 0; c < cost_.cols(); ++c) {
      const auto k = static_cast<std::size_t>(c);
      if (!settled[k]) continue;
      column_potential_(c) += distance[k] - reached;
      if (row_of_[k] >= 0) row_potential_(row_of_[k]) += reached - distance[k];
    }
  }

  void hand_over(int start, int end, const std::vector<int>& previous) {
    int column = end;
    while (column >= 0) {
      const int before = previous[static_cast<std::size_t>(column)];
      row_of_[static_cast<std::size_t>(column)] =
          before >= 0 ? row_of_[static_cast<std::size_t>(before)] : start;
      column = before;
    }
  }

  const Eigen::MatrixXd& cost_;
  Eigen::VectorXd row_potential_, column_potential_;
  std::vector<int> row_of_;  // row of each column; -1: none yet
};

}  // namespace

std::vector<int> assign(const Eigen::MatrixXd& cost) {
  if (cost.rows() <= cost.cols()) return Assigner(cost).assign();
  const Eigen::MatrixXd transposed = cost.transpose();
  const std::vector<int> row_of = Assigner(transposed).assign();
  std::vector<int> column_of(static_cast<std::size_t>(cost.rows()), -1);
  for (std::size_t column = 0; column < row_of.size(); ++column) {
    column_of[static_cast<std::size_t>(row_of[column])] = static_cast<int>(column);
  }
  return column_of;
}

}  // namespace stillmap
