// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/mask_flow.hpp"
#include "stillmap/segment/propagation_options.hpp"
#include "stillmap/segment/small_frame.hpp"

#include <opencv2/core.hpp>

namespace stillmap {

/// Takes out of a mask what lies clearly behind the thing itself: pixels more than
/// options.depth_apart behind the median depth of the masked pixels around them. So the wall
/// between an arm and the body goes, although the network's coarse mask covers it.
void drop_background(SmallMask& mask, const SmallFrame& frame, const PropagationOptions& options);

/// Takes out of a moved mask what is not at the depth that is expected: more than
/// options.depth_apart nearer or further.
void drop_others(MovedMask& moved, const SmallFrame& target, const PropagationOptions& options);

/// Lets a mask grow onto neighbors that continue its surface: their depths differ by less than
/// options.depth_step. Pixel by pixel, at most `rounds` of them.
/// @param allowed of the mask's size; only where it is not 0. Empty: everywhere
void grow_on_surface(SmallMask& mask, const SmallFrame& frame, int rounds, const cv::Mat1b& allowed,
                     const PropagationOptions& options);

}  // namespace stillmap
