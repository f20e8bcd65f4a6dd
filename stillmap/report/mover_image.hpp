// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/mover_tracker.hpp"
#include "stillmap/report/cloud_image.hpp"

#include <vector>

namespace stillmap {

/// The paths of the movers from above, over the static cloud (pale; points above the cameras are
/// cut off) and the camera's path. A line per mover, dotted while it was hidden, from a disc at its
/// first position to its box at the last one, with an arrow for its velocity (length: path of one
/// second) and a label with id and class. A bar in a corner gives the scale. 8UC3 BGR; the height
/// follows from the extent of what is drawn.
///
/// @param movers   world frame
/// @param cameras  the trajectory, world frame; defines the direction "from above"
/// @param cloud    static cloud, world frame; may be empty
/// @param width    of the image [pixels]
cv::Mat draw_movers(const std::vector<MoverTrack>& movers, const Trajectory& cameras,
                    const CloudSpan& cloud, int width = 1200);

}  // namespace stillmap
