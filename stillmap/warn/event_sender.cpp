// SPDX-License-Identifier: Apache-2.0
#include "stillmap/warn/event_sender.hpp"

#include <utility>

namespace stillmap {

EventSender::EventSender(Deliver deliver)
    : deliver_(std::move(deliver)), thread_([this](const std::stop_token& stop) { run(stop); }) {}

void EventSender::send(std::string event) {
  const std::unique_lock lock(mutex_);
  if (queue_.size() == kQueue) {
    queue_.pop_front();
    ++counts_.dropped;
  }
  queue_.push_back(std::move(event));
  changed_.notify_all();
}

void EventSender::begin_finish() {
  {
    const std::unique_lock lock(mutex_);
    if (!thread_.get_stop_token().stop_requested()) finish_ = std::chrono::steady_clock::now();
  }
  thread_.request_stop();
}

SentEvents EventSender::finish() {
  if (thread_.joinable()) {
    begin_finish();
    thread_.join();
    counts_.dropped += queue_.size();
    queue_.clear();
  }
  return counts_;
}

void EventSender::run(const std::stop_token& stop) {
  const auto too_late = [&] { return std::chrono::steady_clock::now() > finish_ + kFarewell; };
  bool given_up = false;
  std::unique_lock lock(mutex_);
  while (!given_up) {
    changed_.wait(lock, stop, [&] { return !queue_.empty(); });
    const bool finishing = stop.stop_requested();
    if (queue_.empty() || (finishing && too_late())) return;
    std::string event = std::move(queue_.front());
    queue_.pop_front();
    lock.unlock();
    Delivery delivery = deliver_(event);
    lock.lock();
    if (delivery.result != Delivered::kLater) {
      ++(delivery.result == Delivered::kYes ? counts_.sent : counts_.refused);
      continue;
    }
    counts_.reason = std::move(delivery.reason);
    given_up = finishing;
    if (queue_.size() < kQueue) {
      queue_.push_front(std::move(event));
    } else {
      ++counts_.dropped;
    }
    changed_.wait_for(lock, stop, kRetry, [] { return false; });
  }
}

}  // namespace stillmap
