// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/features.hpp"

#include <vector>

namespace stillmap {

/// Returns whether the background seems to move: many keypoints are labeled as moving, are farther
/// than the static ones by a third, and lie on three sides of their center. Then the static ones
/// are probably those of an object that moves with the camera, such as a person who walks ahead of
/// it. So are three quarters of the frames of such simulated recordings without a network, and
/// fewer than one in a hundred of others.
/// @param weight factor of the information of each keypoint; 0 for a moving one
bool background_moves(const Features& features, const std::vector<float>& weight);

}  // namespace stillmap
