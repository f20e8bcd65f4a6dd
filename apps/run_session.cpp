// SPDX-License-Identifier: Apache-2.0
#include "run_session.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/journal_file.hpp"
#include "stillmap/base/machine.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/evaluate/timing.hpp"
#include "stillmap/pipeline/paced_source.hpp"
#include "stillmap/pipeline/prefetch.hpp"
#include "stillmap/pipeline/run_findings.hpp"
#include "stillmap/pipeline/run_journal.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/report/figure_recorder.hpp"
#include "stillmap/report/gallery.hpp"
#include "stillmap/report/live_trajectory.hpp"
#include "stillmap/report/obstacle_files.hpp"
#include "stillmap/sensor/frame_check.hpp"
#include "stillmap/view/live_view.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "interrupt.hpp"
#include "progress.hpp"
#include "warning_recorder.hpp"
#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr int kReadAhead = 4;  // number of frames decoded in advance

/// Recorders of single frames.
struct Recorders {
  LiveTrajectory live;
  std::optional<LiveObstacles> obstacles;  // none: there are no files for planners
  LabelRecorder labels;
  FigureRecorder figures;
  std::unique_ptr<WarningRecorder> warnings;  // null: there are no rules
  LiveView* view = nullptr;                   // null: the run is not shown
  bool has_network = false;                   // whether there are masks of a network or a folder
  std::optional<RunJournal> journal = {};     // none: the run keeps no journal
};

/// Passes all frames to the system, and collects example images and motion labels.
void drive(SlamSystem& slam, FrameSource& source, std::optional<std::size_t> total_frames,
           Recorders& recorders, RunRecord& record) {
  Gallery gallery(total_frames);
  FrameCheck check(source.camera());
  Progress progress("mapping", total_frames);
  while (!interrupted()) {
    const RgbdFramePtr frame = source.next();
    if (!frame) break;
    check.add(*frame);
    const bool posed = slam.push(frame).has_value();
    if (posed && !record.first_pose_seconds) record.first_pose_seconds = seconds_since_start();
    ++record.frames;
    recorders.live.add(*slam.newest());
    if (recorders.obstacles) {
      const std::vector<Mover> movers = slam.movers();
      recorders.obstacles->add(frame->timestamp, slam.newest()->T_world_filtered(), movers,
                               slam.movers_time());
    }
    traced("gallery", [&] { gallery.record(*slam.newest()); });
    traced("motion labels", [&] { recorders.labels.record(*slam.newest()); });
    traced("figures", [&] { recorders.figures.record(*slam.newest()); });
    if (recorders.warnings)
      recorders.warnings->add_newest(slam, source.camera(), recorders.has_network);
    if (recorders.view != nullptr) recorders.view->add_newest();
    if (recorders.journal) recorders.journal->add_newest();
    progress.step(slam.newest()->state == TrackState::kLost ? "lost" : "");
  }
  record.interrupted = interrupted();
  record.gallery = gallery.take();
  const std::vector<Finding> found = check.findings();
  // All frames show the depth factor better than the few images read before the run.
  if (!found.empty())
    std::erase_if(record.findings, [](const auto& f) { return f.code == "depth-factor"; });
  append(found, record.findings);
}

/// Opens the journal of the run in its folder.
void open_journal(const Session& session, SlamSystem& slam, Recorders& recorders,
                  ResultFolder& folder) {
  const JournalHeading heading{"stillmap " STILLMAP_VERSION, session.sequence,
                               machine_description(), options_yaml(session.options)};
  folder.write(kRunJournal, [&](const std::filesystem::path& file) {
    recorders.journal.emplace(slam, file, heading);
  });
}

/// Returns what the user told of the ground.
GroundHints ground_hints(const Session& session) {
  GroundHints hints{.rules_up = std::nullopt, .floor = session.outputs.dense.floor};
  if (session.rules && session.rules->up_is_given) hints.rules_up = session.rules->up;
  return hints;
}

