// SPDX-License-Identifier: Apache-2.0
#include "run_sinks.hpp"

#include "stillmap/base/machine.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/pipeline/run_journal.hpp"
#include "stillmap/report/figure_recorder.hpp"
#include "stillmap/report/gallery.hpp"
#include "stillmap/report/live_changes.hpp"
#include "stillmap/report/live_trajectory.hpp"
#include "stillmap/report/obstacle_files.hpp"
#include "stillmap/view/live_view.hpp"

#include <filesystem>
#include <functional>
#include <optional>
#include <utility>

#include "warning_recorder.hpp"

namespace stillmap {
namespace {

/// The journal in the folder of a run.
class JournalSink final : public RunSink {
 public:
  JournalSink(const Session& session, SlamSystem& slam, ResultFolder& folder) {
    const JournalHeading heading{"stillmap " STILLMAP_VERSION, session.sequence,
                                 machine_description(), options_yaml(session.options)};
    folder.write(kRunJournal,
                 [&](const std::filesystem::path& file) { journal_.emplace(slam, file, heading); });
  }

  void on_frame(SlamSystem& /*slam*/) override {
    if (journal_) journal_->add_newest();
  }
  void on_last_frame(RunRecord& /*record*/) override {
    if (journal_) journal_->flush();
    journal_.reset();
  }

 private:
  std::optional<RunJournal> journal_;  // none: the file cannot be written
};

/// Returns what the user told of the ground.
GroundHints ground_hints(const Session& session) {
  GroundHints hints{.rules_up = std::nullopt, .floor = session.outputs.dense.floor};
  if (session.rules && session.rules->up_is_given) hints.rules_up = session.rules->up;
  return hints;
}

std::unique_ptr<WarningRecorder> warning_recorder(const Session& session, ResultFolder& folder,
                                                  ViewServer* server, bool has_network) {
  std::function<void(const nlohmann::json&)> show;
  if (server != nullptr) {
    show = [server](const nlohmann::json& message) { server->board().publish(message); };
    show(points_message(*session.rules));
  }
  auto recorder = std::make_unique<WarningRecorder>(
      *session.rules, folder, WarningOutputs{.show = std::move(show), .lines = session.event_lines},
      has_network);
  recorder->send_events();
  if (session.options.realtime() || session.live) recorder->watch_for_silence();
  return recorder;
}

std::unique_ptr<LiveChanges> live_changes(const Session& session, SlamSystem& slam,
                                          ResultFolder& folder) {
  std::function<void(const std::string&)> show;
  if (!session.quiet) show = [](const std::string& line) { print_out("{}\n", line); };
  return std::make_unique<LiveChanges>(slam, session.parameters, folder, std::move(show));
}

}  // namespace

RunSinks sinks_of(const Session& session, SlamSystem& slam, ResultFolder& folder,
                  ViewServer* server, bool has_network) {
  const RunOutputs& outputs = session.outputs;
  RunSinks sinks;
  sinks.push_back(std::make_unique<LiveTrajectory>(folder));
  if (outputs.dense.planner)
    sinks.push_back(std::make_unique<LiveObstacles>(folder, outputs.dense.floor));
  sinks.push_back(std::make_unique<Gallery>(session.total_frames));
  sinks.push_back(std::make_unique<LabelRecorder>(outputs.labels, folder));
  sinks.push_back(std::make_unique<FigureRecorder>(outputs.figures,
                                                   session.options.dense.excluded_classes, folder));
  if (session.rules) sinks.push_back(warning_recorder(session, folder, server, has_network));
  if (session.loaded && session.loaded->extended && session.options.dense.enabled)
    sinks.push_back(live_changes(session, slam, folder));
  if (server != nullptr) {
    sinks.push_back(std::make_unique<LiveView>(slam, *server, session.sequence, slam.camera(),
                                               session.total_frames, ground_hints(session)));
  }
  sinks.push_back(std::make_unique<JournalSink>(session, slam, folder));
  return sinks;
}

}  // namespace stillmap
