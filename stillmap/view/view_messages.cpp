// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/view_messages.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/report/chart.hpp"
#include "stillmap/report/frame_image.hpp"
#include "stillmap/report/run_record.hpp"
#include "stillmap/sensor/jpeg_image.hpp"
#include "stillmap/view/message_bytes.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

constexpr int kJpegQuality = 80;  // [percent]

double rounded(double value) { return std::round(value * 1e4) / 1e4; }

nlohmann::json json_of(const Eigen::Vector3d& v) {
  return {rounded(v.x()), rounded(v.y()), rounded(v.z())};
}

nlohmann::json json_of(const Pose& T) {
  const Eigen::Vector3d& t = T.translation();
  const Eigen::Quaterniond& q = T.quaternion();
  return {rounded(t.x()), rounded(t.y()), rounded(t.z()), rounded(q.x()),
          rounded(q.y()), rounded(q.z()), rounded(q.w())};
}

/// Returns the time of day, for the latency between this program and a page [ms since 1970].
double wall_clock_ms() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration<double, std::milli>(now).count();
}

const char* name_of(Viewed viewed) {
  switch (viewed) {
    case Viewed::kRunInProgress:
      return "live";
    case Viewed::kFinishedRun:
      return "run";
    case Viewed::kSavedMap:
      return "map";
    case Viewed::kCloud:
      return "cloud";
    case Viewed::kMapChanges:
      return "changes";
  }
  return "";
}

const char* name_of(UpSource source) {
  switch (source) {
    case UpSource::kRules:
      return "rules";
    case UpSource::kRun:
      return "run";
    case UpSource::kFloor:
      return "floor";
    case UpSource::kImages:
      return "images";
  }
  return "";
}

nlohmann::json sample_json(const MoverSample& sample) {
  return {{"t", sample.timestamp},
          {"observed", sample.observed},
          {"p", json_of(sample.centroid)},
          {"v", json_of(sample.velocity)},
          {"min", json_of(Eigen::Vector3d(sample.box.min()))},
          {"max", json_of(Eigen::Vector3d(sample.box.max()))}};
}

}  // namespace

ViewedState viewed_state(const FrameRecord& record) {
  if (!record.has_pose()) return ViewedState::kLost;
  if (record.relocalized) return ViewedState::kRelocalized;
  return record.tracked_by_odometry || record.predicted() ? ViewedState::kOdometry
                                                          : ViewedState::kTracked;
}

std::vector<PathFrame> camera_path(const std::vector<PathFrame>& states,
                                   const Trajectory& trajectory) {
  std::vector<PathFrame> path;
  auto pose = trajectory.begin();
  for (const PathFrame& frame : states) {
    while (pose != trajectory.end() && pose->timestamp < frame.timestamp) ++pose;
    if (pose != trajectory.end() && pose->timestamp == frame.timestamp) {
      path.push_back({frame.timestamp, frame.state, pose->T_world_camera});
    } else if (frame.state == ViewedState::kLost && !path.empty()) {
      path.push_back({frame.timestamp, frame.state, path.back().T_world_camera});
    }
  }
  return path;
}

std::string path_message(const std::vector<PathFrame>& path) {
  const double first = path.empty() ? 0 : path.front().timestamp;
  MessageBytes bytes(BinaryMessage::kPath);
  bytes.add(static_cast<std::uint32_t>(path.size()));
  bytes.add(first);
  for (const PathFrame& frame : path) {
    bytes.add(static_cast<float>(frame.timestamp - first));
    for (int i = 0; i < 3; ++i)
      bytes.add(static_cast<float>(frame.T_world_camera.translation()[i]));
    for (int i = 0; i < 4; ++i)
      bytes.add(static_cast<float>(frame.T_world_camera.quaternion().coeffs()[i]));
    bytes.add(static_cast<std::uint32_t>(frame.state));
  }
  return bytes.take();
}

std::string image_message(const TrackedFrame& tracked) {
  const std::vector<unsigned char> jpeg = encode_jpeg(draw_frame(tracked), kJpegQuality);
  MessageBytes bytes(BinaryMessage::kFrameImage);
  bytes.add(static_cast<std::uint32_t>(tracked.frame->index()));
  bytes.add_bytes({reinterpret_cast<const char*>(jpeg.data()), jpeg.size()});
  return bytes.take();
}

nlohmann::json run_message(const std::string& name, const Camera& camera,
                           std::optional<std::size_t> frames, Viewed viewed) {
  return {{"type", "run"},
          {"name", name},
          {"live", viewed == Viewed::kRunInProgress},
          {"kind", name_of(viewed)},
          {"frames", frames ? nlohmann::json(*frames) : nlohmann::json()},
          {"camera",
           {{"width", camera.width},
            {"height", camera.height},
            {"fx", camera.fx},
            {"fy", camera.fy},
            {"cx", camera.cx},
            {"cy", camera.cy}}}};
}

