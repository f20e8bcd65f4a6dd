// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cstddef>
#include <vector>

namespace stillmap {

/// Returns the share of keypoints that are labeled as moving [0..1].
/// @param weight factor of the information of each keypoint; 0 for a moving one
inline double moving_share(const std::vector<float>& weight) {
  if (weight.empty()) return 0;
  const auto moving = static_cast<double>(std::count(weight.begin(), weight.end(), 0.0F));
  return moving / static_cast<double>(weight.size());
}

/// Share of moving keypoints above which a pose rests on a minority, which may contain some that
/// are wrongly labeled as static [0..1].
inline constexpr double kMovingMajority = 0.5;
/// Share of moving keypoints above which a pose is returned as uncertain [0..1]; no frame of the
/// rendered kitchens, whose poses err by millimeters, has more.
inline constexpr double kUncertainMajority = 0.75;

}  // namespace stillmap
