// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/finding_json.hpp"
#include "stillmap/config/write_options.hpp"
#include "stillmap/evaluate/timing.hpp"
#include "stillmap/report/mover_files.hpp"
#include "stillmap/report/run_record.hpp"

#include <algorithm>
#include <array>

#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

nlohmann::json json_of(const MapEvent& e) {
  if (e.kind == MapEvent::Kind::kDropped)
    return {{"frame", e.frame_index}, {"timestamp", e.timestamp}, {"keyframes", e.keyframes}};
  return {
      {"frame", e.frame_index},        {"timestamp", e.timestamp}, {"seen_in_frame", e.seen_in},
      {"inliers", e.inliers},          {"fused", e.fused},         {"meters", e.meters},
      {"radians", e.radians},          {"keyframes", e.keyframes}, {"pose_graph_ms", e.graph_ms},
      {"milliseconds", e.milliseconds}};
}

/// Returns loops, merges, dropped maps and relocalizations.
nlohmann::json map_events_json(const SlamResult& result) {
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
    lost = f.state == TrackState::kLost || f.tracked_late ? lost + 1 : 0;
  }
  return json;
}

/// Returns the number of highly dynamic frames; null without a dynamics gate.
nlohmann::json highly_dynamic_json(const SlamResult& result) {
  const auto frames_of = [&](Dynamics dynamics) {
    return std::count_if(result.frames.begin(), result.frames.end(),
                         [&](const FrameRecord& f) { return f.dynamics == dynamics; });
  };
  const auto high = frames_of(Dynamics::kHigh);
  return high + frames_of(Dynamics::kLow) > 0 ? nlohmann::json(high) : nullptr;
}

/// Returns begin and end of the highly dynamic periods [s].
nlohmann::json highly_dynamic_periods_json(const SlamResult& result) {
  auto json = nlohmann::json::array();
  for (const DynamicsPeriod& period : dynamics_periods(result)) {
    if (period.dynamics == Dynamics::kHigh) json.push_back({period.begin, period.end});
  }
  return json;
}

nlohmann::json frames_json(const RunRecord& record) {
  const LoadShedding& less = record.result.load_shedding;
  auto uncertain_at = nlohmann::json::array();
  for (const FrameRecord& f : record.result.frames) {
    if (f.uncertain()) uncertain_at.push_back(f.timestamp);
  }
  return {{"total", record.total_frames()},
          {"handed_in", record.frames},
          {"tracked", record.result.tracked()},
          {"skipped", record.frames_skipped()},
          {"depth_images_skipped", record.skipped.size() - record.frames_skipped()},
          {"dropped_late", record.dropped.size()},
          {"segmented", record.result.segmented},
          {"fewer_keypoints", less.frames_of_fewer_keypoints},
          {"without_movers", less.frames_without_movers},
          {"without_view", less.frames_without_view},
          {"uncertain", uncertain_at.size()},
          {"uncertain_at", uncertain_at},
          {"highly_dynamic", highly_dynamic_json(record.result)},
          {"highly_dynamic_periods", highly_dynamic_periods_json(record.result)},
          {"tracked_late", frames_with(record.result, &FrameRecord::tracked_late)},
          {"tracked_by_odometry", frames_with(record.result, &FrameRecord::tracked_by_odometry)},
          {"predicted", frames_with(record.result, &FrameRecord::predicted)}};
}

/// Returns the camera with the timing of its shutters [s], and where the timing comes from.
nlohmann::json camera_json(const SlamResult& result) {
  const Camera& c = result.camera;
  const ShutterTiming& shutter = result.shutter;
  const char* origin = "none found";
  if (c.shutter) {
    origin = "camera file";
  } else if (shutter != ShutterTiming{}) {
    origin = "estimated from the recording";
  }
  return {{"name", c.name},
          {"size", {c.width, c.height}},
          {"focal_lengths", {c.fx, c.fy}},
          {"principal_point", {c.cx, c.cy}},
          {"depth_factor", c.depth_factor},
          {"depth_sensor", c.depth_sensor.name},
          {"disparity_offset", c.disparity_bias.offset},
          {"disparity_bow", c.disparity_bias.bow},
          {"shutter",
           {{"readout_s", shutter.readout},
            {"depth_delay_s", shutter.depth_delay},
            {"origin", origin}}}};
}

nlohmann::json movers_json(const SlamResult& result) {
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
  return {{"triangulated", totals.triangulated},
          {"duplicates_fused", totals.fused},
          {"repeated_erased", totals.repeated.size()},
          {"landmarks_culled", totals.landmarks_culled},
          {"keyframes_culled", totals.keyframes_culled}};
}

