// SPDX-License-Identifier: Apache-2.0
#include "stillmap/map/map_file.hpp"

#include "stillmap/base/bytes.hpp"
#include "stillmap/map/pose_bytes.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace stillmap {
namespace {

constexpr int kMaxSide = 8192;  // pixels
constexpr int kMaxLevels = 32;  // Maximum number of pyramid levels.
constexpr double kHuge = 1e6;   // Bound on plausible coordinates [pixels or m].
/// Bound on sequence, session and component numbers, which count up by one.
constexpr std::uint32_t kMaxCount = 1U << 31;

// ---- Lists of structs are stored field by field, since similar values compress better together.

template <typename Item, typename Field>
void put_column(ByteWriter& out, const std::vector<Item>& items, Field&& field) {
  std::vector<std::decay_t<decltype(field(items.front()))>> column;
  column.reserve(items.size());
  for (const Item& item : items) column.push_back(field(item));
  out.put_planes(std::span<const typename decltype(column)::value_type>(column));
}

template <typename T, typename Item, typename Set>
void get_column(ByteReader& in, std::vector<Item>& items, Set&& set) {
  const auto column = in.get_planes<T>(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) set(items[i], column[i]);
}

/// Returns `count` items to be filled column by column. Fails if the remaining bytes cannot hold
/// them.
template <typename Item>
std::vector<Item> get_items(ByteReader& in, std::size_t bytes_each) {
  const auto count = in.get<std::uint32_t>();
  if (count > in.left() / bytes_each) in.fail("declares more items than it contains");
  return std::vector<Item>(count);
}

bool finite_within(double value, double least, double most) {
  return value >= least && value <= most;  // false for NaN
}

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

constexpr std::size_t kKeypointBytes = 5 * sizeof(float) + 1 + sizeof(float) + sizeof(Descriptor);

void put_features(ByteWriter& out, const Features& features) {
  const auto& keypoints = features.keypoints;
  out.put(static_cast<std::uint32_t>(keypoints.size()));
  put_column(out, keypoints, [](const Keypoint& p) { return p.u; });
  put_column(out, keypoints, [](const Keypoint& p) { return p.v; });
  put_column(out, keypoints, [](const Keypoint& p) { return p.angle; });
  put_column(out, keypoints, [](const Keypoint& p) { return p.response; });
  put_column(out, keypoints, [](const Keypoint& p) { return p.depth; });
  put_column(out, keypoints, [](const Keypoint& p) { return p.level; });
  out.put_list(std::span<const Descriptor>(features.descriptors));
}

bool is_valid(const Keypoint& p, const Camera& camera, const PyramidShape& pyramid) {
  return camera.contains(p.u, p.v, -1) && std::isfinite(p.angle) && std::isfinite(p.response) &&
         finite_within(p.depth, 0, kHuge) && p.level < pyramid.levels;
}

FeaturesPtr get_features(ByteReader& in, const Camera& camera, const PyramidShape& pyramid) {
  auto features = std::make_shared<Features>();
  auto& keypoints = features->keypoints;
  keypoints = get_items<Keypoint>(in, kKeypointBytes);
  get_column<float>(in, keypoints, [](Keypoint& p, float x) { p.u = x; });
  get_column<float>(in, keypoints, [](Keypoint& p, float x) { p.v = x; });
  get_column<float>(in, keypoints, [](Keypoint& p, float x) { p.angle = x; });
  get_column<float>(in, keypoints, [](Keypoint& p, float x) { p.response = x; });
  get_column<float>(in, keypoints, [](Keypoint& p, float x) { p.depth = x; });
  get_column<std::uint8_t>(in, keypoints, [](Keypoint& p, std::uint8_t x) { p.level = x; });
  for (const Keypoint& p : keypoints) {
    if (!is_valid(p, camera, pyramid)) in.fail("a keypoint is invalid");
  }
  features->descriptors = in.get_list<Descriptor>(keypoints.size());
  features->grid = KeypointGrid(keypoints, camera.width, camera.height);
  return features;
}

void put_keyframe(ByteWriter& out, const Keyframe& k, bool first) {
  for (const std::uint32_t count : {k.sequence, k.component, k.session}) out.put(count);
  out.put(static_cast<std::uint8_t>(first));
  out.put<std::uint64_t>(k.frame_index);
  out.put(k.timestamp);
  put_pose(out, k.T_world_camera);
  put_features(out, *k.features);
  out.put_planes(std::span<const float>(k.static_weight));
}

Keyframe get_keyframe(ByteReader& in, MapContent& map) {
  Keyframe k;
  k.id = {static_cast<std::uint32_t>(map.keyframes.size()), 0};
  for (std::uint32_t* count : {&k.sequence, &k.component, &k.session}) {
    *count = in.get<std::uint32_t>();
    if (*count >= kMaxCount) in.fail("a keyframe number is out of range");
  }
  const bool first = in.get<std::uint8_t>() != 0;
  if (first && !map.first.emplace(k.component, k.id).second)
    in.fail("a component has two first keyframes");
  k.frame_index = in.get<std::uint64_t>();
  k.timestamp = in.get<double>();
  if (!std::isfinite(k.timestamp)) in.fail("a timestamp is not finite");
  k.T_world_camera = get_pose(in);
  k.features = get_features(in, map.camera, map.pyramid);
  k.static_weight = in.get_planes<float>(k.features->size());
  for (const float weight : k.static_weight) {
    if (!std::isfinite(weight)) in.fail("a weight is not finite");
  }
  k.landmarks.resize(k.features->size());
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

bool is_valid(const Landmark& l) {
  return l.p_world.allFinite() && finite_within(l.normal.norm(), 0.9, 1.1) &&
         finite_within(l.min_distance, 0, kHuge) && finite_within(l.max_distance, 0, kHuge) &&
         l.first_sequence < kMaxCount && std::isfinite(l.static_log_odds);
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
    if (!is_valid(l)) in.fail("a landmark is invalid");
    l.descriptor = in.get<Descriptor>();
  }
  get_observations(in, map, counts);
}

}  // namespace

std::vector<Section> map_sections(const MapContent& content) {
  ByteWriter camera, keyframes, landmarks;
  put_camera(camera, content.camera);
  camera.put<std::int32_t>(content.pyramid.levels);
  camera.put(content.pyramid.scale_factor);
  keyframes.put(static_cast<std::uint32_t>(content.keyframes.size()));
  for (const Keyframe& k : content.keyframes) {
    put_keyframe(keyframes, k, content.first.at(k.component) == k.id);
  }
  put_landmarks(landmarks, content.landmarks);
  return {{{'C', 'A', 'M', 'R'}, camera.bytes()},
          {{'K', 'E', 'Y', 'F'}, keyframes.bytes()},
          {{'L', 'A', 'N', 'D'}, landmarks.bytes()}};
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
