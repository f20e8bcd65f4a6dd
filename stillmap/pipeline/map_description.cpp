// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/map_description.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/geometry/trimmed_box.hpp"
#include "stillmap/map/map_file.hpp"
#include "stillmap/pipeline/saved_views.hpp"

#include <algorithm>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

constexpr double kOutermost = 0.01;  // share of the landmarks excluded at either end

std::string extent_text(const Eigen::AlignedBox3d& box) {
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  if (!box.isEmpty()) size = box.sizes();
  return fmt::format("{:.2f} x {:.2f} x {:.2f} m", size.x(), size.y(), size.z());
}

std::vector<ComponentDescription> describe_components(const MapContent& map) {
  std::vector<ComponentDescription> components(map.first.size());
  std::vector<std::vector<Eigen::Vector3d>> points(map.first.size());
  for (const Keyframe& k : map.keyframes) ++components[k.component].keyframes;
  for (const Landmark& l : map.landmarks) points[component_of(map, l)].push_back(l.p_world);
  for (std::size_t i = 0; i < components.size(); ++i) {
    components[i].landmarks = points[i].size();
    const double outermost = kOutermost * static_cast<double>(points[i].size());
    components[i].extent = trimmed_box(points[i], static_cast<std::size_t>(outermost));
  }
  return components;
}

std::vector<double> numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

nlohmann::json pose_json(const Pose& pose) {
  const Eigen::Quaterniond& q = pose.quaternion();
  return {{"translation", numbers(pose.translation())},
          {"quaternion_xyzw", {q.x(), q.y(), q.z(), q.w()}}};
}

}  // namespace

MapDescription describe_map(const SavedMap& saved) {
  const MapContent& map = saved.map;
  MapDescription d;
  d.version = saved.version;
  d.writer = saved.writer;
  d.camera = map.camera;
  d.pyramid = map.pyramid;
  d.keyframes = map.keyframes.size();
  d.landmarks = map.landmarks.size();
  for (const Keyframe& k : map.keyframes) {
    d.keypoints += k.features->size();
  }
  d.sessions = keyframe_trajectories(map).size();
  for (const Landmark& l : map.landmarks) d.observations += l.observations.size();
  d.components = describe_components(map);
  d.main = main_component(saved);
  d.at_site = is_at_site(map, d.main);
  d.tags = tag_centers(map, d.main);
  d.views = saved.views.size();
  std::set<std::uint16_t> visits;
  for (const AnchoredView& v : saved.views) {
    d.view_pixels += v.view.depth.total();
    visits.insert(v.view.visit);
  }
  d.visits = visits.size();
  return d;
}

std::string description_text(const MapDescription& d) {
  std::string text = fmt::format(
      "layout      version {}, written by {}\n"
      "camera      {}: {} x {} pixels, fx {:.2f} fy {:.2f} cx {:.2f} cy {:.2f}\n"
      "sensor      {}\n"
      "pyramid     {} levels of factor {}\n"
      "sessions    {}\n"
      "keyframes   {} with {}\n"
      "landmarks   {}, seen {:.1f} times each\n",
      d.version, d.writer, d.camera.name, d.camera.width, d.camera.height, d.camera.fx, d.camera.fy,
      d.camera.cx, d.camera.cy, d.camera.depth_sensor.name, d.pyramid.levels,
      d.pyramid.scale_factor, d.sessions, d.keyframes, counted(d.keypoints, "keypoint"),
      d.landmarks,
      d.landmarks == 0 ? 0.0
                       : static_cast<double>(d.observations) / static_cast<double>(d.landmarks));
  text += fmt::format("components  {}\n", d.components.size());
  for (std::size_t i = 0; i < d.components.size(); ++i) {
    const ComponentDescription& c = d.components[i];
    text += fmt::format("  {:<9} {}, {} within {}{}{}\n", i, counted(c.keyframes, "keyframe"),
                        counted(c.landmarks, "landmark"), extent_text(c.extent),
                        i == d.main && d.components.size() > 1 ? ", shown and exported" : "",
                        i == d.main && d.at_site ? ", in the frame of a site" : "");
  }
  for (const auto& [name, center] : d.tags) {
    text += fmt::format("tag         {} at {:.3f}, {:.3f}, {:.3f} m\n", name, center.x(),
                        center.y(), center.z());
  }
  text += fmt::format("dense       {} of {} with {}\n", counted(d.views, "view"),
                      counted(d.visits, "visit"), counted(d.view_pixels, "pixel"));
  return text;
}

