// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/followed_folder.hpp"

#include "stillmap/base/error.hpp"

#include <thread>
#include <utility>

namespace stillmap {

FollowedFolder::FollowedFolder(const Open& open, Following following)
    : following_(std::move(following)) {
  while (!folder_) {
    try {
      folder_ = open(/*growing=*/!complete_);
    } catch (const Error&) {
      if (complete_) throw;
      complete_ = !wait_a_little();
    }
  }
  newest_ = Clock::now();
}

RgbdFramePtr FollowedFolder::next() {
  while (true) {
    if (RgbdFramePtr frame = folder_->next()) {
      newest_ = Clock::now();
      return frame;
    }
    if (complete_ || folder_->range_is_complete()) return nullptr;
    complete_ = !wait_a_little();
    folder_->refresh(/*growing=*/!complete_);
  }
}

/// Returns false, without waiting, when it is time to stop.
bool FollowedFolder::wait_a_little() const {
  constexpr std::chrono::milliseconds kPoll(50);  // a frame and a half of a usual camera
  const std::chrono::duration<double> since_newest = Clock::now() - newest_;
  if (since_newest.count() > following_.patience) return false;
  if (following_.stop && following_.stop()) return false;
  std::this_thread::sleep_for(kPoll);
  return true;
}

}  // namespace stillmap
