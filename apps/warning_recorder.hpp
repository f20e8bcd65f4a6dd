// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/finding.hpp"
#include "stillmap/pipeline/frame_watch.hpp"
#include "stillmap/report/result_folder.hpp"
#include "stillmap/report/run_folder.hpp"
#include "stillmap/report/run_sink.hpp"
#include "stillmap/view/access_rules.hpp"
#include "stillmap/warn/event_sender.hpp"
#include "stillmap/warn/warning_monitor.hpp"

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdio>
#include <fstream>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

namespace stillmap {

/// Where events are shown besides events.jsonl.
struct WarningOutputs {
  /// Shows a JSON message (zones, warnings, events) in the view; empty: there is none.
  std::function<void(const nlohmann::json&)> show;
  std::FILE* lines = nullptr;  ///< Gets the lines of events.jsonl; null: sentences are printed.
};

/// Evaluates the rules of --zones in each frame of a run. Each event is written at once: to
/// events.jsonl, to standard output, and to the receivers of the rules. The rules are kept beside
/// the events.
class WarningRecorder final : public RunSink {
 public:
  /// Time without a frame after which a run says that nothing is known.
  static constexpr std::chrono::milliseconds kSilence{1000};

  /// @param has_network  whether there are masks to come
  WarningRecorder(const WarningRules& rules, ResultFolder& folder, WarningOutputs outputs,
                  bool has_network = false);
  ~WarningRecorder() override;
  WarningRecorder(const WarningRecorder&) = delete;
  WarningRecorder& operator=(const WarningRecorder&) = delete;

  /// Sends the events to the receivers of the rules, too. Throws Error if it cannot be done.
  void send_events();
  /// Announces from now on that no frame has come for kSilence, from a thread of its own.
  void watch_for_silence();

  /// Evaluates the frame pushed last. In lockstep this waits for its movers.
  void on_frame(SlamSystem& slam) override;
  /// Announces the end of the run, prints the number of events sent to each receiver, and adds all
  /// events to the record, with a finding for each receiver that got none.
  void on_last_frame(RunRecord& record) override;
  void on_failure() override { finish(); }
  /// Adds the finding that the zones stand tilted, if the floor says so.
  void on_results(RunRecord& record) override;
  /// Evaluates a frame.
  void add(const WatchedFrame& frame);

  std::size_t warnings() const { return warnings_; }  ///< Number of warnings that have begun.

 private:
  struct Receiver {
    EventAddress address;
    std::unique_ptr<EventSender> sender;
  };
  void finish();
  void record(const std::vector<WarningEvent>& events);

  std::mutex mutex_;  // of everything below
  WarningMonitor monitor_;
  FrameWatch watched_;  // used by the thread that pushes, without the mutex
  const WarningOutputs outputs_;
  const std::string run_ = random_token();  // tells the events of this run from those of others
  std::ofstream file_;
  std::vector<Finding> findings_;
  std::vector<WarningEvent> events_;
  std::vector<RunEvent> told_;
  std::vector<Receiver> receivers_;
  std::size_t warnings_ = 0;
  bool finished_ = false;
  // When the last frame came; none before the first.
  std::optional<std::chrono::steady_clock::time_point> newest_;
  std::condition_variable_any stopped_;
  std::jthread watch_;  // last: it uses the above
};

}  // namespace stillmap
