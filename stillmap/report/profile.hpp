// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/trace.hpp"
#include "stillmap/report/svg.hpp"

#include <string>
#include <vector>

namespace stillmap {

/// What was spent on one function, called from one place; milliseconds.
struct ProfileRow {
  std::string name;
  int depth = 0;  ///< 0: called by the thread itself, else by the nearest row above with one less
  std::size_t calls = 0;
  double median = 0, p95 = 0, max = 0, total = 0;  ///< wall time
  double cpu = 0;                                  ///< computing on this thread, all calls
  double cpu_self = 0;                             ///< of it, not in the rows below that it called
};

/// What one thread did; milliseconds.
struct ThreadProfile {
  std::string name;
  double cpu = 0;                ///< computing, within its spans
  std::vector<ProfileRow> rows;  ///< callers before the called, else as first seen
  std::size_t left_out = 0;      ///< spans beyond the bound on memory
};

/// Where the time of a run went.
struct Profile {
  double seconds = 0;      ///< from the first span to the end of the last
  double process_cpu = 0;  ///< of all threads, those without track included; milliseconds
  std::vector<ThreadProfile> threads;
  /// Computing by the threads of the profile; milliseconds.
  double cpu() const;
};

/// Sums a trace up. Spans that are not over are left out. All threads must rest.
/// @param process_cpu what the process computed in all [milliseconds]
Profile make_profile(const Trace& trace, double process_cpu);

/// A table: a line per thread and function, callees indented; share is of all threads' CPU time.
std::string profile_text(const Profile& profile);

/// A few lines: how busy the threads were, and the functions that computed most themselves.
std::string profile_in_brief(const Profile& profile);

/// The trace for chrome://tracing and ui.perfetto.dev: Chrome's Trace Event Format, complete events
/// "X" with ts, dur and tdur (CPU time) in microseconds and the frame's index among the args,
/// counters "C", and the threads' names.
std::string trace_json(const Trace& trace);

/// The frame budget: time line of one second in the middle of the run. One lane per thread, with
/// its share of a core; spans as boxes, callees below their callers; lines where frames begin.
/// @param frame_name  name of the spans that are one frame each
Svg profile_chart(const Trace& trace, std::string_view frame_name = "frame");

}  // namespace stillmap