nlohmann::json frame_message(const FrameRecord& record, const std::optional<Pose>& T_world_camera,
                             const LoadShedding& shedding, std::size_t tracked) {
  return {{"type", "frame"},
          {"index", record.index},
          {"t", record.timestamp},
          {"wall", wall_clock_ms()},
          {"state", static_cast<int>(viewed_state(record))},
          {"reason", record.reason},
          {"tracked", tracked},
          {"pose", T_world_camera ? json_of(*T_world_camera) : nlohmann::json()},
          {"keypoints", record.keypoints},
          {"moving", record.moving_keypoints},
          {"inliers", record.inliers},
          {"mask_age", record.mask_age},
          {"dynamics", static_cast<int>(record.dynamics)},
          {"ms",
           {{"features", record.times.features},
            {"masks", record.times.masks},
            {"motion", record.times.motion},
            {"pose", record.times.pose},
            {"waiting", record.times.waiting}}},
          {"shed",
           {{"without_movers", shedding.frames_without_movers},
            {"without_view", shedding.frames_without_view},
            {"fewer_keypoints", shedding.frames_of_fewer_keypoints}}}};
}

nlohmann::json movers_message(const std::vector<Mover>& movers) {
  nlohmann::json list = nlohmann::json::array();
  for (const Mover& mover : movers) {
    nlohmann::json json = sample_json(mover.now);
    json["id"] = mover.id;
    json["class"] = mover.class_name;
    json["confidence"] = rounded(mover.class_confidence);
    list.push_back(std::move(json));
  }
  return {{"type", "movers"}, {"movers", std::move(list)}};
}

nlohmann::json tracks_message(const std::vector<MoverTrack>& tracks) {
  nlohmann::json list = nlohmann::json::array();
  for (const MoverTrack& track : tracks) {
    nlohmann::json samples = nlohmann::json::array();
    for (const MoverSample& sample : track.samples) samples.push_back(sample_json(sample));
    list.push_back({{"id", track.id}, {"class", track.class_name}, {"samples", samples}});
  }
  return {{"type", "tracks"}, {"tracks", std::move(list)}};
}

nlohmann::json map_message(const std::vector<Pose>& keyframes, const std::vector<MapEvent>& events,
                           const Ground& ground) {
  nlohmann::json poses = nlohmann::json::array(), list = nlohmann::json::array();
  for (const Pose& pose : keyframes) poses.push_back(json_of(pose));
  for (const MapEvent& event : events) {
    list.push_back({{"kind", name_of(event.kind)},
                    {"t", event.timestamp},
                    {"frame", event.frame_index},
                    {"seen_in", event.seen_in}});
  }
  return {{"type", "map"},
          {"keyframes", std::move(poses)},
          {"events", std::move(list)},
          {"up", json_of(ground.up)},
          {"floor", rounded(ground.height)},
          {"up_from", name_of(ground.source)}};
}

nlohmann::json points_message(const WarningRules& rules) {
  nlohmann::json points = nlohmann::json::array();
  for (const DistanceRule& rule : rules.distances) {
    points.push_back({{"name", rule.point},
                      {"rule", rule.name},
                      {"offset", json_of(rule.offset)},
                      {"nearer", rule.nearer},
                      {"level", rule.level}});
  }
  return {{"type", "points"}, {"points", std::move(points)}};
}

nlohmann::json cloud_message(std::size_t points, const MapCost& cost) {
  return {{"type", "cloud"},
          {"points", points},
          {"changed", cost.changed_chunks},
          {"bytes", cost.bytes},
          {"ms", rounded(cost.milliseconds)}};
}

nlohmann::json objects_message(const std::vector<StaticObject>& objects) {
  nlohmann::json message = objects_json({.objects = objects, .object = {}, .confidence = {}});
  message["type"] = "objects";
  return message;
}

nlohmann::json palette_message(const std::vector<ClassColor>& classes) {
  nlohmann::json names = nlohmann::json::array(), colors = nlohmann::json::array();
  for (const ClassColor& entry : classes) {
    names.push_back(entry.class_name);
    colors.push_back(entry.color);
  }
  return {{"type", "palette"}, {"names", std::move(names)}, {"colors", std::move(colors)}};
}

std::vector<ClassColor> lasting_colors(const std::vector<std::string>& classes) {
  std::vector<ClassColor> colors;
  for (const std::string& name : classes) {
    // Multiples of the golden section are spread over all hues, however many there are.
    const double hue = std::fmod(0.61803398875 * static_cast<double>(colors.size()), 1.0);
    colors.push_back({.class_name = name, .color = color_of_hue(hue)});
  }
  return colors;
}

}  // namespace stillmap
