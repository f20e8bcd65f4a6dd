// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include <Eigen/Core>

namespace stillmap::simulate {

/// A smooth closed path on the floor, parametrized by arc length.
class Path {
 public:
  /// @param corners  at least three points on the floor [m]; the path passes through them (Catmull
  /// and Rom 1974)
  explicit Path(const std::vector<Eigen::Vector2f>& corners);
  float length() const { return length_; }
  /// Returns the point at an arc length [m], any real number: the path is periodic.
  Eigen::Vector2f at(double arc) const;
  /// Returns the unit direction of travel, smoothed over half a step.
  Eigen::Vector2f heading(double arc) const;

 private:
  std::vector<Eigen::Vector2f> points_;  // evenly spaced
  float length_ = 0;
};

}  // namespace stillmap::simulate
