// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/keypoint_budget.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {
namespace {

constexpr double kMemory = 0.8;                // of the load, from frame to frame
constexpr double kTooBusy = 0.9, kIdle = 0.6;  // of the camera's interval
constexpr double kLess = 0.95, kMore = 1.02;   // a third of the keypoints is gone after 8 frames
constexpr int kEnough = 120, kFew = 80;        // landmarks, of the tracker's least 25

}  // namespace

KeypointBudget::KeypointBudget(int most, double least) : most_(most), least_(least) {}

void KeypointBudget::took(double milliseconds, double interval, int landmarks) {
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
