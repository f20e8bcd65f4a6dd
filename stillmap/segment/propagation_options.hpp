// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"

namespace stillmap {

/// How masks are carried from the frame they were found in to a later one. Pixels are those of the
/// full image. Lengths were tuned on people at 1 to 4 m in 640 x 480 images, against true masks.
struct PropagationOptions {
  int grid = 20;           ///< spacing of the points that optical flow follows [pixels]
  int window = 28;         ///< side of the square that optical flow compares [pixels]
  double growth = 1.5;     ///< uncertainty of the outline, per frame of age [pixels]
  double base_growth = 2;  ///< the same at age 0 [pixels]
  int filling = 16;        ///< holes and bays up to this width may fill up again [pixels]
  double depth_step =
      0.06;  ///< neighbors on one surface differ by less; at 2 m, grows with z^2 [m]
  double depth_apart = 0.3;  ///< what is further off than this is another thing [m]
  int max_age = 30;          ///< older masks are not carried: there are none then [frames]
  STILLMAP_FIELDS(grid, window, growth, base_growth, filling, depth_step, depth_apart, max_age)
};

}  // namespace stillmap
