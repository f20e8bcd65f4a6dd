// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/trace.hpp"
#include "stillmap/report/svg.hpp"

#include <string>
#include <vector>

namespace stillmap {

/// Time of one function, called by one caller.
struct ProfileRow {
  std::string name;
  /// Depth in the call tree; the caller is the nearest row above with a smaller depth, and the
  /// thread itself for depth 0.
  int depth = 0;
  std::size_t calls = 0;                           ///< Number of calls.
  double median = 0, p95 = 0, max = 0, total = 0;  ///< Wall time of the calls [ms].
  double cpu = 0;                                  ///< CPU time of all calls on this thread [ms].
  double cpu_self = 0;                             ///< CPU time without that of the callees [ms].
};

/// Time of one thread.
struct ThreadProfile {
  std::string name;
  double cpu = 0;                ///< CPU time within its spans [ms].
  std::vector<ProfileRow> rows;  ///< Callers before their callees, in order of the first call.
  std::size_t left_out = 0;      ///< Number of spans beyond the bound on memory.
};

/// Distribution of the time of a run over threads and functions.
struct Profile {
  double seconds = 0;      ///< Time from the first span to the end of the last one [s].
  double process_cpu = 0;  ///< CPU time of all threads, including those without a track [ms].
  std::vector<ThreadProfile> threads;
  /// Returns the CPU time of the threads of the profile [ms].
  double cpu() const;
};

/// Returns the sums of a trace. Unfinished spans are ignored. All threads must be idle.
/// @param process_cpu CPU time of the process [ms]
Profile make_profile(const Trace& trace, double process_cpu);

/// Returns a table with one line per thread and function, callees indented; shares are relative to
/// the CPU time of all threads.
std::string profile_text(const Profile& profile);

/// Returns a few lines with the utilization of the threads and the functions with the largest CPU
/// time of their own.
std::string profile_in_brief(const Profile& profile);

/// Returns the trace for chrome://tracing and ui.perfetto.dev: Chrome's Trace Event Format, with
/// complete events "X" with ts, dur and tdur (CPU time) in microseconds and the frame's index among
/// the args, counters "C", and the names of the threads.
std::string trace_json(const Trace& trace);

/// Draws the frame budget: the time line of one second in the middle of the run. Each thread has a
/// lane with its share of a core; spans are boxes, callees below their callers; lines mark the
/// beginnings of frames.
/// @param frame_name  name of the spans that represent one frame each
Svg profile_chart(const Trace& trace, std::string_view frame_name = "frame");

}  // namespace stillmap
