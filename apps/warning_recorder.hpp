// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/report/result_folder.hpp"
#include "stillmap/report/run_folder.hpp"
#include "stillmap/warn/warning_monitor.hpp"

#include <cstddef>
#include <fstream>
#include <functional>
#include <string>

namespace stillmap {

/// Evaluates the rules of --zones in each frame of a run. Each event is written at once: to
/// events.jsonl and to standard output.
class WarningRecorder {
 public:
  /// @param show  shows a JSON message (zones, warnings) in the view; empty: there is none
  WarningRecorder(const WarningRules& rules, ResultFolder& folder,
                  std::function<void(const nlohmann::json&)> show);

  /// Evaluates the frame pushed last. In lockstep this waits for its movers.
  void add_newest(SlamSystem& slam);
  /// Evaluates a frame.
  void add(const WatchedFrame& frame);

  std::size_t warnings() const { return warnings_; }  ///< Number of warnings that have begun.

 private:
  WarningMonitor monitor_;
  std::function<void(const nlohmann::json&)> show_;
  std::ofstream file_;
  std::size_t warnings_ = 0;
  double previous_ = 0;    // time of the previous frame [s]
  double frame_time_ = 0;  // time between the last two frames [s]
};

}  // namespace stillmap
