// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/mover_tracker.hpp"
#include "stillmap/report/cloud_image.hpp"

#include <vector>

namespace stillmap {

/// Draws the paths of the movers from above, over the camera's path and the static cloud (pale,
/// without points above the cameras). Each mover has a line, dotted while it was predicted, from a
/// disc at its first position to its box at the last one, with an arrow for its velocity (length:
/// path of one second) and a label with id and class. A bar in a corner gives the scale. Returns
/// 8UC3 BGR; the height follows from the extent of the paths and the cloud.
///
/// @param movers   tracks in the world frame
/// @param cameras  trajectory in the world frame; defines the direction "from above"
/// @param cloud    static cloud in the world frame; may be empty
/// @param width    width of the image [pixels]
cv::Mat draw_movers(const std::vector<MoverTrack>& movers, const Trajectory& cameras,
                    const CloudSpan& cloud, int width = 1200);

}  // namespace stillmap
