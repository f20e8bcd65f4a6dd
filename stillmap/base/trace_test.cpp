// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/trace.hpp"

#include <atomic>
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr std::int64_t kReading = 50'000;  // Maximum error of a CPU time [ns].

std::vector<std::string> names_of(const TraceTrack& track) {
  std::vector<std::string> names;
  for (const TraceSpan& span : track.spans()) names.emplace_back(span.name);
  return names;
}

void sleep(int milliseconds) {
  std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
}

TEST(Trace, SpansAreNested) {
  Trace trace;
  TraceTrack& track = trace.add_track("camera");
  {
    const TraceBinding binding(&track);
    trace_frame(7);
    const TraceScope outer("frame");
    { const TraceScope inner("features"); }
    const TraceScope inner("pose");
    const TraceScope innermost("solve");
  }
  EXPECT_EQ(names_of(track), (std::vector<std::string>{"frame", "features", "pose", "solve"}));
  const auto& spans = track.spans();
  EXPECT_EQ(spans[0].parent, -1);
  EXPECT_EQ(spans[1].parent, 0);
  EXPECT_EQ(spans[2].parent, 0);
  EXPECT_EQ(spans[3].parent, 2);
  for (const TraceSpan& span : spans) {
    EXPECT_EQ(span.frame, 7);
    ASSERT_GE(span.wall, 0);
    if (span.parent < 0) continue;
    const TraceSpan& parent = spans[static_cast<std::size_t>(span.parent)];
    EXPECT_GE(span.begin, parent.begin);
    EXPECT_LE(span.begin + span.wall, parent.begin + parent.wall);
  }
  EXPECT_GE(spans[2].begin, spans[1].begin + spans[1].wall) << "the spans are consecutive";
}

TEST(Trace, AThreadWithoutTrackRecordsNothing) {
  Trace trace;
  const TraceTrack& track = trace.add_track("camera");
  trace_frame(1);
  trace_count("queue", 3);
  { const TraceScope scope("frame"); }
  EXPECT_TRUE(track.spans().empty());
  EXPECT_TRUE(track.counts().empty());
}

TEST(Trace, ABindingEndsWithItsScope) {
  Trace trace;
  TraceTrack& outer = trace.add_track("outer");
  TraceTrack& inner = trace.add_track("inner");
  {
    const TraceBinding first(&outer);
    {
      const TraceBinding second(&inner);
      const TraceScope scope("in");
    }
    {
      const TraceBinding nobody(nullptr);
      const TraceScope scope("unheard");
    }
    const TraceScope scope("out");
  }
  EXPECT_EQ(bound_trace_track(), nullptr);
  EXPECT_EQ(names_of(inner), (std::vector<std::string>{"in"}));
  EXPECT_EQ(names_of(outer), (std::vector<std::string>{"out"}));
}

TEST(Trace, EachThreadWritesToItsOwnTrack) {
  Trace trace;
  constexpr int kThreads = 4, kSpans = 2000;
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t) {
    threads.emplace_back([&track = trace.add_track(std::to_string(t))] {
      const TraceBinding binding(&track);
      for (int i = 0; i < kSpans; ++i) {
        trace_frame(static_cast<std::size_t>(i));
        const TraceScope scope("work");
        trace_count("done", static_cast<std::size_t>(i));
      }
    });
  }
  for (auto& thread : threads) thread.join();
  ASSERT_EQ(trace.tracks().size(), std::size_t{kThreads});
  for (const TraceTrack& track : trace.tracks()) {
    ASSERT_EQ(track.spans().size(), std::size_t{kSpans});
    ASSERT_EQ(track.counts().size(), std::size_t{kSpans});
    for (int i = 0; i < kSpans; ++i) {
      EXPECT_EQ(track.spans()[static_cast<std::size_t>(i)].frame, i);
      EXPECT_EQ(track.counts()[static_cast<std::size_t>(i)].value, i);
    }
  }
}

TEST(Trace, TimesAreSumsByNameAndFrame) {
  Trace trace;
  TraceTrack& track = trace.add_track("camera");
  const TraceBinding binding(&track);
  for (std::size_t frame = 0; frame < 3; ++frame) {
    trace_frame(frame);
    for (std::size_t i = 0; i <= frame; ++i) const TraceScope scope("solve");
  }
  trace_no_frame();
  for (int i = 0; i < 2; ++i) const TraceScope scope("solve");
  // Frames of one, two and three spans, and two spans of no frame.
  const auto wall = [&](std::size_t i) {
    return 1e-6 * static_cast<double>(track.spans()[i].wall);
  };
  const std::vector<double> expected = {wall(0), wall(1) + wall(2), wall(3) + wall(4) + wall(5),
                                        wall(6), wall(7)};
  const StageSamples times = track.times("solve");
  ASSERT_EQ(times.kept().size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_DOUBLE_EQ(times.kept()[i], expected[i]) << i;
  }
  EXPECT_TRUE(track.times("unknown").kept().empty());
}

TEST(Trace, TheTimeInAFrameIsThatOfThePresentOne) {
  Trace trace(TraceDetail::kTimes);
  TraceTrack& track = trace.add_track("camera");
  const TraceBinding binding(&track);
  trace_frame(3);
  traced("match", [] { sleep(2); });
  EXPECT_GE(track.in_frame("match"), 2);
  trace_frame(4);
  EXPECT_EQ(track.in_frame("match"), 0);
  EXPECT_TRUE(track.spans().empty()) << "only times are kept";
}

/// CPU time excludes sleeping and includes computing; neither may exceed the wall time.
TEST(Trace, CpuTimeCountsOnlyComputing) {
  Trace trace;
  TraceTrack& track = trace.add_track("camera");
  {
    const TraceBinding binding(&track);
    const TraceScope both("both");
    {
      const TraceScope scope("sleep");
      sleep(20);
    }
    const TraceScope scope("compute");
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(5);
    std::atomic<int> n{0};
    while (std::chrono::steady_clock::now() < end) ++n;
  }
  for (const TraceSpan& span : track.spans()) {
    EXPECT_GE(span.cpu, 0);
    EXPECT_LE(span.cpu, span.wall + kReading) << span.name;
  }
  const auto &both = track.spans()[0], &asleep = track.spans()[1], &computing = track.spans()[2];
  EXPECT_LT(asleep.cpu, asleep.wall / 4);
  EXPECT_GT(computing.cpu, 0);
  EXPECT_GE(both.cpu + kReading, asleep.cpu + computing.cpu);
}

/// Short spans share one reading of the CPU clock; their sum must equal the total.
TEST(Trace, CpuErrorsOfConsecutiveSpansDoNotAccumulate) {
  Trace trace;
  TraceTrack& track = trace.add_track("camera");
  {
    const TraceBinding binding(&track);
    const TraceScope all("all");
    for (int i = 0; i < 20000; ++i) const TraceScope scope("part");
  }
  std::int64_t parts = 0;
  for (const TraceSpan& span : track.spans()) parts += span.parent == 0 ? span.cpu : 0;
  EXPECT_LE(parts, track.spans()[0].cpu + kReading);
}

}  // namespace
}  // namespace stillmap
