// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include <Eigen/Core>

namespace stillmap::simulate {

/// A closed way over the floor, smooth, by arc length.
class Path {
 public:
  /// @param corners at least three points on the floor [m]; the way passes through them (Catmull
  /// and Rom 1974)
  explicit Path(const std::vector<Eigen::Vector2f>& corners);
  float length() const { return length_; }
  /// The point at an arc length, any real number: it goes round and round.
  Eigen::Vector2f at(double arc) const;
  /// Unit direction of travel, smoothed over half a step.
  Eigen::Vector2f heading(double arc) const;

 private:
  std::vector<Eigen::Vector2f> points_;  // evenly spaced
  float length_ = 0;
};

}  // namespace stillmap::simulate