/// Returns the frame with the longest tracking time, with the times of its stages [ms].
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

/// Returns the medians of ten consecutive parts of the run [ms], which show whether a stage becomes
/// slower during the run. Null for fewer than 100 calls.
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

nlohmann::json growth_json(const StageTimes& timing) {
  nlohmann::json json;
  for (const char* stage : {"tracking", "features", "motion", "pose", "keyframe insertion",
                            "map refinement", "place recognition", "dense map: keyframe"}) {
    json[stage] = medians_of_tenths(timing.samples(stage));
  }
  return json;
}

nlohmann::json text_or_null(const std::string& text) {
  return text.empty() ? nlohmann::json() : nlohmann::json(text);
}

/// Returns library, device and schedule of the detector; null without one.
nlohmann::json network_json(const std::optional<DetectorUse>& use) {
  if (!use) return {};
  const InferenceInfo inference = use->inference.value_or(InferenceInfo{});
  return {{"backend", text_or_null(inference.backend)},
          {"version", text_or_null(inference.version)},
          {"device", text_or_null(inference.device)},
          {"every", use->every},
          {"mask_delay", use->mask_delay}};
}

void add_map(const RunRecord& record, nlohmann::json& json) {
  const SlamResult& result = record.result;
  json["maps"] = result.maps;
  json.update(map_events_json(result));
  if (record.loaded) {
    json["loaded_map"] = {{"file", record.loaded->file.string()},
                          {"extended", record.loaded->extended},
                          {"seconds", record.loaded->seconds}};
    if (!record.loaded->extended) {
      nlohmann::json& components = json["loaded_map"]["frames_by_component"];
      components = nlohmann::json::object();
      for (const auto& [component, frames] : result.frames_by_map)
        components[std::to_string(component)] = frames;
    }
  }
  json["keyframes"] = result.keyframes.size();
  json["landmarks"] = result.landmarks;
  json["refinement"] = refinement_json(result.refined);
  json["cloud_points"] = result.dense.cloud.size();
  json["cloud_views"] = result.dense.keyframes;
  json["cloud_voxels_removed"] = result.dense.voxels_removed;
  json["static_objects"] = result.dense.semantics.objects.size();
  json["cloud_views_on_disk"] = result.dense_statistics.views_on_disk;
}

void add_timing(const RunRecord& record, nlohmann::json& json) {
  json["seconds"] = record.seconds;
  json["frames_per_second"] = record.frames_per_second();
  json["tracking_median_ms"] = record.tracking_median();
  json["slowest_frame"] = slowest_frame(record.result);
  json["medians_of_tenths_ms"] = growth_json(record.result.timing);
  json["first_pose_s"] =
      record.first_pose_seconds ? nlohmann::json(*record.first_pose_seconds) : nlohmann::json();
  json["mapping_memory_mib"] = record.mapping_memory_mib;
  json["peak_memory_mib"] = record.peak_memory_mib;
  json["timing_ms"] = record.result.timing.stages();
}

}  // namespace

nlohmann::json run_summary_json(const RunRecord& record) {
  nlohmann::json json;
  json["stillmap"] = STILLMAP_VERSION;
  json["machine"] = record.machine;
  json["sequence"] = record.sequence;
  json["recording"] = text_or_null(record.recording);
  json["preset"] = record.options.preset();
  json["schedule"] = record.options.schedule.mode;
  json["camera"] = camera_json(record.result);
  json["detector"] = text_or_null(record.detector);
  json["network"] = network_json(record.result.detector);
  json["frames_without_masks"] = text_or_null(record.result.detector_skipped);
  json["findings"] = record.findings;
  json["interrupted"] = record.interrupted;
  json["frames"] = frames_json(record);
  for (const SkippedFrame& s : record.skipped)
    json["skipped"].push_back(
        {{"timestamp", s.timestamp}, {"reason", s.reason}, {"frame_lost", s.frame_lost}});
  for (const RunEvent& e : run_events(record.result))
    json["events"].push_back({{"timestamp", e.timestamp}, {"text", e.text}});
  add_map(record, json);
  json["movers"] = movers_json(record.result);
  add_timing(record, json);
  if (record.evaluation) json["evaluation"] = *record.evaluation;
  if (!record.evaluation_problem.empty()) json["evaluation_problem"] = record.evaluation_problem;
  json["options"] = options_json(record.options);
  return json;
}

}  // namespace stillmap
