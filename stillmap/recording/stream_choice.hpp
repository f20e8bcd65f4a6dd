// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/recording/frame_tree.hpp"
#include "stillmap/recording/rgbd_streams.hpp"

#include <string>
#include <tuple>
#include <vector>

namespace stillmap {

/// Returns the color and depth images of one camera, and a note for each other camera that has
/// both. Streams are of one camera if the words of their topics and frames agree and the transform
/// between them is small enough for one device. Of several cameras the one with the most images is
/// returned. Throws Error, which lists the image topics, if there is no color or no depth.
std::tuple<ImageStream, ImageStream, std::vector<std::string>> best_streams(
    const Recording& recording, const std::vector<ImageStream>& streams, FrameTree& frames);

}  // namespace stillmap
