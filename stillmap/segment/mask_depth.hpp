// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/mask_flow.hpp"
#include "stillmap/segment/small_frame.hpp"

#include <algorithm>

#include <opencv2/core.hpp>

namespace stillmap {

/// Returns the difference of the depths of neighboring pixels [m] from which they are on different
/// surfaces; z: depth of one of them [m].
inline float surface_step(float z) {
  constexpr float kStep = 0.06F;   // at kStepDepth; tuned on people at 1 to 4 m, against true masks
  constexpr float kStepDepth = 2;  // a Kinect's noise grows with z^2
  return kStep * std::max(1.0F, z * z / (kStepDepth * kStepDepth));
}

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
