// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/trace.hpp"

#include <algorithm>
#include <ctime>
#include <utility>

namespace stillmap {
namespace {

constexpr std::int64_t kCpuReading = 50'000;  // Time for which a CPU clock reading is reused [ns].
constexpr std::size_t kMostSpans = 1 << 21;   // Maximum number of spans of a track: about 100 MB.

std::int64_t thread_cpu() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return std::int64_t{1'000'000'000} * t.tv_sec + t.tv_nsec;
}

}  // namespace

TraceTrack::TraceTrack(Trace& trace, std::string name)
    : trace_(trace), name_(std::move(name)), waiting_("waiting for " + name_) {}

/// Returns the CPU time; it never runs backwards and never faster than the wall clock.
std::int64_t TraceTrack::cpu_at(std::int64_t now) {
  if (now >= asked_ + kCpuReading || asked_ == 0) {
    told_ = thread_cpu();
    asked_ = now;
  }
  latest_ = std::max(latest_, told_ + now - asked_);
  return latest_;
}

void TraceTrack::begin(std::string_view name) {
  const bool full = spans_.size() >= kMostSpans;
  left_out_ += full ? 1 : 0;
  open_.push_back(full ? -1 : static_cast<std::int32_t>(spans_.size()));
  if (full) return;
  const std::int32_t parent = open_.size() > 1 ? open_[open_.size() - 2] : -1;
  const std::int64_t now = trace_.now();
  spans_.push_back({name, now, -1, cpu_at(now), parent, frame_});
}

void TraceTrack::end() {
  const std::int32_t index = open_.back();
  open_.pop_back();
  if (index < 0) return;
  TraceSpan& span = spans_[static_cast<std::size_t>(index)];
  const std::int64_t now = trace_.now();
  span.wall = now - span.begin;
  span.cpu = cpu_at(now) - span.cpu;  // span.cpu held the start time until here.
}

void TraceTrack::count(std::string_view name, std::size_t value) {
  if (counts_.size() < kMostSpans)
    counts_.push_back({name, trace_.now(), static_cast<std::int64_t>(value)});
}

TraceTrack& Trace::add_track(std::string name) {
  return tracks_.emplace_back(*this, std::move(name));
}

std::int64_t Trace::now() const {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now() - start_).count();
}

}  // namespace stillmap
