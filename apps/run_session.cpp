// SPDX-License-Identifier: Apache-2.0
#include "run_session.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/dense/cloud_io.hpp"
#include "stillmap/evaluate/cloud_picture.hpp"
#include "stillmap/evaluate/mover_picture.hpp"
#include "stillmap/evaluate/report.hpp"
#include "stillmap/pipeline/draw_frame.hpp"
#include "stillmap/pipeline/mover_files.hpp"
#include "stillmap/pipeline/paced_source.hpp"
#include "stillmap/pipeline/prefetch.hpp"

#include <algorithm>
#include <array>
#include <map>

#include "interrupt.hpp"
#include "machine.hpp"
#include "profiler.hpp"
#include "progress.hpp"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

constexpr std::size_t kGalleryPictures = 6;

/// Everything known about a finished run, from which the files are made.
struct Outcome {
  std::string sequence;
  SlamOptions options;
  SlamResult result;
  std::optional<Trajectory> truth;
  std::optional<Evaluation> evaluation;
  std::string evaluation_problem;
  std::string detector;  ///< its description; empty for none
  std::vector<SkippedFrame> skipped;
  std::vector<ReportImage> gallery;
  DenseOutputs outputs;
  std::size_t frames = 0;   ///< handed to the tracker
  std::size_t dropped = 0;  ///< late, in realtime
  double seconds = 0;
  double first_pose_seconds = 0;  ///< from the program's start to the first pose; 0: there is none
  double mapping_memory_mib = 0;  ///< at most, before the files were made
  bool interrupted = false;
  MapFiles maps;
  bool extends_map = true;      ///< the loaded one
  std::optional<SavedMap> map;  ///< with the views of the dense map
  double saving_seconds = 0;    ///< that writing it took

  double frames_per_second() const {
    return seconds > 0 ? static_cast<double>(frames) / seconds : 0;
  }
  std::size_t total_frames() const { return frames + dropped + skipped.size(); }
};

std::string percent(std::size_t part, std::size_t whole) {
  return whole == 0 ? "-"
                    : fmt::format("{:.1f} %",
                                  100.0 * static_cast<double>(part) / static_cast<double>(whole));
}

double tracking_median(const SlamResult& result) {
  return quantile(result.timing.samples("tracking"), 0.5);
}

std::string text_of(const MapEvent& e) {
  switch (e.kind) {
    case MapEvent::Kind::kLoop:
      return fmt::format("loop closed: frame {} shows the place of frame {}; moved by {:.3f} m",
                         e.frame_index, e.seen_in, e.meters);
    case MapEvent::Kind::kMerge:
      return fmt::format("maps joined: frame {} shows the place of frame {}", e.frame_index,
                         e.seen_in);
    case MapEvent::Kind::kDropped:
      break;
  }
  return fmt::format("map dropped, begun at frame {}: it held the camera for moments only",
                     e.frame_index);
}

/// What happened to the tracking and to the map, by time.
std::vector<ReportEvent> events_of(const SlamResult& result) {
  std::vector<ReportEvent> events;
  bool any_map = false;
  bool was_lost = false, was_beside = false;
  for (const FrameRecord& f : result.frames) {
    const bool lost = f.state == TrackState::kLost;
    if (lost && !was_lost) events.push_back({f.timestamp, "lost: " + f.reason});
    if (f.state == TrackState::kStarted && any_map) events.push_back({f.timestamp, "new map"});
    if (f.relocalized) {
      events.push_back({f.timestamp, "place recognized"});
    } else if (f.state == TrackState::kTracking && was_lost) {
      events.push_back({f.timestamp, "found again"});
    }
    if (f.tracked_by_odometry && !was_beside) events.push_back({f.timestamp, "looks past the map"});
    any_map |= f.state == TrackState::kStarted;
    was_beside = f.tracked_by_odometry;
    was_lost = lost;
  }
  for (const MapEvent& e : result.events) events.push_back({e.timestamp, text_of(e)});
  std::stable_sort(events.begin(), events.end(),
                   [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; });
  return events;
}

