// SPDX-License-Identifier: Apache-2.0
#include "stillmap/map/map_file.hpp"

#include "stillmap/map/byte_columns.hpp"
#include "stillmap/map/map_records.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace stillmap {
namespace {

constexpr int kMaxLevels = 32;  // Maximum number of pyramid levels.

// ---- camera

void put_camera(ByteWriter& out, const Camera& c) {
  out.put_text(c.name);
  for (const int side : {c.width, c.height}) out.put<std::int32_t>(side);
  for (const double x : {c.fx, c.fy, c.cx, c.cy}) out.put(x);
  for (const double x : c.distortion) out.put(x);
  for (const double x : {c.depth_factor, c.fps, c.baseline}) out.put(x);
  out.put_text(c.depth_sensor.name);
}

void require_known_sensor(const std::string& name, const ByteReader& in) {
  const auto& known = depth_sensor_names();
  if (std::find(known.begin(), known.end(), name) == known.end()) {
    in.fail("was made with a depth sensor that this program does not know");
  }
}

Camera get_camera(ByteReader& in) {
  Camera c;
  c.name = in.get_text();
  for (int* side : {&c.width, &c.height}) *side = in.get<std::int32_t>();
  for (double* x : {&c.fx, &c.fy, &c.cx, &c.cy}) *x = in.get<double>();
  for (double& x : c.distortion) x = in.get<double>();
  for (double* x : {&c.depth_factor, &c.fps, &c.baseline}) *x = in.get<double>();
  const std::string sensor = in.get_text();
  require_known_sensor(sensor, in);
  c.depth_sensor = depth_sensor_of(sensor, c.fx, c.baseline);
  const bool sized = finite_within(c.width, 1, kMaxSide) && finite_within(c.height, 1, kMaxSide);
  const bool sharp = finite_within(c.fx, 1e-3, kHuge) && finite_within(c.fy, 1e-3, kHuge) &&
                     finite_within(c.cx, -kHuge, kHuge) && finite_within(c.cy, -kHuge, kHuge);
  if (!sized || !sharp || !c.distortion.allFinite() || !finite_within(c.baseline, 1e-6, kHuge) ||
      !std::isfinite(c.depth_factor) || !std::isfinite(c.fps)) {
    in.fail("the camera parameters are invalid");
  }
  return c;
}

PyramidShape get_pyramid(ByteReader& in) {
  PyramidShape pyramid;
  pyramid.levels = in.get<std::int32_t>();
  pyramid.scale_factor = in.get<double>();
  if (!finite_within(pyramid.levels, 1, kMaxLevels) ||
      !finite_within(pyramid.scale_factor, 1.001, 4)) {
    in.fail("the pyramid parameters are invalid");
  }
  return pyramid;
}

// ---- keyframes

Keyframe get_keyframe(ByteReader& in, MapContent& map) {
  Keyframe k;
  k.id = {static_cast<std::uint32_t>(map.keyframes.size()), 0};
  if (get_keyframe_state(in, k) && !map.first.emplace(k.component, k.id).second)
    in.fail("a component has two first keyframes");
  get_keypoints(in, map.camera, map.pyramid, k);
  return k;
}

/// Checks that sequence numbers are unique and that every component from 0 on has a first keyframe.
void check_numbers(const ByteReader& in, const MapContent& map) {
  std::set<std::uint32_t> sequences;
  for (const Keyframe& k : map.keyframes) {
    if (!sequences.insert(k.sequence).second) in.fail("two keyframes have the same number");
    if (!map.first.contains(k.component)) in.fail("a component has no first keyframe");
  }
  if (!map.first.empty() && map.first.rbegin()->first + 1 != map.first.size())
    in.fail("a component is missing");
}

// ---- landmarks

constexpr std::size_t kLandmarkBytes =
    4 + 6 * sizeof(double) + 2 * sizeof(float) + 3 * 4 + sizeof(float) + sizeof(Descriptor);

void put_observations(ByteWriter& out, const std::vector<Landmark>& landmarks) {
  std::vector<std::uint32_t> keyframes, keypoints;
  for (const Landmark& l : landmarks) {
    for (const Observation& o : l.observations) {
      keyframes.push_back(o.keyframe.slot);
      keypoints.push_back(o.keypoint);
    }
  }
  out.put_planes(std::span<const std::uint32_t>(keyframes));
  out.put_planes(std::span<const std::uint32_t>(keypoints));
}

void put_landmarks(ByteWriter& out, const std::vector<Landmark>& landmarks) {
  out.put(static_cast<std::uint32_t>(landmarks.size()));
  const auto put = [&](auto&& field) { put_column(out, landmarks, field); };
  put([](const Landmark& l) { return static_cast<std::uint32_t>(l.observations.size()); });
  for (int axis = 0; axis < 3; ++axis) {
    put([axis](const Landmark& l) { return l.p_world[axis]; });
    put([axis](const Landmark& l) { return l.normal[axis]; });
  }
  put([](const Landmark& l) { return l.min_distance; });
  put([](const Landmark& l) { return l.max_distance; });
  put([](const Landmark& l) { return l.first_sequence; });
  put([](const Landmark& l) { return l.predicted; });
  put([](const Landmark& l) { return l.found; });
  put([](const Landmark& l) { return l.static_log_odds; });
  for (const Landmark& l : landmarks) out.put(l.descriptor);
  put_observations(out, landmarks);
}

/// Records an observation in the keyframe and the landmark, after checking that it is valid.
void link(const ByteReader& in, MapContent& map, Landmark& landmark, const Observation& o) {
  if (o.keyframe.slot >= map.keyframes.size())
    in.fail("an observation refers to a missing keyframe");
  auto& shown = map.keyframes[o.keyframe.slot].landmarks;
  if (o.keypoint >= shown.size()) in.fail("an observation refers to a missing keypoint");
  if (shown[o.keypoint].valid()) in.fail("a keypoint shows two landmarks");
  const bool twice = std::any_of(landmark.observations.begin(), landmark.observations.end(),
                                 [&](const auto& other) { return other.keyframe == o.keyframe; });
  if (twice) in.fail("a keyframe observes a landmark twice");
  shown[o.keypoint] = landmark.id;
  landmark.observations.push_back(o);
}

void get_observations(ByteReader& in, MapContent& map, const std::vector<std::uint32_t>& counts) {
  std::size_t all = 0;
  for (const std::uint32_t count : counts) all += count;
  const auto keyframes = in.get_planes<std::uint32_t>(all);
  const auto keypoints = in.get_planes<std::uint32_t>(all);
  std::size_t next = 0;
  for (std::uint32_t i = 0; i < counts.size(); ++i) {
    Landmark& landmark = map.landmarks[i];
    landmark.id = {i, 0};
    if (counts[i] == 0) in.fail("a landmark has no observation");
    for (std::uint32_t n = 0; n < counts[i]; ++n, ++next) {
      link(in, map, landmark, {{keyframes[next], 0}, keypoints[next]});
    }
  }
}

void get_landmarks(ByteReader& in, MapContent& map) {
  auto& landmarks = map.landmarks;
  landmarks = get_items<Landmark>(in, kLandmarkBytes);
  const auto counts = in.get_planes<std::uint32_t>(landmarks.size());
  for (int axis = 0; axis < 3; ++axis) {
    get_column<double>(in, landmarks, [axis](Landmark& l, double x) { l.p_world[axis] = x; });
    get_column<double>(in, landmarks, [axis](Landmark& l, double x) { l.normal[axis] = x; });
  }
  get_column<float>(in, landmarks, [](Landmark& l, float x) { l.min_distance = x; });
  get_column<float>(in, landmarks, [](Landmark& l, float x) { l.max_distance = x; });
  using Count = std::uint32_t;
  get_column<Count>(in, landmarks, [](Landmark& l, Count x) { l.first_sequence = x; });
  get_column<Count>(in, landmarks, [](Landmark& l, Count x) { l.predicted = x; });
  get_column<Count>(in, landmarks, [](Landmark& l, Count x) { l.found = x; });
  get_column<float>(in, landmarks, [](Landmark& l, float x) { l.static_log_odds = x; });
  for (Landmark& l : landmarks) {
    require_valid(in, l);
    l.descriptor = in.get<Descriptor>();
  }
  get_observations(in, map, counts);
}

DepthErrorPtr get_depth_error(ByteReader in) {
  constexpr double kMost = 1;  // [1/m]
  SmoothDepthError::Nodes nodes;
  for (double& node : nodes) {
    node = in.get<double>();
    if (!(std::abs(node) <= kMost)) in.fail("the error of the depth sensor is invalid");
  }
  in.expect_end();
  return std::make_shared<SmoothDepthError>(nodes);
}

}  // namespace

