// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/mask_flow.hpp"
#include "stillmap/segment/propagation_options.hpp"
#include "stillmap/segment/small_frame.hpp"

#include <opencv2/core.hpp>

namespace stillmap {

/// Removes background from a mask: pixels more than options.depth_apart behind the median depth of
/// the masked pixels around them. This removes the wall between an arm and the body, which a coarse
/// mask covers.
void drop_background(SmallMask& mask, const SmallFrame& frame, const PropagationOptions& options);

/// Removes pixels of a moved mask whose depth differs from the expected depth by more than
/// options.depth_apart.
void drop_others(MovedMask& moved, const SmallFrame& target, const PropagationOptions& options);

/// Grows a mask onto neighbors on the same surface, whose depths differ by less than
/// options.depth_step, by at most `rounds` pixels.
/// @param allowed  of the mask's size; growth only where it is not 0; empty: everywhere
void grow_on_surface(SmallMask& mask, const SmallFrame& frame, int rounds, const cv::Mat1b& allowed,
                     const PropagationOptions& options);

}  // namespace stillmap
