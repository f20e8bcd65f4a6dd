// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/live_source.hpp"

#include "stillmap/base/error.hpp"

#include <chrono>
#include <utility>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Number of frames that wait for next(): one that arrives while another one is taken.
constexpr std::size_t kWaiting = 2;
constexpr const char* kDropped = "the camera is faster than tracking";

}  // namespace

LiveSource::LiveSource(std::unique_ptr<LiveCamera> live, Following following,
                       const FrameRange& range)
    : live_(std::move(live)), following_(std::move(following)), range_(range) {
  check_range(range);
  reader_ = std::thread([this] { read_frames(); });
}

LiveSource::~LiveSource() {
  {
    const std::scoped_lock lock(mutex_);
    at_end_ = true;
  }
  reader_.join();
}

void LiveSource::read_frames() {
  const auto wanted = [&](int number) {
    return number >= range_.first && (number - range_.first) % range_.stride == 0;
  };
  const auto is_last = [&](int number) {
    return range_.count > 0 && number + 1 >= range_.first + range_.count;
  };
  double newest = -1;  // [s]
  for (int number = 0;;) {
    std::shared_ptr<RgbdFrame> frame;
    try {
      frame = live_->read();
    } catch (const Error& error) {
      const std::scoped_lock lock(mutex_);
      failure_ = error.problem();
      at_end_ = true;
    }
    const std::scoped_lock lock(mutex_);
    if (frame && frame->timestamp > newest) {
      newest = frame->timestamp;
      if (wanted(number)) deliver(std::move(frame));
      at_end_ = at_end_ || is_last(number++);
    }
    changed_.notify_one();
    if (at_end_) return;
  }
}

/// Adds a frame to the waiting ones; the caller holds the mutex.
void LiveSource::deliver(std::shared_ptr<RgbdFrame> frame) {
  if (waiting_.size() == kWaiting) {
    dropped_.push_back(waiting_.front()->timestamp);
    waiting_.pop_front();
  }
  waiting_.push_back(std::move(frame));
}

/// Moves the dropped frames to the skipped ones; the caller holds the mutex.
void LiveSource::list_dropped() {
  for (const double timestamp : dropped_)
    skipped_.push_back(
        {.timestamp = timestamp, .reason = fmt::format("dropped: {}", kDropped), .late = true});
  dropped_.clear();
  if (failure_.empty()) return;
  skipped_.push_back({.timestamp = 0, .reason = "the camera stopped: " + failure_});
  failure_.clear();
}

RgbdFramePtr LiveSource::next() {
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::milliseconds kPoll(50);  // interval at which `stop` is asked
  const std::chrono::duration<double> patience(following_.patience);
  const auto began = Clock::now();
  std::unique_lock lock(mutex_);
  while (waiting_.empty() && !at_end_ && Clock::now() - began < patience &&
         !(following_.stop && following_.stop())) {
    changed_.wait_for(lock, kPoll);
  }
  list_dropped();
  if (waiting_.empty() || (following_.stop && following_.stop())) return nullptr;
  const auto frame = std::move(waiting_.front());
  waiting_.pop_front();
  frame->index = next_index_++;
  return frame;
}

}  // namespace stillmap
