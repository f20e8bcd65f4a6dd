// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

namespace stillmap {

/// A board that is moved across the view at short distance, wherever the camera points. It looks as
/// static as a wall, but it moves.
struct Board {
  double share = 0.6;     ///< Share of the image width that it covers, from the left [0..1].
  double distance = 0.8;  ///< Distance from the camera along the optical axis [m].
  double speed = 0.4;     ///< Speed to the right [m/s]; it also sways vertically.
  bool printed = true;    ///< Whether it has a print; without it there are no corners on it.
  int seed = 1;           ///< Seed of the print.
};

/// Returns a frame with the board, `seconds` after the board appeared. The frame's own measured
/// depth stays outside the board.
RgbdFramePtr behind(const Board& board, const RgbdFrame& frame, const Camera& camera,
                    double seconds);

}  // namespace stillmap
