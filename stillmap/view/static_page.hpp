// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/view/topic_board.hpp"

#include <string>

namespace stillmap {

/// Returns the page with the messages of a board as one HTML file, which needs no server and no
/// network. It has no images of the camera.
std::string static_page(TopicBoard& board);

}  // namespace stillmap