nlohmann::json json_of(const MapEvent& e) {
  if (e.kind == MapEvent::Kind::kDropped)
    return {{"frame", e.frame_index}, {"timestamp", e.timestamp}, {"keyframes", e.keyframes}};
  return {
      {"frame", e.frame_index},        {"timestamp", e.timestamp}, {"seen_in_frame", e.seen_in},
      {"inliers", e.inliers},          {"fused", e.fused},         {"meters", e.meters},
      {"radians", e.radians},          {"keyframes", e.keyframes}, {"pose_graph_ms", e.graph_ms},
      {"milliseconds", e.milliseconds}};
}

/// Frames that go on by odometry where the camera looks past a map that is not extended.
auto frames_tracked_by_odometry(const SlamResult& result) {
  return std::count_if(result.frames.begin(), result.frames.end(),
                       [](const FrameRecord& f) { return f.tracked_by_odometry; });
}

/// How the camera was kept up with: in the order in which less is done.
std::string pace_text(const Outcome& o) {
  const LoadShedding& less = o.result.load_shedding;
  std::string text = "keeping up with the camera: ";
  if (o.result.segmented > 0) {
    text += fmt::format("network every {:.1f} frames ({} asked for), ",
                        static_cast<double>(o.frames) / static_cast<double>(o.result.segmented),
                        o.options.schedule.segment_every);
  }
  if (o.options.movers.enabled)
    text += fmt::format("no movers looked for in {} frames, ", less.frames_without_movers);
  text += fmt::format("fewer keypoints in {} frames", less.frames_of_fewer_keypoints);
  if (less.frames_of_fewer_keypoints > 0)
    text += fmt::format(" (at least {})", less.fewest_keypoints);
  if (less.frames_without_view > 0)
    text += fmt::format(", {} keyframes not in the dense map", less.frames_without_view);
  return text + fmt::format(", {} frames dropped", o.dropped);
}

/// "2 loops closed, 1 relocalization"; empty if there were none.
std::string places_text(const SlamResult& result) {
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
  add(of(MapEvent::Kind::kMerge), "map joined", "maps joined");
  add(of(MapEvent::Kind::kDropped), "brief map dropped", "brief maps dropped");
  add(std::count_if(result.frames.begin(), result.frames.end(),
                    [](const FrameRecord& f) { return f.relocalized; }),
      "relocalization", "relocalizations");
  add(frames_tracked_by_odometry(result), "frame beside the map", "frames beside the map");
  return text;
}

/// Loops, merges and relocalizations: what places were recognized for.
nlohmann::json places_json(const SlamResult& result) {
  nlohmann::json json = {{"loops", nlohmann::json::array()},
                         {"merges", nlohmann::json::array()},
                         {"dropped_maps", nlohmann::json::array()},
                         {"relocalizations", nlohmann::json::array()}};
  constexpr std::array kLists{"loops", "merges", "dropped_maps"};  // by MapEvent::Kind
  for (const MapEvent& e : result.events)
    json[kLists[static_cast<std::size_t>(e.kind)]].push_back(json_of(e));
  std::size_t lost = 0;
  for (const FrameRecord& f : result.frames) {
    if (f.relocalized)
      json["relocalizations"].push_back(
          {{"frame", f.index}, {"timestamp", f.timestamp}, {"frames_lost", lost}});
    lost = f.state == TrackState::kLost ? lost + 1 : 0;
  }
  return json;
}

void evaluate(Outcome& outcome) {
  if (!outcome.truth) return;
  try {
    outcome.evaluation =
        evaluate_trajectory(*outcome.truth, outcome.result.trajectory, outcome.total_frames());
  } catch (const Error& e) {
    outcome.evaluation_problem = e.what();
  }
}

/// The movers in few words: how many of which class, and what was left out.
nlohmann::json mover_summary(const SlamResult& result) {
  nlohmann::json json{{"tracks", result.movers.size()},
                      {"by_class", nlohmann::json::object()},
                      {"detections", result.mover_statistics.detections},
                      {"regions_too_small", result.mover_statistics.too_small},
                      {"regions_without_depth", result.mover_statistics.without_depth},
                      {"list", nlohmann::json::array()}};
  for (const MoverTrack& track : result.movers) {
    auto& count = json["by_class"][track.class_name];
    count = count.is_null() ? 1 : count.get<int>() + 1;
    const MoverPath path = path_of(track);
    json["list"].push_back({{"id", track.id},
                            {"class", track.class_name},
                            {"class_confidence", track.class_confidence},
                            {"first_seen", track.first_seen},
                            {"last_seen", track.last_seen},
                            {"frames_observed", path.observed},
                            {"frames_predicted", path.predicted},
                            {"path_m", path.length},
                            {"mean_speed_m_s", path.mean_speed},
                            {"max_speed_m_s", path.max_speed}});
  }
  return json;
}

