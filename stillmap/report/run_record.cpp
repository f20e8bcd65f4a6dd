// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/run_record.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace stillmap {
namespace {

std::string percent(std::size_t part, std::size_t whole) {
  return whole == 0 ? "-"
                    : fmt::format("{:.1f} %",
                                  100.0 * static_cast<double>(part) / static_cast<double>(whole));
}

const char* name_of(TrackState state) {
  switch (state) {
    case TrackState::kWaiting:
      return "waiting";
    case TrackState::kStarted:
      return "started";
    case TrackState::kTracking:
      return "tracking";
    case TrackState::kLost:
      return "lost";
    case TrackState::kPredicted:
      return "predicted";
  }
  return "";
}

/// Returns the cell of frames.csv for a verdict of the dynamics gate.
const char* name_of(Dynamics dynamics) {
  if (dynamics == Dynamics::kUnknown) return "";
  return dynamics == Dynamics::kHigh ? "1" : "0";
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

/// Returns the times of uncertain poses since the first frame, such as " (1.20 to 1.53 s, 4.00 s)";
/// empty if there are none. Poses less than a second apart are one span.
std::string uncertain_spans_text(const SlamResult& result) {
  constexpr double kTogether = 1;     // [s]
  constexpr std::size_t kListed = 4;  // spans
  std::vector<std::pair<double, double>> spans;
  for (const FrameRecord& f : result.frames) {
    if (!f.uncertain()) continue;
    const double time = f.timestamp - result.frames.front().timestamp;
    if (spans.empty() || time - spans.back().second > kTogether) spans.emplace_back(time, time);
    spans.back().second = time;
  }
  std::vector<std::string> texts;
  for (const auto& [from, to] : spans) {
    if (texts.size() == kListed) {
      texts.push_back(counted(spans.size() - kListed, "more time"));
      break;
    }
    texts.push_back(from < to ? fmt::format("{:.2f} to {:.2f} s", from, to)
                              : fmt::format("{:.2f} s", from));
  }
  return texts.empty() ? "" : fmt::format(" ({})", fmt::join(texts, ", "));
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
    text += fmt::format("mover detection skipped in {}, ",
                        counted(less.frames_without_movers, "frame"));
  text += "fewer keypoints in " + counted(less.frames_of_fewer_keypoints, "frame");
  if (less.frames_of_fewer_keypoints > 0)
    text += fmt::format(" (at least {})", less.fewest_keypoints);
  if (less.frames_without_view > 0)
    text += fmt::format(", {} left out of the dense map",
                        counted(less.frames_without_view, "keyframe"));
  return text + fmt::format(", {} dropped", counted(record.dropped.size(), "frame"));
}

}  // namespace

double RunRecord::frames_per_second() const {
  return seconds > 0 ? static_cast<double>(frames) / seconds : 0;
}

double RunRecord::tracking_median() const {
  return quantile(result.timing.samples("tracking"), 0.5);
}

std::string frames_csv(const SlamResult& result) {
  std::string csv =
      "frame,timestamp,state,keypoints,moving,inliers,mask_age,uncertain,keyframe,highly_dynamic,"
      "component\n";
  for (const FrameRecord& f : result.frames) {
    csv += fmt::format("{},{:.6f},{},{},{},{},{},{:d},{:d},{},{}\n", f.index, f.timestamp,
                       name_of(f.state), f.keypoints, f.moving_keypoints, f.inliers,
                       f.mask_age < 0 ? "" : std::to_string(f.mask_age), f.uncertain(), f.keyframe,
                       name_of(f.dynamics), f.component ? std::to_string(*f.component) : "");
  }
  return csv;
}

std::vector<DynamicsPeriod> dynamics_periods(const SlamResult& result) {
  std::vector<DynamicsPeriod> periods;
  for (const FrameRecord& frame : result.frames) {
    if (frame.dynamics == Dynamics::kUnknown) continue;
    if (!periods.empty()) periods.back().end = frame.timestamp;
    if (periods.empty() || periods.back().dynamics != frame.dynamics)
      periods.push_back({frame.timestamp, frame.timestamp, frame.dynamics});
  }
  return periods;
}

std::vector<RunEvent> run_events(const SlamResult& result) {
  std::vector<RunEvent> events;
  const auto add = [&](double timestamp, std::string text) {
    events.push_back({timestamp, std::move(text)});
  };
  bool any_map = false;
  bool was_lost = false, was_odometry = false, was_predicted = false;
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
    if (f.predicted() && !was_predicted)
      add(f.timestamp, "pose by IMU or wheels alone: " + f.reason);
    any_map |= f.state == TrackState::kStarted;
    was_odometry = f.tracked_by_odometry;
    was_predicted = f.predicted();
    was_lost = lost;
  }
  for (const MapEvent& e : result.events) add(e.timestamp, text_of(e));
  const std::vector<DynamicsPeriod> periods = dynamics_periods(result);
  for (std::size_t i = 1; i < periods.size(); ++i) {
    const bool high = periods[i].dynamics == Dynamics::kHigh;
    add(periods[i].begin, fmt::format("scene {}highly dynamic", high ? "" : "no longer "));
  }
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
  text += uncertain_spans_text(result);
  add(frames_with(result, &FrameRecord::tracked_by_odometry), "frame tracked by visual odometry",
      "frames tracked by visual odometry");
  add(frames_with(result, &FrameRecord::predicted), "frame with a pose by IMU or wheels alone",
      "frames with a pose by IMU or wheels alone");
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
    text += fmt::format("{} skipped; the first: {:.6f}: {}\n",
                        counted(std::count_if(first, record.skipped.end(), concerns),
                                lost ? "frame" : "depth image"),
                        first->timestamp, first->reason);
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

/// Returns in which components of the loaded map the camera was localized.
std::string localized_text(const RunRecord& record) {
  std::string text;
  for (const auto& [component, frames] : record.result.frames_by_map) {
    text += fmt::format("{}component {} ({})", text.empty() ? ", localized in " : ", ", component,
                        counted(static_cast<std::size_t>(frames), "frame"));
  }
  return text;
}

}  // namespace

std::string run_summary_text(const RunRecord& record) {
  const SlamResult& result = record.result;
  std::string text = fmt::format(
      "{}: {} of {} tracked ({}), {}, {}", record.sequence, result.tracked(),
      counted(record.total_frames(), "frame"), percent(result.tracked(), record.total_frames()),
      counted(result.keyframes.size(), "keyframe"), counted(result.landmarks, "landmark"));
  if (result.maps > 1) {
    text += record.loaded && !record.loaded->extended
                ? localized_text(record)
                : fmt::format(", {} unconnected maps", result.maps);
  }
  if (!result.movers.empty()) text += ", " + counted(result.movers.size(), "mover");
  if (const auto events = map_events_text(result); !events.empty()) text += "; " + events;
  text += fmt::format("\n{:.1f} frames/s overall, tracking {:.1f} ms (median), {:.0f} MiB peak\n",
                      record.frames_per_second(), record.tracking_median(), record.peak_memory_mib);
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
