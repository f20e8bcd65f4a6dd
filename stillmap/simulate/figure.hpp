// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/simulate/mover.hpp"
#include "stillmap/simulate/palette.hpp"
#include "stillmap/simulate/path.hpp"

namespace stillmap::simulate {

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
