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
#include "stillmap/sensor/frame_check.hpp"

#include "interrupt.hpp"
#include "progress.hpp"
#include "run_sinks.hpp"
#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr int kReadAhead = 4;  // number of frames decoded in advance

/// Source of the frames of a run, as fast as they are wanted.
struct Delivery {
  std::unique_ptr<FrameSource> source;
  const PacedSource* paced = nullptr;  ///< Part of the source; null if it drops no late frames.
};

/// Takes the source of a session. A recording is read in advance, and in realtime at its own rate.
Delivery take_source(Session& session) {
  const bool realtime = session.options.realtime();
  const bool paced = realtime && !session.live;
  Delivery delivery{std::move(session.source)};
  std::unique_ptr<FrameSource>& source = delivery.source;
  if (paced) source = std::make_unique<TimelySource>(std::move(source));
  if (!session.live_camera) {
    source = std::make_unique<Prefetch>(std::move(source), kReadAhead,
                                        realtime ? ThreadPriority::kNone : ThreadPriority::kMap);
  }
  if (paced) {
    auto wrapped = std::make_unique<PacedSource>(std::move(source));
    delivery.paced = wrapped.get();
    source = std::move(wrapped);
  }
  return delivery;
}

/// Passes all frames to the system and the sinks.
void push_all(FrameSource& source, SlamSystem& slam, const RunSinks& sinks, const Session& session,
              RunRecord& record) {
  FrameCheck check(source.camera());
  Progress progress("mapping", session.total_frames);
  while (!interrupted()) {
    const RgbdFramePtr frame = source.next();
    if (!frame) break;
    check.add(*frame);
    const bool posed = slam.push(frame).has_value();
    if (posed && !record.first_pose_seconds)
      record.first_pose_seconds = seconds_since_start() - session.begun;
    ++record.frames;
    traced("outputs", [&] {
      for (const auto& sink : sinks) sink->on_frame(slam);
    });
    progress.step(slam.newest()->state == TrackState::kLost ? "lost" : "");
  }
  record.interrupted = interrupted();
  const std::vector<Finding> found = check.findings();
  // All frames show the depth factor better than the few images read before the run.
  if (!found.empty())
    std::erase_if(record.findings, [](const auto& f) { return f.code == "depth-factor"; });
  append(found, record.findings);
  for (const auto& sink : sinks) sink->on_last_frame(record);
}

/// Does as push_all(). If it throws, tells how the results so far are saved.
void push_or_tell(FrameSource& source, SlamSystem& slam, const RunSinks& sinks,
                  const Session& session, RunRecord& record) {
  try {
    push_all(source, slam, sinks, session, record);
  } catch (...) {
    for (const auto& sink : sinks) sink->on_failure();
    if (record.frames > 0) {
      print_error("stillmap: the run ends early; `stillmap recover {}` writes its results so far\n",
                  session.out.string());
    }
    throw;
  }
}

/// Returns what is known of a run before its first frame.
RunRecord begun_record(const Session& session) {
  RunRecord record;
  record.sequence = session.sequence;
  record.recording = session.recording;
  record.machine = machine_description();
  record.options = session.options;
  record.truth = session.truth;
  record.loaded = session.loaded;
  record.findings = session.findings;
  if (session.detector) {
    record.detector = session.detector->description();
    record.detector_gives_boxes_only = !session.detector->gives_masks();
  }
  return record;
}

/// Maps the sequence, and evaluates the trajectory.
/// @param server  shows the run; null: it is not shown
RunRecord map_sequence(Session& session, ViewServer* server, ResultFolder& folder) {
  RunRecord record = begun_record(session);
  const Delivery delivery = take_source(session);
  const Stopwatch watch;
  const bool has_network = session.detector != nullptr;
  SlamSystem slam(delivery.source->camera(), session.parameters, std::move(session.detector),
                  std::move(session.start));
  const RunSinks sinks = sinks_of(session, slam, folder, server, has_network);
  push_or_tell(*delivery.source, slam, sinks, session, record);
  {
    const ProgressStep step(record.options.dense.enabled ? "correcting the map and making its cloud"
                                                         : "correcting the map");
    record.result = slam.finish();
  }
  record.seconds = watch.milliseconds() / 1000;
  record.mapping_memory_mib = peak_memory_mib();
  if (!session.outputs.save_map.empty() || !session.outputs.figures.empty() ||
      record.options.dense.enabled)
    record.map = slam.saved_map("stillmap " STILLMAP_VERSION);
  record.skipped = delivery.source->skipped();
  if (delivery.paced != nullptr) record.dropped = delivery.paced->dropped();
  append(run_findings(record), record.findings);
  evaluate_run(record);
  if (record.truth)
    append(truth_findings(*record.truth, record.result.trajectory, session.names), record.findings);
  traced("outputs", [&] {
    for (const auto& sink : sinks) sink->on_results(record);
  });
  return record;
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
  if (session.loaded) add(RunPart::kChanges);
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
  // Pages stay connected until the files are written.
  const std::unique_ptr<ViewServer> server = std::move(session.view);
  RunRecord record = map_sequence(session, server.get(), folder);
  if (record.interrupted && !session.quiet)
    print_out("interrupted after {}; the results so far are saved\n",
              counted(record.frames, "frame"));
  folder.make_room_by(kRunJournal);
  traced("files", [&] {
    const ProgressStep step("writing the files");
    write_run_files(record, session.outputs, folder);
  });
  if (!session.quiet) print_out("{}", run_summary_text(record));
  if (session.verbose) print_out("{}", details_text(record));
  if (session.outputs.profile)
    print_out("{}", write_profile(trace, process_cpu_ms() - cpu_before, folder));
  remove_journal(record.options, folder);
  folder.remove_stale();
  if (!session.quiet) print_out("{}", folder.written_text());
  folder.require_all();
  return record;
}

}  // namespace stillmap
