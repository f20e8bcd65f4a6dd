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

/// What changed since the loaded map was made, for a run that extends it: every 10 seconds of the
/// recording and at the end, the views so far are compared with those of the loaded map
/// (newest_changes()) on a thread of its own. Each object that two comparisons in a row find, so
/// that somebody who stood still for a moment is none, or the last one, is a line of the file: a
/// JSON object with "timestamp", that of the newest frame compared [s], and as in change_json(). In
/// lockstep the lines are the same in every run, and are written with the next comparison; in
/// realtime at once.
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
