// SPDX-License-Identifier: Apache-2.0
#include "stillmap/map/map.hpp"

#include "stillmap/feature/tag_corners.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace stillmap {
namespace {

/// Number of newest descriptors among which the medoid is chosen; recent appearance matters most,
/// and the cost is quadratic.
constexpr std::size_t kMedoidSample = 16;

/// Returns the index of the descriptor with the least sum of distances to the others, the first of
/// equals.
std::size_t medoid(const std::vector<const Descriptor*>& descriptors) {
  std::size_t best = 0;
  int least = std::numeric_limits<int>::max();
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    int sum = 0;
    for (const Descriptor* other : descriptors) sum += distance(*descriptors[i], *other);
    if (sum < least) {
      least = sum;
      best = i;
    }
  }
  return best;
}

/// Returns the new ids, indexed by the old slot.
template <typename Item>
std::vector<decltype(Item::id)> numbers_of(const std::vector<Item>& items) {
  std::vector<decltype(Item::id)> numbers;
  for (std::uint32_t i = 0; i < items.size(); ++i) {
    const std::uint32_t slot = items[i].id.slot;
    if (slot >= numbers.size()) numbers.resize(slot + 1);
    numbers[slot] = {i, 0};
  }
  return numbers;
}

/// Renumbers all ids to list positions, without the gaps of empty slots.
void renumber_ids(MapContent& content) {
  const auto keyframes = numbers_of(content.keyframes);
  const auto landmarks = numbers_of(content.landmarks);
  for (Keyframe& k : content.keyframes) {
    k.id = keyframes[k.id.slot];
    for (LandmarkId& id : k.landmarks) {
      if (id.valid()) id = landmarks[id.slot];
    }
  }
  for (Landmark& l : content.landmarks) {
    l.id = landmarks[l.id.slot];
    for (Observation& o : l.observations) o.keyframe = keyframes[o.keyframe.slot];
  }
  for (auto& [component, id] : content.first) id = keyframes[id.slot];
}

/// Renumbers the components 0, 1, 2, ... without the gaps left by merges.
void renumber_components(MapContent& content) {
  std::map<std::uint32_t, std::uint32_t> numbers;
  std::map<std::uint32_t, KeyframeId> first;
  for (const auto& [component, id] : content.first) {
    const auto number = static_cast<std::uint32_t>(numbers.size());
    numbers[component] = number;
    first[number] = id;
  }
  for (Keyframe& k : content.keyframes) k.component = numbers.at(k.component);
  content.first = std::move(first);
}

}  // namespace

Map::Map(MapContent content)
    : camera_(std::move(content.camera)),
      pyramid_(content.pyramid),
      depth_error_(std::move(content.depth_error)),
      first_(std::move(content.first)) {
  for (Keyframe& keyframe : content.keyframes) {
    next_sequence_ = std::max(next_sequence_, keyframe.sequence + 1);
    next_component_ = std::max(next_component_, keyframe.component + 1);
    session_ = std::max(session_, keyframe.session + 1);
    keyframes_.emplace([&](KeyframeId) { return std::move(keyframe); });
  }
  for (Landmark& landmark : content.landmarks) {
    landmarks_.emplace([&](LandmarkId) { return std::move(landmark); });
  }
}

MapContent Map::content() const {
  MapContent content{camera_, pyramid_, {}, {}, depth_error_, {}};
  keyframes_.for_each([&](const Keyframe& k) {
    content.keyframes.push_back(k);
    if (is_first(k.id)) content.first[k.component] = k.id;
    // The oldest remaining keyframe, if the first one was erased.
    content.first.emplace(k.component, k.id);
  });
  landmarks_.for_each([&](const Landmark& l) { content.landmarks.push_back(l); });
  renumber_ids(content);
  renumber_components(content);
  return content;
}

