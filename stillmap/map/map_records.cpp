// SPDX-License-Identifier: Apache-2.0
#include "stillmap/map/map_records.hpp"

#include "stillmap/map/byte_columns.hpp"
#include "stillmap/map/pose_bytes.hpp"

#include <cmath>

namespace stillmap {
namespace {

constexpr std::size_t kKeypointBytes = 5 * sizeof(float) + 1 + sizeof(float) + sizeof(Descriptor);

/// Keypoints of another camera may lie outside the images: see with_camera().
bool is_valid(const Keypoint& p, const PyramidShape& pyramid) {
  return finite_within(p.u, -kHuge, kHuge) && finite_within(p.v, -kHuge, kHuge) &&
         std::isfinite(p.angle) && std::isfinite(p.response) && finite_within(p.depth, 0, kHuge) &&
         p.level < pyramid.levels;
}

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

FeaturesPtr get_features(ByteReader& in, const Camera& camera, const PyramidShape& pyramid) {
  auto keypoints = get_items<Keypoint>(in, kKeypointBytes);
  get_column<float>(in, keypoints, [](Keypoint& p, float x) { p.u = x; });
  get_column<float>(in, keypoints, [](Keypoint& p, float x) { p.v = x; });
  get_column<float>(in, keypoints, [](Keypoint& p, float x) { p.angle = x; });
  get_column<float>(in, keypoints, [](Keypoint& p, float x) { p.response = x; });
  get_column<float>(in, keypoints, [](Keypoint& p, float x) { p.depth = x; });
  get_column<std::uint8_t>(in, keypoints, [](Keypoint& p, std::uint8_t x) { p.level = x; });
  for (const Keypoint& p : keypoints) {
    if (!is_valid(p, pyramid)) in.fail("a keypoint is invalid");
  }
  const auto descriptors = in.get_list<Descriptor>(keypoints.size());
  auto features = std::make_shared<Features>();
  features->keypoints.assign(keypoints.begin(), keypoints.end());
  features->descriptors.assign(descriptors.begin(), descriptors.end());
  features->grid = KeypointGrid(keypoints, camera.width, camera.height);
  return features;
}

}  // namespace

void put_keyframe_state(ByteWriter& out, const Keyframe& k, bool first) {
  for (const std::uint32_t count : {k.sequence, k.component, k.session}) out.put(count);
  out.put(static_cast<std::uint8_t>(first));
  out.put<std::uint64_t>(k.frame_index);
  out.put(k.timestamp);
  put_pose(out, k.T_world_camera);
}

bool get_keyframe_state(ByteReader& in, Keyframe& k) {
  for (std::uint32_t* count : {&k.sequence, &k.component, &k.session}) {
    *count = in.get<std::uint32_t>();
    if (*count >= kMaxCount) in.fail("a keyframe number is out of range");
  }
  const bool first = in.get<std::uint8_t>() != 0;
  k.frame_index = in.get<std::uint64_t>();
  k.timestamp = in.get<double>();
  if (!std::isfinite(k.timestamp)) in.fail("a timestamp is not finite");
  k.T_world_camera = get_pose(in);
  return first;
}

void put_keypoints(ByteWriter& out, const Keyframe& k) {
  put_features(out, *k.features);
  out.put_planes(std::span<const float>(k.static_weight));
}

void get_keypoints(ByteReader& in, const Camera& camera, const PyramidShape& pyramid, Keyframe& k) {
  k.features = get_features(in, camera, pyramid);
  k.static_weight = in.get_planes<float>(k.features->size());
  for (const float weight : k.static_weight) {
    if (!std::isfinite(weight)) in.fail("a weight is not finite");
  }
  k.landmarks.resize(k.features->size());
}

void require_valid(const ByteReader& in, const Landmark& l) {
  const bool valid = l.p_world.allFinite() && finite_within(l.normal.norm(), 0.9, 1.1) &&
                     finite_within(l.min_distance, 0, kHuge) &&
                     finite_within(l.max_distance, 0, kHuge) && l.first_sequence < kMaxCount &&
                     std::isfinite(l.static_log_odds);
  if (!valid) in.fail("a landmark is invalid");
}

void put_landmark(ByteWriter& out, const Landmark& l) {
  for (const Eigen::Vector3d* v : {&l.p_world, &l.normal}) {
    for (const double x : *v) out.put(x);
  }
  out.put(l.min_distance);
  out.put(l.max_distance);
  for (const std::uint32_t count : {l.first_sequence, l.predicted, l.found}) out.put(count);
  out.put(l.static_log_odds);
  out.put(l.descriptor);
  out.put(static_cast<std::uint32_t>(l.observations.size()));
  for (const Observation& o : l.observations) {
    for (const std::uint32_t x : {o.keyframe.slot, o.keyframe.generation, o.keypoint}) out.put(x);
  }
}

Landmark get_landmark(ByteReader& in) {
  Landmark l;
  for (Eigen::Vector3d* v : {&l.p_world, &l.normal}) {
    for (double& x : *v) x = in.get<double>();
  }
  l.min_distance = in.get<float>();
  l.max_distance = in.get<float>();
  for (std::uint32_t* count : {&l.first_sequence, &l.predicted, &l.found})
    *count = in.get<std::uint32_t>();
  l.static_log_odds = in.get<float>();
  l.descriptor = in.get<Descriptor>();
  require_valid(in, l);
  const auto observations = in.get<std::uint32_t>();
  for (std::uint32_t i = 0; i < observations; ++i) {
    Observation o;
    for (std::uint32_t* x : {&o.keyframe.slot, &o.keyframe.generation, &o.keypoint})
      *x = in.get<std::uint32_t>();
    l.observations.push_back(o);
  }
  return l;
}

}  // namespace stillmap
