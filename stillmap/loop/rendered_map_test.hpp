// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/orb_extractor.hpp"
#include "stillmap/loop/guided_search.hpp"
#include "stillmap/loop/place_index.hpp"
#include "stillmap/map/map.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"

#include <memory>
#include <vector>

/// Maps of rendered rooms with known poses, for the tests of this module.
namespace stillmap::rendered {

inline SimulationOptions small_images(SimulationOptions options) {
  options.width = 320, options.height = 240;
  return options;
}

/// Extracts the features of a 320 x 240 image.
inline Features extract(const RgbdFrame& frame) {
  OrbExtractor orb({.keypoints = 600});
  return orb.extract(frame.gray, frame.depth);
}

/// Builds a map keyframe by keyframe at given poses, as tracking and mapping would: landmarks from
/// depth, observed again in later keyframes.
class MapBuilder {
 public:
  explicit MapBuilder(const Camera& camera) : map(camera, PyramidShape{}) {}

  /// Adds a frame at a pose. `new_component` starts a new component; `new_track` only prevents
  /// observations of earlier landmarks, as after long drift.
  KeyframeId add(const RgbdFrame& frame, const Pose& T_world_camera, bool new_component = false,
                 bool new_track = false) {
    Keyframe made;
    if (new_component && map.keyframe_count() > 0) ++component_;
    if (new_component || new_track) recent_.clear();
    made.component = component_;
    made.frame_index = frame.index;
    made.timestamp = frame.timestamp;
    made.T_world_camera = T_world_camera;
    auto features = std::make_shared<const Features>(extract(frame));
    made.static_weight.assign(features->size(), 1);
    made.features = features;
    const KeyframeId id = map.add_keyframe(std::move(made)).id;
    see_known_landmarks(id);
    make_landmarks(id);
    index.insert(map.at(id));
    recent_.push_back(id);
    return id;
  }

  Map map;
  PlaceIndex index{std::make_shared<const Vocabulary>(Vocabulary::built_in())};

 private:
  void see_known_landmarks(KeyframeId id) {
    const std::size_t first = recent_.size() > 4 ? recent_.size() - 4 : 0;
    const auto known = landmarks_seen_by(map, std::span(recent_).subspan(first));
    const Keyframe& k = map.at(id);
    constexpr double kRadius = 3;  // pixels
    const auto found =
        search_landmarks(map, known, {*k.features, k.static_weight}, k.T_world_camera, kRadius);
    for (const LandmarkMatch& s : found.matches) {
      if (map.observe(s.landmark, {id, s.keypoint})) map.refresh(s.landmark);
    }
  }

  void make_landmarks(KeyframeId id) {
    const Keyframe& k = map.at(id);
    for (std::uint32_t i = 0; i < k.features->size(); ++i) {
      const Keypoint& p = k.features->keypoints[i];
      if (k.landmarks[i].valid() || p.depth <= 0 || p.depth > 6) continue;
      map.add_landmark(k.T_world_camera * map.camera().unproject(p.u, p.v, p.depth), {id, i});
    }
  }

  std::uint32_t component_ = 0;
  std::vector<KeyframeId> recent_;
};

}  // namespace stillmap::rendered