std::vector<KeyframeId> Map::add(MapContent content, MapAge age) {
  // Added to the numbers of the added ones.
  std::uint32_t components = next_component_;
  // The present run may have no keyframes yet.
  const std::uint32_t sessions = std::max(end_of_sessions(), session_ + 1);
  const std::uint32_t sequences = next_sequence_;
  if (age == MapAge::kOlder) {
    shift_components(content.first.empty() ? 0 : content.first.rbegin()->first + 1);
    components = 0;
  }
  std::vector<KeyframeId> keyframes;
  for (Keyframe& k : content.keyframes) {
    k.sequence += sequences;
    k.session += sessions;
    k.component += components;
    next_sequence_ = std::max(next_sequence_, k.sequence + 1);
    next_component_ = std::max(next_component_, k.component + 1);
    const Keyframe& added = keyframes_.emplace([&](KeyframeId id) {
      k.id = id;
      return std::move(k);
    });
    keyframes.push_back(added.id);
  }
  std::vector<LandmarkId> landmarks;
  for (Landmark& l : content.landmarks) {
    l.first_sequence += sequences;
    for (Observation& o : l.observations) o.keyframe = keyframes[o.keyframe.slot];
    const Landmark& added = landmarks_.emplace([&](LandmarkId id) {
      l.id = id;
      return std::move(l);
    });
    landmarks.push_back(added.id);
  }
  for (const KeyframeId keyframe : keyframes) {
    for (LandmarkId& id : keyframes_.find(keyframe)->landmarks) {
      if (id.valid()) id = landmarks[id.slot];
    }
  }
  for (const auto& [component, id] : content.first)
    first_[component + components] = keyframes[id.slot];
  return keyframes;
}

void Map::shift_components(std::uint32_t by) {
  keyframes_.for_each([&](Keyframe& k) { k.component += by; });
  for (const auto& [component, id] : std::exchange(first_, {})) first_[component + by] = id;
  next_component_ += by;
}

/// Returns one more than the largest session of a keyframe.
std::uint32_t Map::end_of_sessions() const {
  std::uint32_t end = 0;
  for_each_keyframe([&](const Keyframe& k) { end = std::max(end, k.session + 1); });
  return end;
}

Keyframe& Map::add_keyframe(Keyframe keyframe) {
  keyframe.sequence = next_sequence_++;
  keyframe.session = session_;
  keyframe.landmarks.assign(keyframe.features->size(), LandmarkId{});
  const std::uint32_t component = keyframe.component;
  Keyframe& added = keyframes_.emplace([&](KeyframeId id) {
    keyframe.id = id;
    return std::move(keyframe);
  });
  first_.emplace(component, added.id);
  next_component_ = std::max(next_component_, component + 1);
  return added;
}

Landmark& Map::add_landmark(const Eigen::Vector3d& p_world, const Observation& observation) {
  Keyframe& keyframe = *keyframes_.find(observation.keyframe);
  Landmark& landmark = landmarks_.emplace([&](LandmarkId id) {
    Landmark made;
    made.id = id;
    made.p_world = p_world;
    made.observations = {observation};
    made.first_sequence = keyframe.sequence;
    return made;
  });
  keyframe.landmarks[observation.keypoint] = landmark.id;
  refresh(landmark.id);
  return landmark;
}

const Keyframe& Map::at(KeyframeId id) const {
  const Keyframe* keyframe = find(id);
  if (keyframe == nullptr) throw std::out_of_range("no such keyframe");
  return *keyframe;
}

const Landmark& Map::at(LandmarkId id) const {
  const Landmark* landmark = find(id);
  if (landmark == nullptr) throw std::out_of_range("no such landmark");
  return *landmark;
}

void Map::set_pose(KeyframeId id, const Pose& T_world_camera) {
  keyframes_.find(id)->T_world_camera = T_world_camera;
}

void Map::set_features(KeyframeId id, FeaturesPtr features) {
  keyframes_.find(id)->features = std::move(features);
}

void Map::set_position(LandmarkId id, const Eigen::Vector3d& p_world) {
  landmarks_.find(id)->p_world = p_world;
}

void Map::count_visibility(LandmarkId id, std::uint32_t predicted, std::uint32_t found) {
  if (Landmark* landmark = landmarks_.find(id)) {
    landmark->predicted += predicted;
    landmark->found += found;
  }
}

void Map::set_static_log_odds(LandmarkId id, float log_odds) {
  if (Landmark* landmark = landmarks_.find(id)) landmark->static_log_odds = log_odds;
}

bool Map::observe(LandmarkId id, const Observation& observation) {
  Landmark* landmark = landmarks_.find(id);
  Keyframe* keyframe = keyframes_.find(observation.keyframe);
  if (landmark == nullptr || keyframe == nullptr) return false;
  if (landmarks_.contains(keyframe->landmarks[observation.keypoint])) return false;
  for (const Observation& o : landmark->observations) {
    if (o.keyframe == observation.keyframe) return false;
  }
  landmark->observations.push_back(observation);
  keyframe->landmarks[observation.keypoint] = id;
  return true;
}

