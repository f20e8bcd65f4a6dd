// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/simulate/mover.hpp"
#include "stillmap/simulate/palette.hpp"

#include <array>

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

/// What a person does.
struct Walking {
  Path path;
  float speed = 0.8F;  ///< m/s
  float start = 0;     ///< arc length at time 0 [m]
};
struct Sitting {
  Transform seat;  ///< on the floor below the seat, facing -y
};
struct Waving {
  Transform place;  ///< on the floor between the feet, facing -y
};

/// People-like figures of elliptic limbs in textured clothes, posed from the feet up: planted feet
/// do not slide, knees by two-bone inverse kinematics. `number` varies height, clothes, skin and
/// hair.
Mover make_walker(int id, int number, const Walking& walking, Palette& palette);
Mover make_sitter(int id, int number, const Sitting& sitting, Palette& palette);
Mover make_waver(int id, int number, const Waving& waving, Palette& palette);

}  // namespace stillmap::simulate
