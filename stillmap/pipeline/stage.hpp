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
  kBlock,  ///< Waits for a free place, so that nothing is lost.
  kDrop,   ///< Drops the input and counts it, so that the caller never waits.
};

/// Priority of a stage's thread, as a nice value: with each step a thread gets about a fifth less
/// time than its competitors. Threads that the tracker waits for have the highest priority. A
/// thread of priority kIdle runs only on cores that are idle (SCHED_IDLE).
enum class ThreadPriority : int { kNone = 0, kMap = 5, kNetwork = 5, kBackground = 10, kIdle = 19 };

/// Lowers the priority of the calling thread; without effect on systems without nice values.
void lower_priority(ThreadPriority priority);

/// A thread around a synchronous algorithm, with a bounded queue of inputs, an unbounded queue of
/// outputs and the only mutex of the program. Inputs are processed in the order they were pushed,
/// one at a time; each may publish any number of outputs. An exception of the work is thrown again
/// by the caller's next push, pop or drain.
///
/// If the constructing thread is traced, the stage's thread gets a track of the stage's name, which
/// also records the length of the input queue, and threads that wait for the stage get a span.
template <typename In, typename Out>
class Stage {
 public:
  /// Called by the work to publish one output.
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
  /// Ends after the input in progress. Queued inputs are dropped, unless drain() was called first.
  ~Stage() = default;
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  /// Adds an input. Returns false if it was dropped.
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

  /// Waits for the next output and returns it; none once all inputs are processed and all outputs
  /// returned.
  std::optional<Out> pop() {
    std::unique_lock lock(mutex_);
    wait(lock, [&] { return !outputs_.empty() || idle() || failure_; });
    rethrow_failure();
    return pop_output();
  }

  /// Returns the next output if it is available.
  std::optional<Out> try_pop() {
    std::unique_lock lock(mutex_);
    rethrow_failure();
    return pop_output();
  }

  /// Waits until all inputs are processed.
  void drain() {
    std::unique_lock lock(mutex_);
    wait(lock, [&] { return idle() || failure_; });
    rethrow_failure();
  }

  /// Runs a function on the stage's thread between two inputs, before the queued ones. May be
  /// called by any thread. The future holds the result or the exception of the function.
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

  /// Returns the number of queued inputs, without the one in progress.
  std::size_t waiting() const {
    std::unique_lock lock(mutex_);
    return inputs_.size();
  }
  /// Returns the number of dropped inputs.
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

  std::optional<Out> pop_output() {
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
  TraceTrack* track_ = nullptr;  // null: the stage is not traced

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<In> inputs_;
  std::deque<Out> outputs_;
  std::deque<std::function<void()>> questions_;
  bool working_ = false;
  std::size_t dropped_ = 0;
  std::exception_ptr failure_;
  std::jthread thread_;  // last, so that it ends before the other members are destroyed
};

}  // namespace stillmap
