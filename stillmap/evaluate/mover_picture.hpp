// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/cloud_picture.hpp"
#include "stillmap/evaluate/mover_error.hpp"

#include <vector>

namespace stillmap {

/// The movers' ways from above, over the static cloud (pale; cut open above the cameras) and the
/// camera's path: a line per mover, dotted where he was hidden, from a disc where he was seen first
/// to his box where he was seen last, with an arrow as long as he went in a second, and a label
/// with id and class. 8UC3 BGR; height follows from the shape of what is drawn.
///
/// @param movers  of any order; world frame
/// @param cameras the trajectory, world frame; its mean upward direction says what "above" is
/// @param cloud   may be empty
cv::Mat draw_movers(const std::vector<MoverPosition>& movers, const Trajectory& cameras,
                    const CloudSpan& cloud, int width = 1200);

}  // namespace stillmap