/// Runs the system on the sequence and returns its record without the evaluation.
/// @param server  shows the run; null: it is not shown
void map_sequence(Session& session, ViewServer* server, Recorders& recorders, ResultFolder& folder,
                  RunRecord& record) {
  const Camera camera = session.source->camera();
  const bool realtime = record.options.realtime();
  std::unique_ptr<FrameSource> source = std::move(session.source);
  const bool paced_reading = realtime && !session.live;
  if (paced_reading) source = std::make_unique<TimelySource>(std::move(source));
  if (!session.live_camera) {
    source = std::make_unique<Prefetch>(std::move(source), kReadAhead,
                                        realtime ? ThreadPriority::kNone : ThreadPriority::kMap);
  }
  PacedSource* paced = nullptr;
  if (paced_reading) {
    auto wrapped = std::make_unique<PacedSource>(std::move(source));
    paced = wrapped.get();
    source = std::move(wrapped);
  }
  const Stopwatch watch;
  SlamSystem slam(camera, session.parameters, std::move(session.detector),
                  std::move(session.start));
  std::optional<LiveView> view;
  if (server) {
    view.emplace(slam, *server, session.sequence, camera, session.total_frames,
                 ground_hints(session));
  }
  recorders.view = view ? &*view : nullptr;
  open_journal(session, slam, recorders, folder);
  if (recorders.warnings && (realtime || session.live)) recorders.warnings->watch_for_silence();
  drive(slam, *source, session.total_frames, recorders, record);
  if (record.first_pose_seconds) *record.first_pose_seconds -= session.begun;
  if (recorders.warnings) {
    recorders.warnings->finish();
    record.warnings = recorders.warnings->told();
  }
  if (recorders.journal) recorders.journal->flush();
  recorders.journal.reset();
  {
    const ProgressStep step("correcting the map and making its cloud");
    record.result = slam.finish();
  }
  if (view) view->show_results(record.result);
  record.seconds = watch.milliseconds() / 1000;
  record.mapping_memory_mib = peak_memory_mib();
  if (!session.outputs.save_map.empty() || !session.outputs.figures.empty() ||
      record.options.dense.enabled)
    record.map = slam.saved_map("stillmap " STILLMAP_VERSION);
  record.skipped = source->skipped();
  if (paced != nullptr) record.dropped = paced->dropped();
  append(run_findings(record), record.findings);
}

/// Does as map_sequence(). If it throws, tells how the results so far are saved.
void map_or_tell(Session& session, ViewServer* server, Recorders& recorders, ResultFolder& folder,
                 RunRecord& record) {
  try {
    map_sequence(session, server, recorders, folder, record);
  } catch (...) {
    if (recorders.warnings) recorders.warnings->finish();
    if (record.frames > 0) {
      print_error("stillmap: the run ends early; `stillmap recover {}` writes its results so far\n",
                  folder.path().string());
    }
    throw;
  }
}

/// Returns the recorder of the warnings; null without rules.
/// @param server  shows the warnings; null: it does not
std::unique_ptr<WarningRecorder> warning_recorder(const Session& session, ViewServer* server,
                                                  ResultFolder& folder) {
  if (!session.rules) return nullptr;
  std::function<void(const nlohmann::json&)> show;
  if (server != nullptr) {
    show = [server](const nlohmann::json& message) { server->board().publish(message); };
    show(points_message(*session.rules));
  }
  auto recorder = std::make_unique<WarningRecorder>(
      *session.rules, folder,
      WarningOutputs{.show = std::move(show), .lines = session.event_lines});
  recorder->send_events();
  return recorder;
}

/// Returns the finding that the zones stand tilted, since their upward direction was not given and
/// the floor of the run shows another one; none if there is none.
std::optional<Finding> tilted_zones(const WarningRules& rules, const RunRecord& record) {
  constexpr double kTolerated = 10;  // [degrees]
  if (rules.up_is_given) return std::nullopt;
  const Ground ground = displayed_ground(record.result.trajectory, record.result.dense.cloud);
  const double angle =
      std::acos(std::clamp(rules.up.dot(ground.up), -1.0, 1.0)) * 180 / std::numbers::pi;
  if (ground.source != UpSource::kFloor || angle < kTolerated) return std::nullopt;
  return make_finding(
      "zones-tilted",
      fmt::format("the rules have no upward direction, so the camera was taken to start level, but "
                  "the floor is tilted by {:.0f} degrees",
                  angle),
      fmt::format("add the line 'up: [{:.3f}, {:.3f}, {:.3f}]' to the file of --zones",
                  ground.up.x(), ground.up.y(), ground.up.z()),
      {{"tilt_deg", angle}});
}

