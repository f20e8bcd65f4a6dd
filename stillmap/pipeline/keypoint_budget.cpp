// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/keypoint_budget.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {
namespace {

constexpr double kMemory = 0.8;                // weight of the previous load in the smoothed load
constexpr double kTooBusy = 0.9, kIdle = 0.6;  // thresholds of the load, of the camera's interval
constexpr double kLess = 0.95, kMore = 1.02;   // factors per frame; 8 frames remove a third
// Numbers of landmarks with which the budget may shrink, and below which it grows; the tracker
// needs 25.
constexpr int kEnough = 120, kFew = 80;

}  // namespace

KeypointBudget::KeypointBudget(int most, double least) : most_(most), least_(least) {}

void KeypointBudget::add_frame(double milliseconds, double interval, int landmarks) {
  if (interval <= 0) return;
  load_ = kMemory * load_ + (1 - kMemory) * milliseconds / interval;
  if (load_ > kTooBusy && landmarks > kEnough) share_ *= kLess;
  if (load_ < kIdle) share_ *= kMore;
  if (landmarks < kFew) share_ /= kLess;
  share_ = std::clamp(share_, least_, 1.0);
}

int KeypointBudget::keypoints() const {
  return static_cast<int>(std::lround(share_ * static_cast<double>(most_)));
}

}  // namespace stillmap
