// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

namespace stillmap {

/// Something large that is carried past close before the camera: a board across its view, wherever
/// the camera looks. To the eye it is as good as a wall, but it moves.
struct Board {
  double share = 0.6;     ///< of the view's width that it covers, from the left
  double distance = 0.8;  ///< from the camera along the optical axis [m]
  double speed = 0.4;     ///< to the right [m/s]; it sways up and down besides
  bool printed = true;    ///< false: without a corner on it
  int seed = 1;           ///< of its print
};

/// What a camera sees behind a board, `seconds` after the board came. The frame's own measured
/// depth stays where the board is not.
RgbdFramePtr behind(const Board& board, const RgbdFrame& frame, const Camera& camera,
                    double seconds);

}  // namespace stillmap