std::string depth_error_bytes(const SmoothDepthError& error) {
  ByteWriter out;
  for (const double node : error.nodes()) out.put(node);
  return out.bytes();
}

std::vector<Section> map_sections(const MapContent& content) {
  ByteWriter camera, keyframes, landmarks;
  put_camera(camera, content.camera);
  camera.put<std::int32_t>(content.pyramid.levels);
  camera.put(content.pyramid.scale_factor);
  keyframes.put(static_cast<std::uint32_t>(content.keyframes.size()));
  for (const Keyframe& k : content.keyframes) {
    put_keyframe_state(keyframes, k, content.first.at(k.component) == k.id);
    put_keypoints(keyframes, k);
  }
  put_landmarks(landmarks, content.landmarks);
  std::vector<Section> sections{{{'C', 'A', 'M', 'R'}, camera.bytes()},
                                {{'K', 'E', 'Y', 'F'}, keyframes.bytes()},
                                {{'L', 'A', 'N', 'D'}, landmarks.bytes()}};
  if (content.depth_error)
    sections.push_back({kDepthErrorSection, depth_error_bytes(*content.depth_error)});
  return sections;
}

MapContent map_from_sections(const std::vector<Section>& sections, const std::string& where) {
  MapContent map;
  ByteReader camera = section_reader(sections, "CAMR", where);
  map.camera = get_camera(camera);
  map.pyramid = get_pyramid(camera);
  camera.expect_end();
  ByteReader keyframes = section_reader(sections, "KEYF", where);
  const auto count = keyframes.get<std::uint32_t>();
  for (std::uint32_t i = 0; i < count; ++i) {
    map.keyframes.push_back(get_keyframe(keyframes, map));
  }
  check_numbers(keyframes, map);
  keyframes.expect_end();
  ByteReader landmarks = section_reader(sections, "LAND", where);
  get_landmarks(landmarks, map);
  landmarks.expect_end();
  if (std::ranges::find(sections, kDepthErrorSection, &Section::name) != sections.end())
    map.depth_error = get_depth_error(section_reader(sections, "DERR", where));
  return map;
}

ByteReader section_reader(const std::vector<Section>& sections, std::string_view name,
                          const std::string& where) {
  const std::string fix = "copy the file again, or " + std::string(kMapFormat.remake);
  const auto found = std::find_if(sections.begin(), sections.end(), [&](const Section& s) {
    return std::string_view(s.name.data(), s.name.size()) == name;
  });
  if (found == sections.end()) throw Error(fmt::format("has no section {}", name), where, fix);
  return {found->bytes, fmt::format("{}, section {}", where, name), fix};
}

}  // namespace stillmap