/// Returns the events of a run and the computing times of its stages.
std::string details_text(const RunRecord& record) {
  std::string text;
  for (const RunEvent& event : run_events(record.result))
    text += fmt::format("{:.3f} s: {}\n", event.timestamp, event.text);
  return text + timing_text(record.result.timing.stages());
}

}  // namespace

void require_free_outputs(const Session& session) {
  std::vector<std::string> names = possible_run_files(session.options, session.outputs);
  const auto add = [&](RunPart part) {
    for (std::string& name : file_names(part)) names.push_back(std::move(name));
  };
  add(RunPart::kLive);
  if (session.rules) add(RunPart::kWarnings);
  const ResultFolder folder(session.out, session.foreign);
  folder.require_free(names);
  if (session.foreign == ResultFolder::Foreign::kOverwrite ||
      !is_journal(session.out / kRunJournal)) {
    return;
  }
  throw Error("holds the results of a run that did not end", (session.out / kRunJournal).string(),
              fmt::format("`stillmap recover {}` writes them; or discard them by --force",
                          session.out.string()));
}

RunRecord run_session(Session session) {
  require_free_outputs(session);
  ResultFolder folder(session.out, session.foreign);
  catch_interrupt();
  Trace trace;
  const double cpu_before = process_cpu_ms();
  const TraceBinding binding(session.outputs.profile ? &trace.add_track("camera") : nullptr);

  RunRecord record;
  record.sequence = session.sequence;
  record.recording = session.recording;
  record.machine = machine_description();
  record.options = session.options;
  record.truth = std::move(session.truth);
  record.loaded = session.loaded;
  record.findings = session.findings;
  if (session.detector) {
    record.detector = session.detector->description();
    record.detector_gives_boxes_only = !session.detector->gives_masks();
  }
  // Pages stay connected until the files are written.
  const std::unique_ptr<ViewServer> server = std::move(session.view);
  Recorders recorders{
      LiveTrajectory(folder),
      session.outputs.dense.planner
          ? std::optional<LiveObstacles>(std::in_place, folder, session.outputs.dense.floor)
          : std::nullopt,
      LabelRecorder(session.outputs.labels, folder),
      FigureRecorder(session.outputs.figures, session.options.dense.excluded_classes, folder),
      warning_recorder(session, server.get(), folder),
      nullptr,
      session.detector != nullptr,
      {}};
  map_or_tell(session, server.get(), recorders, folder, record);
  if (record.interrupted && !session.quiet)
    print_out("interrupted after {}; the results so far are saved\n",
              counted(record.frames, "frame"));

  evaluate_run(record);
  if (record.truth) {
    append(truth_findings(*record.truth, record.result.trajectory, session.names), record.findings);
  }
  if (session.rules) {
    if (auto finding = tilted_zones(*session.rules, record))
      record.findings.push_back(*std::move(finding));
  }
  folder.make_room_by(kRunJournal);
  traced("files", [&] {
    const ProgressStep step("writing the files");
    write_run_files(record, session.outputs, folder);
  });
  if (!session.quiet) print_out("{}", run_summary_text(record));
  if (session.verbose) print_out("{}", details_text(record));
  if (recorders.warnings) append(recorders.warnings->findings(), record.findings);
  recorders.labels.finish();
  traced("figures", [&] { recorders.figures.finish(record); });
  if (session.outputs.profile)
    print_out("{}", write_profile(trace, process_cpu_ms() - cpu_before, folder));
  remove_journal(record.options, folder);
  folder.remove_stale();
  if (!session.quiet) print_out("{}", folder.written_text());
  folder.require_all();
  return record;
}

}  // namespace stillmap
