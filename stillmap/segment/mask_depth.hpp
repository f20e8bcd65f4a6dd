// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/mask_flow.hpp"
#include "stillmap/segment/small_frame.hpp"

#include <opencv2/core.hpp>

namespace stillmap {

/// Removes background from a mask: pixels more than kDepthApart behind the median depth of
/// the masked pixels around them. This removes the wall between an arm and the body, which a coarse
/// mask covers.
void drop_background(SmallMask& mask, const SmallFrame& frame);

/// Removes pixels of a moved mask whose depth differs from the expected depth by more than
/// kDepthApart.
void drop_others(MovedMask& moved, const SmallFrame& target);

/// Grows a mask onto neighbors on the same surface, whose depths differ by less than
/// 6 cm at 2 m (more with the square of the depth), by at most `rounds` pixels.
/// @param allowed  of the mask's size; growth only where it is not 0; empty: everywhere
void grow_on_surface(SmallMask& mask, const SmallFrame& frame, int rounds,
                     const cv::Mat1b& allowed);

}  // namespace stillmap
