// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/simulate/mover.hpp"
#include "stillmap/simulate/palette.hpp"
#include "stillmap/simulate/path.hpp"

namespace stillmap::simulate {

/// Activity of a person.
struct Walking {
  Path path;
  float speed = 0.8F;  ///< Walking speed [m/s].
  float start = 0;     ///< Arc length at time 0 [m].
};
struct Sitting {
  Transform seat;        ///< Frame on the floor below the seat, facing -y.
  float liveliness = 1;  ///< Factor on all motion while sitting.
};
struct Waving {
  Transform place;  ///< Frame on the floor between the feet, facing -y.
};

/// Sits, gets up, and walks away.
struct Rising {
  Sitting before;
  Path path;           ///< Starts next to the seat.
  double at = 4;       ///< Time at which the person starts to get up [s].
  float speed = 0.8F;  ///< Walking speed [m/s].
};

/// Figures of people with elliptic limbs in textured clothes, posed from the feet up: planted feet
/// do not slide, knees by two-bone inverse kinematics. `number` varies height, clothes, skin and
/// hair.
Mover make_walker(int id, int number, const Walking& walking, Palette& palette);
Mover make_sitter(int id, int number, const Sitting& sitting, Palette& palette);
Mover make_riser(int id, int number, const Rising& rising, Palette& palette);
Mover make_waver(int id, int number, const Waving& waving, Palette& palette);

}  // namespace stillmap::simulate