void Map::forget(LandmarkId id, KeyframeId keyframe_id) {
  Landmark* landmark = landmarks_.find(id);
  if (landmark == nullptr) return;
  auto& observations = landmark->observations;
  const auto found = std::find_if(observations.begin(), observations.end(),
                                  [&](const Observation& o) { return o.keyframe == keyframe_id; });
  if (found == observations.end()) return;
  keyframes_.find(keyframe_id)->landmarks[found->keypoint] = LandmarkId{};
  observations.erase(found);
  if (observations.empty()) landmarks_.erase(id);
}

void Map::merge(LandmarkId keep, LandmarkId drop) {
  if (keep == drop || !landmarks_.contains(keep) || !landmarks_.contains(drop)) return;
  const Landmark dropped = at(drop);
  erase(drop);
  for (const Observation& o : dropped.observations) observe(keep, o);
  Landmark& kept = *landmarks_.find(keep);
  kept.predicted += dropped.predicted;
  kept.found += dropped.found;
  kept.first_sequence = std::min(kept.first_sequence, dropped.first_sequence);
  refresh(keep);
}

void Map::erase(LandmarkId id) {
  const Landmark* landmark = landmarks_.find(id);
  if (landmark == nullptr) return;
  for (const Observation& o : landmark->observations) {
    keyframes_.find(o.keyframe)->landmarks[o.keypoint] = LandmarkId{};
  }
  landmarks_.erase(id);
}

void Map::erase(KeyframeId id, KeyframeId replacement) {
  const Keyframe& keyframe = at(id);
  replacements_[id] = {replacement,
                       at(replacement).T_world_camera.inverse() * keyframe.T_world_camera};
  const std::vector<LandmarkId> seen = keyframe.landmarks;
  for (const LandmarkId landmark : seen) forget(landmark, id);
  keyframes_.erase(id);
}

void Map::refresh(LandmarkId id) {
  Landmark& landmark = *landmarks_.find(id);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::vector<const Descriptor*> descriptors;
  const std::size_t count = landmark.observations.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Observation& o = landmark.observations[i];
    const Keyframe& keyframe = at(o.keyframe);
    sum += (landmark.p_world - keyframe.T_world_camera.translation()).normalized();
    if (i + kMedoidSample >= count)
      descriptors.push_back(&keyframe.features->descriptors[o.keypoint]);
  }
  landmark.descriptor = *descriptors[medoid(descriptors)];
  if (sum.norm() > 1e-6) landmark.normal = sum.normalized();

  if (tag_corner_of(landmark.descriptor)) {
    landmark.min_distance = landmark.max_distance = 0;
    return;
  }
  const Observation& first = landmark.observations.front();
  const Keyframe& reference = at(first.keyframe);
  const double range = (landmark.p_world - reference.T_world_camera.translation()).norm();
  const int level = reference.features->keypoints[first.keypoint].level;
  landmark.max_distance = static_cast<float>(range * pyramid_.scale(level));
  landmark.min_distance =
      static_cast<float>(landmark.max_distance / pyramid_.scale(pyramid_.levels - 1));
}

std::vector<Covisible> Map::covisible(KeyframeId id, int min_shared) const {
  std::vector<int> shared(keyframes_.capacity(), 0);
  std::vector<KeyframeId> seen;
  for (const LandmarkId landmark_id : at(id).landmarks) {
    const Landmark* landmark = find(landmark_id);
    if (landmark == nullptr) continue;
    for (const Observation& o : landmark->observations) {
      if (o.keyframe != id && shared[o.keyframe.slot]++ == 0) seen.push_back(o.keyframe);
    }
  }
  std::vector<Covisible> result;
  for (const KeyframeId other : seen) {
    if (shared[other.slot] >= min_shared) result.push_back({other, shared[other.slot]});
  }
  std::sort(result.begin(), result.end(), [this](const Covisible& a, const Covisible& b) {
    if (a.shared != b.shared) return a.shared > b.shared;
    return at(a.keyframe).sequence < at(b.keyframe).sequence;
  });
  return result;
}

