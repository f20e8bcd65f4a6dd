// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace stillmap {

class Trace;

/// What a thread did from one moment to a later one. Times are nanoseconds since the trace began.
struct TraceSpan {
  std::string_view name;
  std::int64_t begin = 0;
  std::int64_t wall = -1;    ///< that it took; -1 while it is not over
  std::int64_t cpu = 0;      ///< of it, computing on this thread; see TraceTrack
  std::int32_t parent = -1;  ///< the span around it, by its position in the track; -1: none
  std::int32_t frame = -1;   ///< index of the frame worked on; -1: of none
};

/// How many there were of something at a moment.
struct TraceCount {
  std::string_view name;
  std::int64_t at = 0;  ///< nanoseconds since the trace began
  std::int64_t value = 0;
};

/// All that one thread did. Written by that thread alone, without a lock; to be read when it rests.
///
/// CPU times come from the thread's own clock, which takes a system call (about a microsecond). So
/// it is asked at most every 50 microseconds; in between the thread is taken to be computing. A
/// span's CPU time is wrong by no more than that, and of spans in a row the errors do not add up.
class TraceTrack {
 public:
  TraceTrack(Trace& trace, std::string name);

  const std::string& name() const { return name_; }
  const std::deque<TraceSpan>& spans() const { return spans_; }  ///< in the order they began
  const std::deque<TraceCount>& counts() const { return counts_; }
  std::size_t left_out() const { return left_out_; }  ///< spans beyond the bound on memory
  Trace& trace() const { return trace_; }
  /// What a thread does that waits for this one.
  const std::string& waiting() const { return waiting_; }

  void begin(std::string_view name);
  void end();
  void count(std::string_view name, std::size_t value);
  /// From here on spans are about this frame.
  void set_frame(std::size_t index) { frame_ = static_cast<std::int32_t>(index); }

 private:
  std::int64_t cpu_at(std::int64_t now);

  Trace& trace_;
  const std::string name_, waiting_;
  std::deque<TraceSpan> spans_;
  std::deque<TraceCount> counts_;
  std::vector<std::int32_t> open_;  // spans that are not over, the innermost last
  std::int32_t frame_ = -1;
  std::int64_t asked_ = 0, told_ = 0, latest_ = 0;  // of the CPU clock: when, what; what was said
  std::size_t left_out_ = 0;
};

/// The profile of a run: one track per thread. Everything that writes to it must have ended, or
/// rest, before it is read, and must end before it does.
class Trace {
 public:
  Trace() = default;
  Trace(const Trace&) = delete;
  Trace& operator=(const Trace&) = delete;

  /// A new track, for one thread; stays valid as long as the trace. One thread asks for all of
  /// them.
  TraceTrack& add_track(std::string name);
  const std::deque<TraceTrack>& tracks() const { return tracks_; }  ///< in the order they were made
  std::int64_t now() const;  ///< nanoseconds since the trace began

 private:
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start_ = Clock::now();
  std::deque<TraceTrack> tracks_;
};

/// The track that the calling thread writes to; null: nobody listens.
inline TraceTrack*& bound_trace_track() {
  thread_local constinit TraceTrack* track = nullptr;
  return track;
}

/// While it lives, the calling thread writes to this track; null: to none.
class TraceBinding {
 public:
  explicit TraceBinding(TraceTrack* track) : before_(bound_trace_track()) {
    bound_trace_track() = track;
  }
  ~TraceBinding() { bound_trace_track() = before_; }
  TraceBinding(const TraceBinding&) = delete;
  TraceBinding& operator=(const TraceBinding&) = delete;

 private:
  TraceTrack* before_;
};

/// What happens while it lives is a span of the calling thread's track. Where none is bound it
/// costs one branch. The name must outlive the trace: a literal.
class TraceScope {
 public:
  explicit TraceScope(std::string_view name) : track_(bound_trace_track()) {
    if (track_ != nullptr) track_->begin(name);
  }
  ~TraceScope() {
    if (track_ != nullptr) track_->end();
  }
  TraceScope(const TraceScope&) = delete;
  TraceScope& operator=(const TraceScope&) = delete;

 private:
  TraceTrack* track_;
};

/// What a call returns; the call is a span.
template <typename Call>
decltype(auto) traced(std::string_view name, Call&& call) {
  const TraceScope scope(name);
  return std::forward<Call>(call)();
}

/// From here on the calling thread works on this frame.
inline void trace_frame(std::size_t index) {
  if (TraceTrack* track = bound_trace_track()) track->set_frame(index);
}

/// There are so many now; the name as for TraceScope.
inline void trace_count(std::string_view name, std::size_t value) {
  if (TraceTrack* track = bound_trace_track()) track->count(name, value);
}

}  // namespace stillmap