nlohmann::json description_json(const MapDescription& d) {
  nlohmann::json json = {{"version", d.version},           {"writer", d.writer},
                         {"sessions", d.sessions},         {"keyframes", d.keyframes},
                         {"keypoints", d.keypoints},       {"landmarks", d.landmarks},
                         {"observations", d.observations}, {"views", d.views},
                         {"view_pixels", d.view_pixels},   {"visits", d.visits}};
  json["camera"] = {{"name", d.camera.name},     {"width", d.camera.width},
                    {"height", d.camera.height}, {"fx", d.camera.fx},
                    {"fy", d.camera.fy},         {"cx", d.camera.cx},
                    {"cy", d.camera.cy},         {"sensor", d.camera.depth_sensor.name}};
  json["pyramid"] = {{"levels", d.pyramid.levels}, {"scale_factor", d.pyramid.scale_factor}};
  json["components"] = nlohmann::json::array();
  for (const ComponentDescription& c : d.components) {
    nlohmann::json component = {{"keyframes", c.keyframes}, {"landmarks", c.landmarks}};
    if (!c.extent.isEmpty()) {
      component["extent_min"] = numbers(c.extent.min());
      component["extent_max"] = numbers(c.extent.max());
    }
    json["components"].push_back(component);
  }
  json["main_component"] = d.main;
  json["at_site"] = d.at_site;
  json["tags"] = nlohmann::json::object();
  for (const auto& [name, center] : d.tags) json["tags"][name] = numbers(center);
  return json;
}

Cloud landmark_cloud(const SavedMap& saved) {
  const std::uint32_t component = main_component(saved);
  Cloud cloud;
  cloud.reserve(saved.map.landmarks.size());
  for (const Landmark& l : saved.map.landmarks) {
    if (component_of(saved.map, l) == component)
      cloud.add(l.p_world.cast<float>(), {255, 255, 255});
  }
  return cloud;
}

std::map<std::uint32_t, Trajectory> keyframe_trajectories(const MapContent& map,
                                                          std::optional<std::uint32_t> component) {
  std::map<std::uint32_t, Trajectory> sessions;
  for (const Keyframe& k : map.keyframes) {
    if (component && k.component != *component) continue;
    sessions[k.session].push_back({k.timestamp, k.T_world_camera});
  }
  for (auto& [number, session] : sessions) {
    std::sort(session.begin(), session.end(),
              [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; });
  }
  return sessions;
}

nlohmann::json map_graph(const SavedMap& saved, int min_shared) {
  nlohmann::json json = {{"keyframes", nlohmann::json::array()},
                         {"covisible", nlohmann::json::array()}};
  const Map map(saved.map);
  map.for_each_keyframe([&](const Keyframe& k) {
    nlohmann::json keyframe = pose_json(k.T_world_camera);
    keyframe["id"] = k.id.slot;
    keyframe["sequence"] = k.sequence;
    keyframe["component"] = k.component;
    keyframe["session"] = k.session;
    keyframe["timestamp"] = k.timestamp;
    keyframe["first_of_component"] = map.is_first(k.id);
    json["keyframes"].push_back(keyframe);
    for (const Covisible& c : map.covisible(k.id, min_shared)) {
      if (c.keyframe < k.id) continue;
      json["covisible"].push_back(
          {{"a", k.id.slot}, {"b", c.keyframe.slot}, {"landmarks", c.shared}});
    }
  });
  return json;
}

Cloud dense_cloud(const SavedMap& saved) {
  const DenseOptions options;
  return cloud_of(place_views(saved, options)).cloud;
}

}  // namespace stillmap