nlohmann::json refinement_json(const RefineTotals& totals) {
  return {
      {"triangulated", totals.triangulated},         {"duplicates_fused", totals.fused},
      {"repeated_pairs", totals.repeated_pairs},     {"repeated_gone", totals.repeated_gone},
      {"landmarks_culled", totals.landmarks_culled}, {"keyframes_culled", totals.keyframes_culled}};
}

/// The frame whose tracking took longest, and its stages.
nlohmann::json slowest_frame(const SlamResult& result) {
  const auto tracking = result.timing.samples("tracking");
  if (tracking.empty() || tracking.size() != result.frames.size()) return nullptr;
  const auto slowest = std::max_element(tracking.begin(), tracking.end());
  const auto at = static_cast<std::size_t>(slowest - tracking.begin());
  nlohmann::json json{{"frame", result.frames[at].index}, {"ms", *slowest}};
  for (const char* stage : {"features", "waiting for masks", "motion", "pose"}) {
    const auto samples = result.timing.samples(stage);
    if (samples.size() == tracking.size()) json["stages_ms"][stage] = samples[at];
  }
  return json;
}

/// Medians of ten equal parts of the run, one after the other: whether a stage takes longer the
/// longer the run is. Null for fewer than 100 calls.
nlohmann::json medians_of_tenths(std::span<const double> samples) {
  constexpr std::size_t kParts = 10, kFewest = 100;
  if (samples.size() < kFewest) return nullptr;
  auto medians = nlohmann::json::array();
  for (std::size_t part = 0; part < kParts; ++part) {
    const std::size_t first = part * samples.size() / kParts;
    const std::size_t end = (part + 1) * samples.size() / kParts;
    medians.push_back(quantile(samples.subspan(first, end - first), 0.5));
  }
  return medians;
}

nlohmann::json growth(const StageTimes& timing) {
  nlohmann::json json;
  for (const char* stage : {"tracking", "features", "motion", "pose", "keyframe insertion",
                            "map refinement", "place recognition", "dense map: keyframe"}) {
    json[stage] = medians_of_tenths(timing.samples(stage));
  }
  return json;
}

nlohmann::json summary(const Outcome& o) {
  nlohmann::json json;
  json["stillmap"] = STILLMAP_VERSION;
  json["machine"] = machine_description();
  json["sequence"] = o.sequence;
  json["preset"] = o.options.motion.preset;
  json["schedule"] = o.options.schedule.mode;
  json["detector"] = o.detector.empty() ? nlohmann::json() : nlohmann::json(o.detector);
  json["interrupted"] = o.interrupted;
  json["frames"] = {{"total", o.total_frames()},
                    {"handed_in", o.frames},
                    {"tracked", o.result.tracked()},
                    {"skipped", o.skipped.size()},
                    {"dropped_late", o.dropped},
                    {"segmented", o.result.segmented},
                    {"fewer_keypoints", o.result.load_shedding.frames_of_fewer_keypoints},
                    {"without_movers", o.result.load_shedding.frames_without_movers},
                    {"without_view", o.result.load_shedding.frames_without_view},
                    {"tracked_by_odometry", frames_tracked_by_odometry(o.result)}};
  for (const SkippedFrame& s : o.skipped) {
    json["skipped"].push_back({{"timestamp", s.timestamp}, {"reason", s.reason}});
  }
  for (const ReportEvent& e : events_of(o.result)) {
    json["events"].push_back({{"timestamp", e.timestamp}, {"text", e.text}});
  }
  json["maps"] = o.result.maps;
  json.update(places_json(o.result));
  if (!o.maps.load.empty()) {
    json["loaded_map"] = {{"file", o.maps.load.string()},
                          {"extended", o.extends_map},
                          {"seconds", o.maps.load_seconds}};
  }
  if (!o.maps.save.empty())
    json["saved_map"] = {{"file", o.maps.save.string()}, {"seconds", o.saving_seconds}};
  json["keyframes"] = o.result.keyframes.size();
  json["landmarks"] = o.result.landmarks;
  json["refinement"] = refinement_json(o.result.refined);
  json["movers"] = mover_summary(o.result);
  json["cloud_points"] = o.result.dense.cloud.size();
  json["cloud_views"] = o.result.dense.keyframes;
  json["cloud_voxels_removed"] = o.result.dense.voxels_removed;
  json["static_objects"] = o.result.dense.semantics.objects.size();
  json["cloud_thinned"] = o.result.dense_statistics.thinnings;
  json["seconds"] = o.seconds;
  json["frames_per_second"] = o.frames_per_second();
  json["tracking_median_ms"] = tracking_median(o.result);
  json["slowest_frame"] = slowest_frame(o.result);
  json["medians_of_tenths_ms"] = growth(o.result.timing);
  json["first_pose_s"] =
      o.first_pose_seconds > 0 ? nlohmann::json(o.first_pose_seconds) : nlohmann::json();
  json["mapping_memory_mib"] = o.mapping_memory_mib;
  json["peak_memory_mib"] = peak_memory_mib();
  json["timing_ms"] = o.result.timing.stages();
  if (o.evaluation) json["evaluation"] = *o.evaluation;
  if (!o.evaluation_problem.empty()) json["evaluation_problem"] = o.evaluation_problem;
  json["options"] = options_json(o.options);
  return json;
}

