// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/trace.hpp"

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>
#include <type_traits>
#include <utility>

namespace stillmap {

/// What push() does when the queue is full.
enum class WhenFull {
  kBlock,  ///< waits for room: nothing is lost
  kDrop,   ///< refuses, and counts it: the caller never waits
};

/// How far a stage's thread stands back where there are fewer cores than work: nice values, of
/// which each is worth a fifth of a core's time. What the camera waits for stands first; the last,
/// kIdle, takes only what all others leave, and gives way at once to any that wakes (SCHED_IDLE).
enum class ThreadPriority : int { kNone = 0, kMap = 5, kNetwork = 5, kBackground = 10, kIdle = 19 };

/// Makes the calling thread stand back; without effect where the system knows no nice threads.
void lower_priority(ThreadPriority priority);

/// A thread around a synchronous algorithm: a bounded queue in, an unbounded one out, and the only
/// mutex of the house. Inputs are worked on in the order they were pushed, one at a time; each may
/// publish any number of outputs. What the work throws is thrown again by the caller's next push,
/// take or drain.
///
/// If the thread that makes it is traced, so is its own, on a track of the stage's name, which also
/// tells how long the queue is; and whoever waits for it is seen waiting.
template <typename In, typename Out>
class Stage {
 public:
  /// Hands on one output; for the work to call.
  using Publish = std::function<void(Out)>;
  using Work = std::function<void(In, const Publish&)>;

  Stage(std::size_t capacity, WhenFull when_full, Work work, const std::string& name = "stage",
        ThreadPriority priority = ThreadPriority::kNone)
      : capacity_(capacity), when_full_(when_full), work_(std::move(work)) {
    if (const TraceTrack* maker = bound_trace_track()) track_ = &maker->trace().add_track(name);
    thread_ = std::jthread([this, priority](std::stop_token stop) {
      lower_priority(priority);
      run(stop);
    });
  }
  /// Ends after the input being worked on; queued ones are dropped. drain() first to keep them.
  ~Stage() = default;
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  /// False if the input was dropped.
  bool push(In input) {
    std::unique_lock lock(mutex_);
    if (when_full_ == WhenFull::kBlock) {
      wait(lock, [&] { return inputs_.size() < capacity_ || failure_; });
    }
    rethrow_failure();
    if (inputs_.size() >= capacity_) {
      ++dropped_;
      return false;
    }
    inputs_.push_back(std::move(input));
    if (track_ != nullptr) trace_count(track_->name(), inputs_.size());
    changed_.notify_all();
    return true;
  }

  /// The next output, waiting for it; none once everything pushed has been worked on and taken.
  std::optional<Out> take() {
    std::unique_lock lock(mutex_);
    wait(lock, [&] { return !outputs_.empty() || idle() || failure_; });
    rethrow_failure();
    return pop();
  }

  /// The next output if there is one already.
  std::optional<Out> try_take() {
    std::unique_lock lock(mutex_);
    rethrow_failure();
    return pop();
  }

  /// Waits until everything pushed has been worked on.
  void drain() {
    std::unique_lock lock(mutex_);
    wait(lock, [&] { return idle() || failure_; });
    rethrow_failure();
  }

  /// Runs a function on the stage's thread between two inputs, whatever waits in the queue. May be
  /// called by any thread. The result, or what the function throws, comes with the future.
  template <typename Function>
  auto ask(Function function) {
    using Result = std::invoke_result_t<Function>;
    auto question = std::make_shared<std::packaged_task<Result()>>(std::move(function));
    std::future<Result> answer = question->get_future();
    std::unique_lock lock(mutex_);
    questions_.emplace_back([question] { (*question)(); });
    changed_.notify_all();
    return answer;
  }

  /// Inputs waiting, the one being worked on not counted.
  std::size_t waiting() const {
    std::unique_lock lock(mutex_);
    return inputs_.size();
  }
  std::size_t dropped() const {
    std::unique_lock lock(mutex_);
    return dropped_;
  }

 private:
  template <typename Condition>
  void wait(std::unique_lock<std::mutex>& lock, const Condition& condition) {
    if (condition()) return;
    const TraceScope waiting(track_ != nullptr ? std::string_view(track_->waiting()) : "waiting");
    changed_.wait(lock, condition);
  }

  bool idle() const { return inputs_.empty() && !working_; }

  std::optional<Out> pop() {
    if (outputs_.empty()) return std::nullopt;
    std::optional<Out> output = std::move(outputs_.front());
    outputs_.pop_front();
    return output;
  }

  void rethrow_failure() {
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  }

  std::optional<In> next_input(std::stop_token stop) {
    std::unique_lock lock(mutex_);
    working_ = false;
    changed_.notify_all();
    const auto has_work = [&] { return !inputs_.empty() || !questions_.empty(); };
    while (changed_.wait(lock, stop, has_work) && !stop.stop_requested()) {
      if (questions_.empty()) return pop_input();
      const std::function<void()> question = std::move(questions_.front());
      questions_.pop_front();
      lock.unlock();
      question();
      lock.lock();
    }
    return std::nullopt;
  }

  std::optional<In> pop_input() {
    std::optional<In> input = std::move(inputs_.front());
    inputs_.pop_front();
    if (track_ != nullptr) trace_count(track_->name(), inputs_.size());
    working_ = true;
    changed_.notify_all();
    return input;
  }

  void run(std::stop_token stop) {
    const TraceBinding binding(track_);
    const Publish publish = [this](Out output) {
      std::unique_lock lock(mutex_);
      outputs_.push_back(std::move(output));
      changed_.notify_all();
    };
    while (auto input = next_input(stop)) {
      try {
        work_(std::move(*input), publish);
      } catch (...) {
        std::unique_lock lock(mutex_);
        failure_ = std::current_exception();
        inputs_.clear();
      }
    }
  }

  const std::size_t capacity_;
  const WhenFull when_full_;
  const Work work_;
  TraceTrack* track_ = nullptr;  // null: nobody listens

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<In> inputs_;
  std::deque<Out> outputs_;
  std::deque<std::function<void()>> questions_;
  bool working_ = false;
  std::size_t dropped_ = 0;
  std::exception_ptr failure_;
  std::jthread thread_;  // last: it ends before the rest goes
};

}  // namespace stillmap
