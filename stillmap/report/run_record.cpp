// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/run_record.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/machine.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace stillmap {
namespace {

std::string percent(std::size_t part, std::size_t whole) {
  return whole == 0 ? "-"
                    : fmt::format("{:.1f} %",
                                  100.0 * static_cast<double>(part) / static_cast<double>(whole));
}

std::string text_of(const MapEvent& e) {
  switch (e.kind) {
    case MapEvent::Kind::kLoop:
      return fmt::format("loop closed: frame {} revisits frame {}; corrected by {:.3f} m",
                         e.frame_index, e.seen_in, e.meters);
    case MapEvent::Kind::kMerge:
      return fmt::format("maps merged: frame {} revisits frame {}", e.frame_index, e.seen_in);
    case MapEvent::Kind::kDropped:
      break;
  }
  return fmt::format("map of frame {} dropped: tracking was lost again too soon", e.frame_index);
}

/// Returns a description of load shedding, in the order in which work is skipped.
std::string load_shedding_text(const RunRecord& record) {
  const LoadShedding& less = record.result.load_shedding;
  std::string text = "realtime: ";
  if (record.result.segmented > 0) {
    text += fmt::format(
        "network run every {:.1f} frames, ",
        static_cast<double>(record.frames) / static_cast<double>(record.result.segmented));
  }
  if (record.options.movers.enabled)
    text += fmt::format("mover detection skipped in {} frames, ", less.frames_without_movers);
  text += fmt::format("fewer keypoints in {} frames", less.frames_of_fewer_keypoints);
  if (less.frames_of_fewer_keypoints > 0)
    text += fmt::format(" (at least {})", less.fewest_keypoints);
  if (less.frames_without_view > 0)
    text += fmt::format(", {} keyframes left out of the dense map", less.frames_without_view);
  return text + fmt::format(", {} frames dropped", record.dropped);
}

}  // namespace

double RunRecord::frames_per_second() const {
  return seconds > 0 ? static_cast<double>(frames) / seconds : 0;
}

double RunRecord::tracking_median() const {
  return quantile(result.timing.samples("tracking"), 0.5);
}

std::vector<RunEvent> run_events(const SlamResult& result) {
  std::vector<RunEvent> events;
  const auto add = [&](double timestamp, std::string text) {
    events.push_back({timestamp, std::move(text)});
  };
  bool any_map = false;
  bool was_lost = false, was_odometry = false;
  for (const FrameRecord& f : result.frames) {
    const bool lost = f.state == TrackState::kLost || (f.tracked_late && !f.reason.empty());
    if (lost && !was_lost) add(f.timestamp, "lost: " + f.reason);
    if (f.state == TrackState::kStarted && any_map) add(f.timestamp, "new map");
    if (f.relocalized) {
      add(f.timestamp, "relocalized");
    } else if (f.state == TrackState::kTracking && was_lost && !lost) {
      add(f.timestamp, "tracking again");
    }
    if (f.tracked_by_odometry && !was_odometry) add(f.timestamp, "left the map");
    any_map |= f.state == TrackState::kStarted;
    was_odometry = f.tracked_by_odometry;
    was_lost = lost;
  }
  for (const MapEvent& e : result.events) add(e.timestamp, text_of(e));
  std::stable_sort(events.begin(), events.end(),
                   [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; });
  return events;
}

void evaluate_run(RunRecord& record) {
  if (!record.truth) return;
  try {
    record.evaluation = evaluate_trajectory(*record.truth, record.result.trajectory,
                                            {.total_frames = record.total_frames()});
  } catch (const Error& e) {
    record.evaluation_problem = e.what();
  }
}

std::size_t frames_with(const SlamResult& result, bool FrameRecord::*property) {
  return static_cast<std::size_t>(std::count_if(result.frames.begin(), result.frames.end(),
                                                [&](const FrameRecord& f) { return f.*property; }));
}

const char* name_of(MapEvent::Kind kind) {
  switch (kind) {
    case MapEvent::Kind::kLoop:
      return "loop";
    case MapEvent::Kind::kMerge:
      return "merge";
    case MapEvent::Kind::kDropped:
      return "dropped";
  }
  return "";
}