CloudSpan span_of(const Cloud& cloud) { return {cloud.points, cloud.colors, {}}; }

std::vector<MoverPosition> mover_positions(const std::vector<MoverTrack>& tracks) {
  std::vector<MoverPosition> positions;
  for (const MoverTrack& track : tracks) {
    for (const MoverSample& s : track.samples) {
      positions.push_back({.timestamp = s.timestamp,
                           .id = track.id,
                           .class_name = track.class_name,
                           .centroid = s.centroid,
                           .velocity = s.velocity,
                           .observed = s.observed,
                           .box = s.box});
    }
  }
  return positions;
}

void add_movers(const SlamResult& result, ReportData& report) {
  if (result.movers.empty()) return;
  for (const MoverTrack& track : result.movers) {
    const MoverPath path = path_of(track);
    report.movers.push_back({track.id, track.class_name, track.first_seen, track.last_seen,
                             path.length, path.mean_speed, path.observed, path.predicted});
  }
  report.movers_picture = ReportImage{
      draw_movers(mover_positions(result.movers), result.trajectory, span_of(result.dense.cloud)),
      "From above: ways from where each was seen first (disc) to where it was seen "
      "last (box; arrow: way of one second); dotted while hidden"};
}

ReportData report_data(const Outcome& o, const std::vector<ReportImage>& pictures) {
  ReportData report;
  report.title = o.sequence;
  report.sequence = o.sequence;
  report.preset = o.options.motion.preset;
  report.schedule = o.options.schedule.mode;
  report.hardware = machine_description();
  report.version = STILLMAP_VERSION;
  report.options = options_yaml(o.options);
  report.trajectory = o.result.trajectory;
  for (const FrameRecord& f : o.result.frames) report.frame_stamps.push_back(f.timestamp);
  for (const StampedPose& k : o.result.keyframes) report.keyframe_stamps.push_back(k.timestamp);
  report.truth = o.truth;
  report.evaluation = o.evaluation;
  report.coverage = compute_coverage(o.result.trajectory, o.total_frames());
  report.keyframes = o.result.keyframes.size();
  report.landmarks = o.result.landmarks;
  report.cloud_points = o.result.dense.cloud.size();
  report.frames_per_second = o.frames_per_second();
  report.tracking_median = tracking_median(o.result);
  report.facts = {
      {"detector", o.detector.empty() ? "none" : o.detector},
      {"frames segmented", std::to_string(o.result.segmented)},
      {"frames skipped", std::to_string(o.skipped.size())},
      {"frames dropped late", std::to_string(o.dropped)},
      {"frames of fewer keypoints",
       std::to_string(o.result.load_shedding.frames_of_fewer_keypoints)},
      {"maps", std::to_string(o.result.maps)},
      {"loops and losses", places_text(o.result).empty() ? "none" : places_text(o.result)},
      {"peak memory", fmt::format("{:.0f} MiB", peak_memory_mib())}};
  report.timing = o.result.timing.stages();
  report.events = events_of(o.result);
  report.skipped = o.skipped;
  report.gallery = o.gallery;
  if (!pictures.empty()) {
    report.cloud = pictures.front();
    report.figures.assign(pictures.begin() + 1, pictures.end());
  }
  add_movers(o.result, report);
  return report;
}

