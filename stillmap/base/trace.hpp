// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/stage_times.hpp"

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

/// Returns the name of the span of a thread that waits for the thread of this name.
std::string waiting_span(std::string_view thread);

/// An interval of work of a thread. Times are nanoseconds since the start of the trace.
struct TraceSpan {
  std::string_view name;
  std::int64_t begin = 0;
  std::int64_t wall = -1;    ///< Wall time [ns]; -1 until the span ends.
  std::int64_t cpu = 0;      ///< CPU time of this thread [ns]; see TraceTrack.
  std::int32_t parent = -1;  ///< Index of the enclosing span in the track; -1: none.
  std::int32_t frame = -1;   ///< Index of the processed frame; -1: none.
};

/// Value of a counter at a point in time.
struct TraceCount {
  std::string_view name;
  std::int64_t at = 0;  ///< Time since the start of the trace [ns].
  std::int64_t value = 0;
};

/// Data that a trace keeps.
enum class TraceDetail {
  kTimes,  ///< The times by name, in bounded memory: cheap enough to be always on.
  kSpans,  ///< Also each span and count.
};

/// All spans of one thread. Written by that thread alone, without a lock; read while the thread is
/// idle.
///
/// CPU times come from the thread's CPU clock, which needs a system call (about a microsecond). So
/// it is read at most every 50 microseconds; in between the thread is assumed to compute. The CPU
/// time of a span is wrong by no more than that, and errors of consecutive spans do not accumulate.
class TraceTrack {
 public:
  TraceTrack(Trace& trace, std::string name);

  const std::string& name() const { return name_; }
  const std::deque<TraceSpan>& spans() const { return spans_; }  ///< In the order of their start.
  const std::deque<TraceCount>& counts() const { return counts_; }
  /// Number of spans dropped by the memory bound.
  std::size_t left_out() const { return left_out_; }
  Trace& trace() const { return trace_; }
  /// Returns waiting_span() of this thread.
  const std::string& waiting() const { return waiting_; }

  /// Returns the times of the spans of one name [ms]: a sample per frame, the sum over its spans,
  /// and a sample for each span without a frame. Spans that have not ended are left out.
  StageSamples times(std::string_view name) const;
  /// Returns the total time of the ended spans of one name in the current frame [ms].
  double in_frame(std::string_view name) const;

  void begin(std::string_view name);
  void end();
  void count(std::string_view name, std::size_t value);
  /// Assigns the following spans to this frame.
  void set_frame(std::size_t index) { frame_ = static_cast<std::int32_t>(index); }
  /// Assigns the following spans to no frame.
  void leave_frame() { frame_ = -1; }

 private:
  struct Open {
    std::string_view name;
    std::int64_t begin = 0;
    std::int32_t span = -1;  // its index in spans_; -1: not kept
  };
  struct Total {
    std::string_view name;
    StageSamples samples;  // times of earlier frames, and of spans without a frame
    double sum = 0;        // total time within `frame` [ms]
    std::int32_t frame = -1;
  };

  std::int64_t cpu_at(std::int64_t now);
  std::int32_t keep_span(std::string_view name, std::int64_t now);
  const Total* find_total(std::string_view name) const;
  void add_time(std::string_view name, double milliseconds);

  Trace& trace_;
  const std::string name_, waiting_;
  std::deque<TraceSpan> spans_;
  std::deque<TraceCount> counts_;
  std::vector<Open> open_;  // open spans, the innermost last
  std::vector<Total> totals_;
  std::int32_t frame_ = -1;
  // Wall time and value of the last reading of the CPU clock; last returned value [ns].
  std::int64_t asked_ = 0, told_ = 0, latest_ = 0;
  std::size_t left_out_ = 0;
};

/// Profile of a run: one track per thread. All writing threads must have ended or be idle while it
/// is read, and must end before it is destroyed.
class Trace {
 public:
  explicit Trace(TraceDetail detail = TraceDetail::kSpans) : detail_(detail) {}
  Trace(const Trace&) = delete;
  Trace& operator=(const Trace&) = delete;

  /// Adds a track for one thread, valid as long as the trace. All tracks are added from one thread.
  TraceTrack& add_track(std::string name);
  const std::deque<TraceTrack>& tracks() const { return tracks_; }  ///< In creation order.
  std::int64_t now() const;  ///< Time since the start of the trace [ns].
  TraceDetail detail() const { return detail_; }

 private:
  using Clock = std::chrono::steady_clock;
  const TraceDetail detail_;
  const Clock::time_point start_ = Clock::now();
  std::deque<TraceTrack> tracks_;
};

/// Track of the calling thread; null: no tracing.
inline TraceTrack*& bound_trace_track() {
  thread_local constinit TraceTrack* track = nullptr;
  return track;
}

/// While in scope, the calling thread writes to this track; null: to none.
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

/// Records its lifetime as a span in the track of the calling thread; costs one branch without a
/// track. The name must outlive the trace: use a literal.
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

/// Calls a function within a span and returns its result.
template <typename Call>
decltype(auto) traced(std::string_view name, Call&& call) {
  const TraceScope scope(name);
  return std::forward<Call>(call)();
}

/// Assigns the following work of the calling thread to this frame.
inline void trace_frame(std::size_t index) {
  if (TraceTrack* track = bound_trace_track()) track->set_frame(index);
}

/// Assigns the following work of the calling thread to no frame.
inline void trace_no_frame() {
  if (TraceTrack* track = bound_trace_track()) track->leave_frame();
}

/// Returns the total time of the calling thread's ended spans of one name in its current frame
/// [ms]; 0 if no track is bound.
inline double traced_in_frame(std::string_view name) {
  const TraceTrack* track = bound_trace_track();
  return track != nullptr ? track->in_frame(name) : 0;
}

/// Records the value of a counter; the name as for TraceScope.
inline void trace_count(std::string_view name, std::size_t value) {
  if (TraceTrack* track = bound_trace_track()) track->count(name, value);
}

}  // namespace stillmap