Pose Map::resolve(KeyframeId reference, const Pose& T_reference_camera) const {
  Pose T = T_reference_camera;
  while (!keyframes_.contains(reference)) {
    const Replacement& replacement = replacements_.at(reference);
    T = replacement.T_replacement_erased * T;
    reference = replacement.keyframe;
  }
  return at(reference).T_world_camera * T;
}

bool Map::is_first(KeyframeId id) const { return first_.at(at(id).component) == id; }

KeyframeId Map::current_keyframe(KeyframeId id) const {
  while (!keyframes_.contains(id)) {
    const auto replacement = replacements_.find(id);
    if (replacement == replacements_.end()) return KeyframeId{};
    id = replacement->second.keyframe;
  }
  return id;
}

std::vector<LoopEdge> Map::loops() const {
  std::vector<LoopEdge> result;
  for (const LoopEdge& loop : loops_) {
    const LoopEdge now{current_keyframe(loop.a), current_keyframe(loop.b)};
    if (now.a.valid() && now.b.valid() && now.a != now.b) result.push_back(now);
  }
  return result;
}

std::vector<std::uint32_t> Map::components() const {
  std::vector<std::uint32_t> ids;
  for (const auto& [component, keyframe] : first_) ids.push_back(component);
  return ids;
}

void Map::move_component(std::uint32_t component, const Pose& T) {
  const std::vector<KeyframeId> keyframes = keyframes_of(*this, component);
  for (const KeyframeId id : keyframes) set_pose(id, T * at(id).T_world_camera);
  for (const LandmarkId id : landmarks_seen_by(*this, keyframes)) {
    Landmark& landmark = *landmarks_.find(id);
    landmark.p_world = T * landmark.p_world;
    landmark.normal = T.quaternion() * landmark.normal;
  }
}

void Map::join_components(std::uint32_t kept, std::uint32_t absorbed) {
  for (const KeyframeId id : keyframes_of(*this, absorbed)) keyframes_.find(id)->component = kept;
  first_.erase(absorbed);
}

void Map::erase_made_in(std::uint32_t component) {
  const std::vector<KeyframeId> keyframes = keyframes_of(*this, component);
  std::size_t erased = 0;
  for (const KeyframeId id : keyframes) {
    if (at(id).session != session_) continue;
    const std::vector<LandmarkId> seen = at(id).landmarks;
    for (const LandmarkId landmark : seen) forget(landmark, id);
    keyframes_.erase(id);
    ++erased;
  }
  if (erased == keyframes.size()) first_.erase(component);
}

std::vector<KeyframeId> keyframes_of(const Map& map, std::uint32_t component) {
  std::vector<KeyframeId> ids;
  map.for_each_keyframe([&](const Keyframe& k) {
    if (k.component == component) ids.push_back(k.id);
  });
  std::sort(ids.begin(), ids.end(),
            [&](KeyframeId a, KeyframeId b) { return map.at(a).sequence < map.at(b).sequence; });
  return ids;
}

void move_keyframes(Map& map, const std::map<KeyframeId, Pose>& T_world_camera) {
  std::vector<KeyframeId> moved;
  for (const auto& [id, T] : T_world_camera) moved.push_back(id);
  const std::vector<LandmarkId> landmarks = landmarks_seen_by(map, moved);
  for (const LandmarkId id : landmarks) {
    const Landmark& landmark = map.at(id);
    const KeyframeId first = landmark.observations.front().keyframe;
    const auto to = T_world_camera.find(first);
    if (to == T_world_camera.end()) continue;
    const Pose from = map.at(first).T_world_camera;
    map.set_position(id, to->second * (from.inverse() * landmark.p_world));
  }
  for (const auto& [id, T] : T_world_camera) map.set_pose(id, T);
  for (const LandmarkId id : landmarks) map.refresh(id);
}

std::vector<LandmarkId> landmarks_seen_by(const Map& map, std::span<const KeyframeId> keyframes) {
  std::vector<LandmarkId> result;
  for (const KeyframeId id : keyframes) {
    for (const LandmarkId landmark : map.at(id).landmarks) {
      if (landmark.valid()) result.push_back(landmark);
    }
  }
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

int expected_level(const PyramidShape& pyramid, double max_distance, double range) {
  if (max_distance == 0) return 0;
  const double level = std::log(max_distance / range) / std::log(pyramid.scale_factor);
  return std::clamp(static_cast<int>(std::lround(level)), 0, pyramid.levels - 1);
}

}  // namespace stillmap