/// The map that the user wants saved, and the one that `stillmap dense` works on.
void write_maps(Outcome& o, const std::filesystem::path& out, ResultFiles& files) {
  if (!o.map) return;
  const Stopwatch watch;
  std::string bytes;
  if (!o.map->views.empty()) {
    bytes = saved_map_bytes(*o.map);
    files.write(out / kRunMap, [&](const auto& file) { write_file(file, bytes); });
    files.write(out / kRunOptions,
                [&](const auto& file) { write_file(file, options_yaml(o.options)); });
  }
  if (o.maps.save.empty()) return;
  if (o.maps.slim) o.map->views.clear();
  if (o.maps.slim || bytes.empty()) bytes = saved_map_bytes(*o.map);
  files.write(o.maps.save, [&](const auto& file) { write_file(file, bytes); });
  o.saving_seconds = watch.milliseconds() / 1000;
}

std::vector<std::filesystem::path> write_files(Outcome& o, const std::filesystem::path& out) {
  ResultFiles files;
  files.write(out / "trajectory.txt",
              [&](const auto& file) { write_trajectory(file, o.result.trajectory); });
  files.write(out / "keyframes.txt",
              [&](const auto& file) { write_trajectory(file, o.result.keyframes); });
  const std::string movers = movers_jsonl(o.result.movers);
  if (o.options.movers.enabled) {
    files.write(out / "movers.csv",
                [&](const auto& file) { write_file(file, movers_csv(o.result.movers)); });
    files.write(out / "movers.jsonl", [&](const auto& file) { write_file(file, movers); });
  }
  std::vector<ReportImage> pictures;
  if (o.options.dense_cloud) {
    const DenseContext context{o.result.trajectory, movers};
    pictures = write_dense(out, o.result.dense, o.result.placed, context, o.options.dense,
                           o.outputs, files);
    o.result.placed = {};  // by far the largest, and no longer needed
  }
  write_maps(o, out, files);
  files.write(out / "timing.txt",
              [&](const auto& file) { write_file(file, timing_text(o.result.timing.stages())); });
  files.write(out / "summary.json",
              [&](const auto& file) { write_file(file, summary(o).dump(2) + "\n"); });
  const ReportData report = report_data(o, pictures);
  if (report.movers_picture) {
    files.write(out / "movers.png",
                [&](const auto& file) { write_png(file, report.movers_picture->image); });
  }
  files.write(out / "report.html", [&](const auto& file) { write_report(file, report); });
  files.require_all();
  return files.written();
}

void print_outcome(const Outcome& o) {
  fmt::print("{}: {} of {} frames tracked ({}), {} keyframes, {} landmarks", o.sequence,
             o.result.tracked(), o.total_frames(), percent(o.result.tracked(), o.total_frames()),
             o.result.keyframes.size(), o.result.landmarks);
  if (o.result.maps > 1) fmt::print(", {} unconnected maps", o.result.maps);
  if (!o.result.movers.empty()) fmt::print(", {} movers", o.result.movers.size());
  if (const auto places = places_text(o.result); !places.empty()) fmt::print("; {}", places);
  fmt::print("\n{:.1f} frames/s in all, tracking {:.1f} ms (median), {:.0f} MiB at most\n",
             o.frames_per_second(), tracking_median(o.result), peak_memory_mib());
  if (!o.skipped.empty()) {
    fmt::print("{} frames skipped; the first: {:.6f}: {}\n", o.skipped.size(),
               o.skipped.front().timestamp, o.skipped.front().reason);
  }
  if (o.options.schedule.realtime()) fmt::print("{}\n", pace_text(o));
  if (o.evaluation) fmt::print("{}", evaluation_text(*o.evaluation));
  if (!o.evaluation_problem.empty()) fmt::print("no error figures: {}\n", o.evaluation_problem);
  if (o.result.tracked() == 0) {
    fmt::print("no frame was tracked: {}\n",
               o.result.frames.empty() ? "there was none" : o.result.frames.back().reason);
  }
}