std::string map_events_text(const SlamResult& result) {
  std::string text;
  const auto add = [&](auto count, const char* one, const char* many) {
    if (count == 0) return;
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, count == 1 ? one : many);
  };
  const auto of = [&](MapEvent::Kind kind) {
    return std::count_if(result.events.begin(), result.events.end(),
                         [&](const MapEvent& e) { return e.kind == kind; });
  };
  add(of(MapEvent::Kind::kLoop), "loop closed", "loops closed");
  add(of(MapEvent::Kind::kMerge), "map merged", "maps merged");
  add(of(MapEvent::Kind::kDropped), "short map dropped", "short maps dropped");
  add(frames_with(result, &FrameRecord::relocalized), "relocalization", "relocalizations");
  add(frames_with(result, &FrameRecord::tracked_late), "lost frame tracked at the end",
      "lost frames tracked at the end");
  add(frames_with(result, &FrameRecord::uncertain), "uncertain pose", "uncertain poses");
  add(frames_with(result, &FrameRecord::tracked_by_odometry), "frame tracked by visual odometry",
      "frames tracked by visual odometry");
  return text;
}

namespace {

/// Returns a line about frames and a line about depth images that could not be read, if any.
std::string skipped_text(const RunRecord& record) {
  std::string text;
  for (const bool lost : {true, false}) {
    const auto concerns = [&](const SkippedFrame& s) { return s.frame_lost == lost; };
    const auto first = std::find_if(record.skipped.begin(), record.skipped.end(), concerns);
    if (first == record.skipped.end()) continue;
    text += fmt::format("{} {} skipped; the first: {:.6f}: {}\n",
                        std::count_if(first, record.skipped.end(), concerns),
                        lost ? "frames" : "depth images or their lines", first->timestamp,
                        first->reason);
  }
  return text;
}

/// Returns a line about a timing of the shutters that was estimated; otherwise an empty text.
std::string shutter_text(const RunRecord& record) {
  const ShutterTiming& shutter = record.result.shutter;
  if (record.result.camera.shutter || shutter == ShutterTiming{}) return "";
  return fmt::format(
      "rolling shutter, as last estimated: readout {:.1f} ms, depth delay {:.1f} ms\n",
      shutter.readout * 1e3, shutter.depth_delay * 1e3);
}

}  // namespace

std::string run_summary_text(const RunRecord& record) {
  const SlamResult& result = record.result;
  std::string text = fmt::format("{}: {} of {} frames tracked ({}), {} keyframes, {} landmarks",
                                 record.sequence, result.tracked(), record.total_frames(),
                                 percent(result.tracked(), record.total_frames()),
                                 result.keyframes.size(), result.landmarks);
  if (result.maps > 1) text += fmt::format(", {} unconnected maps", result.maps);
  if (!result.movers.empty()) text += fmt::format(", {} movers", result.movers.size());
  if (const auto events = map_events_text(result); !events.empty()) text += "; " + events;
  text += fmt::format("\n{:.1f} frames/s overall, tracking {:.1f} ms (median), {:.0f} MiB peak\n",
                      record.frames_per_second(), record.tracking_median(), peak_memory_mib());
  text += skipped_text(record) + shutter_text(record);
  if (!record.detector.empty()) text += "detector: " + record.detector + "\n";
  if (!record.result.detector_skipped.empty())
    text += "masks: " + record.result.detector_skipped + "\n";
  if (record.options.realtime()) text += load_shedding_text(record) + "\n";
  if (record.evaluation) text += evaluation_text(*record.evaluation);
  if (!record.evaluation_problem.empty())
    text += "no error figures: " + record.evaluation_problem + "\n";
  if (result.tracked() == 0) {
    text +=
        fmt::format("no frame was tracked: {}\n",
                    result.frames.empty() ? "the sequence is empty" : result.frames.back().reason);
  }
  return text;
}

}  // namespace stillmap
