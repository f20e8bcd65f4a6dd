// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

namespace stillmap {

/// Result of an attempt to deliver an event.
enum class Delivered {
  kYes,
  kNo,     ///< The receiver refuses this event.
  kLater,  ///< The receiver cannot be reached now.
};

/// The result, and the reason if the receiver cannot be reached; empty if that is not known.
struct Delivery {
  Delivery(Delivered how, std::string why = "") : result(how), reason(std::move(why)) {}
  Delivered result;
  std::string reason;
};

/// Delivers an event to its receiver; takes at most 10 s to connect and 10 s until the answer.
using Deliver = std::function<Delivery(const std::string& event)>;

/// Numbers of events of a sender.
struct SentEvents {
  std::size_t sent = 0;     ///< Delivered.
  std::size_t refused = 0;  ///< The receiver refused them.
  std::size_t dropped = 0;  ///< Never delivered: the receiver was away or too slow for too long.
  std::string reason;       ///< Why the receiver could not be reached the last time.
};

/// Sends events from a thread of its own, in their order. While the receiver is away, up to kQueue
/// events wait and are tried again every kRetry; then the oldest are dropped. So nobody ever waits
/// for the receiver.
class EventSender {
 public:
  static constexpr std::size_t kQueue = 256;
  static constexpr std::chrono::milliseconds kRetry{1000};
  static constexpr std::chrono::milliseconds kFarewell{
      3000};  ///< Longest time after begin_finish().

  explicit EventSender(Deliver deliver);
  ~EventSender() { finish(); }
  EventSender(const EventSender&) = delete;
  EventSender& operator=(const EventSender&) = delete;

  /// Adds an event to the queue. Never waits for the receiver.
  void send(std::string event);

  /// Begins to finish, so that several senders finish at the same time: from now on the events that
  /// wait are sent for at most kFarewell after the attempt in progress. An attempt that fails is
  /// the last one: the events that still wait are dropped. Nothing may be sent after it. Does not
  /// wait.
  void begin_finish();

  /// begin_finish(), unless that was called already, and waits for the end.
  SentEvents finish();

 private:
  void run(const std::stop_token& stop);

  const Deliver deliver_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<std::string> queue_;                 // under the mutex
  SentEvents counts_;                             // under the mutex
  std::chrono::steady_clock::time_point finish_;  // under the mutex; time of begin_finish()
  std::jthread thread_;                           // last: it uses the above
};

}  // namespace stillmap
