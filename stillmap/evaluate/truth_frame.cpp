// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/truth_frame.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/number.hpp"

#include <cmath>
#include <cstdlib>
#include <sstream>
#include <vector>

#include <fmt/format.h>

namespace stillmap {
namespace {

using Matrix4 = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

/// Largest deviation of R^T R from a multiple of the identity, relative to it.
constexpr double kMaxShear = 0.05;

std::vector<double> numbers_in(const std::string& text, const std::string& name) {
  std::vector<double> numbers;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line.substr(0, line.find('#')));
    for (std::string word; words >> word;) {
      const auto number = number_of(word);
      if (!number || !std::isfinite(*number)) {
        throw Error(fmt::format("'{}' is not a number", word), name,
                    "write T_body_camera as 4 x 4 numbers");
      }
      numbers.push_back(*number);
    }
  }
  return numbers;
}

/// The rigid motion in a matrix whose rotation may have a uniform scale.
Pose rigid_part(const Matrix4& T, const std::string& name) {
  const Eigen::Matrix3d A = T.topLeftCorner<3, 3>();
  const double scale = std::cbrt(A.determinant());
  const Eigen::Matrix3d shear = A.transpose() * A / (scale * scale) - Eigen::Matrix3d::Identity();
  const bool last_row_is_right = (T.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() < 1e-6;
  if (scale <= 0 || !(shear.cwiseAbs().maxCoeff() < kMaxShear) || !last_row_is_right) {
    throw Error("is not a rigid transform", name,
                "the upper left 3 x 3 numbers must be a rotation, the last row 0 0 0 1");
  }
  return Pose(nearest_rotation(A), T.topRightCorner<3, 1>());
}

/// The script of the data set: T_ros * T_body * T_ros * T_marker.
TruthFrame bonn() {
  Matrix4 T_ros, T_marker;
  T_ros << -1, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 1;
  T_marker << 1.0157, 0.1828, -0.2389, 0.0113,  //
      0.0009, -0.8431, -0.6413, -0.0098,        //
      -0.3009, 0.6147, -0.8085, 0.0111,         //
      0, 0, 0, 1;
  return {rigid_part(T_ros, "bonn"), rigid_part(T_ros * T_marker, "bonn")};
}

}  // namespace

TruthFrame read_truth_frame(const std::string& name) {
  if (name == "bonn") return bonn();
  const std::vector<double> numbers = numbers_in(read_file(name), name);
  if (numbers.size() != 16) {
    throw Error(fmt::format("has {} numbers instead of 16", numbers.size()), name,
                "write T_body_camera as 4 x 4 numbers");
  }
  return {Pose(), rigid_part(Eigen::Map<const Matrix4>(numbers.data()), name)};
}

Trajectory in_camera_frame(const Trajectory& body, const TruthFrame& frame) {
  Trajectory camera = body;
  for (StampedPose& pose : camera)
    pose.T_world_camera = frame.T_world_reference * pose.T_world_camera * frame.T_body_camera;
  return camera;
}

}  // namespace stillmap