/// Shows the user's pictures of every n-th frame, so that they spread over the sequence.
class Gallery {
 public:
  explicit Gallery(std::optional<std::size_t> total)
      : every_(std::max<std::size_t>(1, total.value_or(600) / kGalleryPictures)) {}

  void look(const TrackedFrame& tracked) {
    const std::size_t index = tracked.frame->index();
    if (index % every_ != every_ / 2 || pictures_.size() >= kGalleryPictures) return;
    std::string caption = fmt::format("frame {} at {:.2f} s: {} landmarks agree", index,
                                      tracked.frame->timestamp(), tracked.inliers);
    if (const auto& masks = tracked.frame->instances) {
      caption +=
          fmt::format(", {} instances, masks {} frames old", masks->instances.size(), masks->age());
    }
    pictures_.push_back({draw_frame(tracked), caption});
  }
  std::vector<ReportImage> take() { return std::move(pictures_); }

 private:
  std::size_t every_;
  std::vector<ReportImage> pictures_;
};

void drive(SlamSystem& slam, FrameSource& source, Outcome& outcome, LabelRecorder& labels,
           std::optional<std::size_t> total) {
  Gallery gallery(total);
  Progress progress("mapping", total);
  while (!interrupted()) {
    const RgbdFramePtr frame = source.next();
    if (!frame) break;
    const bool posed = slam.push(frame).has_value();
    if (posed && outcome.first_pose_seconds == 0)
      outcome.first_pose_seconds = seconds_since_start();
    ++outcome.frames;
    traced("gallery", [&] { gallery.look(*slam.newest()); });
    traced("verdicts", [&] { labels.look(*slam.newest()); });
    progress.step(slam.newest()->state == TrackState::kLost ? "lost" : "");
  }
  outcome.interrupted = interrupted();
  outcome.gallery = gallery.take();
}

}  // namespace

SessionReport run_session(Session session) {
  make_output_folder(session.out);
  catch_interrupt();
  Profiler profiler(session.profile);
  Outcome outcome;
  outcome.sequence = session.sequence;
  outcome.options = session.options;
  outcome.truth = std::move(session.truth);
  outcome.maps = session.maps;
  outcome.extends_map = session.start && session.start->extend;
  outcome.outputs = session.dense;
  if (session.detector) outcome.detector = session.detector->description();

  const Camera camera = session.source->camera();
  const bool realtime = session.options.schedule.realtime();
  constexpr int kAhead = 4;  // frames
  std::unique_ptr<FrameSource> source =
      std::make_unique<Prefetch>(std::move(session.source), kAhead,
                                 realtime ? ThreadPriority::kNone : ThreadPriority::kBackground);
  PacedSource* paced = nullptr;
  if (realtime) {
    auto wrapped = std::make_unique<PacedSource>(std::move(source));
    paced = wrapped.get();
    source = std::move(wrapped);
  }
  const Stopwatch watch;
  SlamSystem slam(camera, session.options, std::move(session.detector), std::move(session.start));
  LabelRecorder labels(session.labels, session.out);
  drive(slam, *source, outcome, labels, session.total_frames);
  outcome.result = slam.finish();
  outcome.seconds = watch.milliseconds() / 1000;
  outcome.mapping_memory_mib = peak_memory_mib();
  if (!outcome.maps.save.empty() || outcome.options.dense_cloud) {
    outcome.map = slam.saved_map("stillmap " STILLMAP_VERSION);
  }
  outcome.skipped = source->skipped();
  if (paced != nullptr) outcome.dropped = paced->dropped();
  source.reset();  // ends its thread
  if (outcome.interrupted)
    fmt::print("interrupted after {} frames; saving what there is\n", outcome.frames);

  evaluate(outcome);
  print_outcome(outcome);
  SessionReport report;
  report.files = traced("files", [&] { return write_files(outcome, session.out); });
  for (auto& file : labels.finish()) report.files.push_back(std::move(file));
  for (auto& file : profiler.finish(session.out)) report.files.push_back(std::move(file));
  fmt::print("written:\n");
  for (const auto& file : report.files) fmt::print("  {}\n", file.string());
  report.evaluation = outcome.evaluation;
  report.interrupted = outcome.interrupted;
  report.result = std::move(outcome.result);
  return report;
}

}  // namespace stillmap
