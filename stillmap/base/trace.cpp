// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/trace.hpp"

#include <algorithm>
#include <ctime>
#include <new>
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

std::string waiting_span(std::string_view thread) { return "waiting for " + std::string(thread); }

TraceTrack::TraceTrack(Trace& trace, std::string name)
    : trace_(trace), name_(std::move(name)), waiting_(waiting_span(name_)) {}

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
  const std::int64_t now = trace_.now();
  const bool kept = trace_.detail() == TraceDetail::kSpans;
  open_.push_back({name, now, kept ? keep_span(name, now) : -1});
}

/// Returns the index of the span; -1 if there are too many.
std::int32_t TraceTrack::keep_span(std::string_view name, std::int64_t now) {
  if (spans_.size() >= kMostSpans) {
    ++left_out_;
    return -1;
  }
  const std::int32_t parent = open_.empty() ? -1 : open_.back().span;
  spans_.push_back({name, now, -1, cpu_at(now), parent, frame_});
  return static_cast<std::int32_t>(spans_.size() - 1);
}

void TraceTrack::end() {
  const Open open = open_.back();
  open_.pop_back();
  const std::int64_t now = trace_.now();
  try {
    add_time(open.name, 1e-6 * static_cast<double>(now - open.begin));
  } catch (const std::bad_alloc&) {
    return;  // A destructor cannot pass it on; the next allocation of the run does.
  }
  if (open.span < 0) return;
  TraceSpan& span = spans_[static_cast<std::size_t>(open.span)];
  span.wall = now - span.begin;
  span.cpu = cpu_at(now) - span.cpu;  // span.cpu held the start time until here.
}

/// Compares addresses first, since names are literals and nearly always the same one.
const TraceTrack::Total* TraceTrack::find_total(std::string_view name) const {
  for (const Total& total : totals_) {
    if (total.name.data() == name.data() && total.name.size() == name.size()) return &total;
  }
  for (const Total& total : totals_) {
    if (total.name == name) return &total;
  }
  return nullptr;
}

void TraceTrack::add_time(std::string_view name, double milliseconds) {
  const Total* found = find_total(name);
  if (found == nullptr) found = &totals_.emplace_back(Total{.name = name, .samples = {}});
  Total& total = totals_[static_cast<std::size_t>(found - totals_.data())];
  if (total.frame >= 0 && total.frame != frame_) {
    total.samples.add(total.sum);
    total.sum = 0;
  }
  total.frame = frame_;
  if (frame_ < 0) {
    total.samples.add(milliseconds);
  } else {
    total.sum += milliseconds;
  }
}

StageSamples TraceTrack::times(std::string_view name) const {
  const Total* total = find_total(name);
  if (total == nullptr) return {};
  StageSamples samples = total->samples;
  if (total->frame >= 0) samples.add(total->sum);
  return samples;
}

double TraceTrack::in_frame(std::string_view name) const {
  const Total* total = find_total(name);
  return total != nullptr && total->frame == frame_ ? total->sum : 0;
}

void TraceTrack::count(std::string_view name, std::size_t value) {
  if (trace_.detail() == TraceDetail::kSpans && counts_.size() < kMostSpans)
    counts_.push_back({name, trace_.now(), static_cast<std::int64_t>(value)});
}

TraceTrack& Trace::add_track(std::string name) {
  return tracks_.emplace_back(*this, std::move(name));
}

std::int64_t Trace::now() const {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now() - start_).count();
}

}  // namespace stillmap
