// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/pipeline/map_changes.hpp"
#include "stillmap/report/live_lines.hpp"
#include "stillmap/report/run_sink.hpp"

#include <functional>
#include <future>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// Name of the file of LiveChanges.
constexpr const char* kLiveChanges = "changes.jsonl";

/// What changed since the loaded map was made, for a run that extends it. Every 10 seconds of the
/// recording and at its end, another thread compares the views of the run with those of the loaded
/// map: see newest_changes(). An object is written to the file when two successive comparisons find
/// it, since somebody who stands still for a moment is found by one only, or when the last
/// comparison finds it. Each line is the JSON object of change_json() with "timestamp", the time of
/// the newest frame that was compared [s]. In realtime a line is written when the comparison is
/// finished; in lockstep at the next comparison, so that all runs write the same lines.
class LiveChanges final : public RunSink {
 public:
  /// Starts the file. A problem is kept for ResultFolder::require_all().
  /// @param slam  must outlive it
  /// @param show  gets each change as a line of text, too; empty: it is not shown
  LiveChanges(SlamSystem& slam, const SlamParameters& options, ResultFolder& folder,
              std::function<void(const std::string&)> show);
  void on_frame(SlamSystem& slam) override;
  void on_last_frame(RunRecord& record) override;

 private:
  struct Comparison {
    double timestamp;  // of the newest frame [s]
    std::future<std::vector<MapChange>> changes;
  };
  void begin();
  bool is_ready() const;
  void tell(bool is_last = false);

  SlamSystem& slam_;
  const bool realtime_;
  const DenseOptions options_;
  LiveLines lines_;
  std::function<void(const std::string&)> show_;
  std::optional<double> next_;       // time of the next comparison [s]
  std::optional<Comparison> begun_;  // none: there is no result to come
  std::vector<MapChange> before_;    // result of the comparison before
  std::vector<MapChange> told_;
};

}  // namespace stillmap
