// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/features.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/geometry/smooth_depth_error.hpp"
#include "stillmap/map/slot_map.hpp"

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

namespace stillmap {

using KeyframeId = Id<struct KeyframeTag>;
using LandmarkId = Id<struct LandmarkTag>;

/// The observation of a landmark at keypoint `keypoint` of keyframe `keyframe`.
struct Observation {
  KeyframeId keyframe;
  std::uint32_t keypoint = 0;
};

/// A frame that is kept in the map with its pose and keypoints.
struct Keyframe {
  KeyframeId id;
  std::uint32_t sequence = 0;   ///< Creation order: 0, 1, 2, ...
  std::uint32_t component = 0;  ///< Component of the map that it belongs to.
  std::uint32_t session = 0;  ///< Run that created it; a saved map may be extended by another run.
  std::size_t frame_index = 0;  ///< Frame index in that run.
  double timestamp = 0;         ///< Time of the frame [s].
  Pose T_world_camera;
  FeaturesPtr features;
  /// One per keypoint: probability of being static [0..1]; 0 excludes it.
  std::vector<float> static_weight;
  /// One per keypoint: the landmark that it shows, or an invalid id.
  std::vector<LandmarkId> landmarks;
};

/// A 3D point of the static scene (map point).
struct Landmark {
  LandmarkId id;
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  ///< Position in the world frame [m].
  std::vector<Observation> observations;              ///< In creation order; never empty.
  Descriptor descriptor{};                            ///< Medoid of the observations' descriptors.
  /// Mean direction from the cameras to the point, unit length, world frame.
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  /// Distance below which its patch is larger than the finest pyramid level resolves [m].
  float min_distance = 0;
  /// Distance above which its patch is smaller than the coarsest level resolves [m]; 0: it is found
  /// at level 0 at any distance (the corner of a tag).
  float max_distance = 0;
  std::uint32_t first_sequence = 0;  ///< Keyframe::sequence of the keyframe that created it.
  std::uint32_t predicted = 1;       ///< Number of frames in which the tracker expected it in view.
  std::uint32_t found = 1;           ///< Number of frames in which the tracker matched it.
  float static_log_odds = 0;  ///< Static log-odds after all frames so far; negative: it moves.
};

/// A covisible keyframe and the number of shared landmarks.
struct Covisible {
  KeyframeId keyframe;
  int shared = 0;
};

/// The complete content of a map for saving and loading. Ids are list positions: slot i, generation
/// 0.
struct MapContent {
  Camera camera;
  PyramidShape pyramid;
  std::vector<Keyframe> keyframes;
  std::vector<Landmark> landmarks;
  DepthErrorPtr depth_error;  ///< See Map::depth_error().
  /// First keyframe of each component: see Map::is_first().
  std::map<std::uint32_t, KeyframeId> first;
};

/// Two keyframes that are connected by a closed loop or a merge.
struct LoopEdge {
  KeyframeId a, b;
};

/// The keyframe that replaces an erased one.
struct Replacement {
  KeyframeId keyframe;
  Pose T_replacement_erased;
};

/// Age of the components that are added to a map.
enum class MapAge { kOlder, kYounger };

/// Owner of all keyframes and landmarks. Synchronous, one thread at a time; other threads read
/// snapshots (LocalMap). Invariant: landmark L lists observation (K, i) exactly if keyframe K lists
/// L at keypoint i.
class Map {
 public:
  Map(const Camera& camera, const PyramidShape& pyramid) : camera_(camera), pyramid_(pyramid) {}
  /// A map from an earlier run that a new session extends. The content must satisfy the invariant.
  explicit Map(MapContent content);
  /// Returns the current content, with ids renumbered in the same order and without erased
  /// keyframes.
  MapContent content() const;

  const Camera& camera() const { return camera_; }
  const PyramidShape& pyramid() const { return pyramid_; }
  /// Error of the depth sensor that the keypoints of this session are without; null: none is known.
  /// A loaded map begins with that of its newest session.
  const DepthErrorPtr& depth_error() const { return depth_error_; }
  void set_depth_error(DepthErrorPtr error) { depth_error_ = std::move(error); }

  /// Session of the present run: see Keyframe::session.
  std::uint32_t session() const { return session_; }

  /// Adds the components of another map of the same camera and pyramid, whose content satisfies the
  /// invariant. Returns the new ids of its keyframes by their old slots.
  /// @param age  whether its components count as older or younger than those here: of two merged
  ///             components, the world frame of the older one remains
  std::vector<KeyframeId> add(MapContent content, MapAge age);
  /// Returns an unused component number, larger than all used so far.
  std::uint32_t new_component() { return next_component_++; }

  /// Adds a keyframe without landmarks and sets its id, sequence and session. Its address stays
  /// valid until it is erased.
  Keyframe& add_keyframe(Keyframe keyframe);
  /// Adds a landmark with one observation, at a keypoint that shows no landmark yet.
  Landmark& add_landmark(const Eigen::Vector3d& p_world, const Observation& observation);

  const Keyframe* find(KeyframeId id) const { return keyframes_.find(id); }
  const Landmark* find(LandmarkId id) const { return landmarks_.find(id); }
  const Keyframe& at(KeyframeId id) const;
  const Landmark& at(LandmarkId id) const;
  std::size_t keyframe_count() const { return keyframes_.size(); }
  std::size_t landmark_count() const { return landmarks_.size(); }
  template <typename F>
  void for_each_keyframe(F&& f) const {
    keyframes_.for_each(f);
  }
  template <typename F>
  void for_each_landmark(F&& f) const {
    landmarks_.for_each(f);
  }

  void set_pose(KeyframeId id, const Pose& T_world_camera);
  /// Replaces the features of a keyframe by the same keypoints, stored elsewhere or with other
  /// depths.
  void set_features(KeyframeId id, FeaturesPtr features);
  void set_position(LandmarkId id, const Eigen::Vector3d& p_world);
  /// Adds to the visibility statistics of a landmark; unknown ids are ignored.
  void count_visibility(LandmarkId id, std::uint32_t predicted, std::uint32_t found);
  /// Sets the static log-odds of a landmark; unknown ids are ignored.
  void set_static_log_odds(LandmarkId id, float log_odds);

  /// Adds an observation. Returns false and changes nothing if the keypoint already shows a
  /// landmark or the keyframe already observes this landmark.
  bool observe(LandmarkId landmark, const Observation& observation);
  /// Removes an observation; a landmark without observations is erased.
  void forget(LandmarkId landmark, KeyframeId keyframe);
  /// Merges two landmarks: `keep` takes over the observations of `drop`, which is erased. Where a
  /// keyframe observes both, the observation of `keep` stays.
  void merge(LandmarkId keep, LandmarkId drop);
  void erase(LandmarkId id);
  /// Erases a keyframe and its observations. Poses relative to it are then resolved through
  /// `replacement`: see resolve().
  void erase(KeyframeId id, KeyframeId replacement);

  /// Recomputes a landmark's descriptor, normal and distance range from its observations.
  void refresh(LandmarkId id);

  /// Returns the keyframes that share at least `min_shared` landmarks with `id`, by descending
  /// number, ties by sequence.
  std::vector<Covisible> covisible(KeyframeId id, int min_shared = 1) const;

  /// Records that a loop closure or a merge connects two keyframes.
  void add_loop(KeyframeId a, KeyframeId b) { loops_.push_back({a, b}); }
  /// Returns all recorded loops, with erased keyframes replaced: see current_keyframe().
  std::vector<LoopEdge> loops() const;

  /// Returns the ids of all components, sorted.
  std::vector<std::uint32_t> components() const;
  /// Applies T to all poses and landmarks of a component: p becomes T * p.
  void move_component(std::uint32_t component, const Pose& T);
  /// Assigns the keyframes of component `absorbed` to component `kept` without moving them.
  void join_components(std::uint32_t kept, std::uint32_t absorbed);
  /// Erases the keyframes of a component that the present run made, without replacements, and the
  /// landmarks that only they show. What a saved map had in the component stays.
  void erase_made_in(std::uint32_t component);

  /// Returns T_world_camera of a pose that is given relative to a keyframe. Works for erased
  /// keyframes, but not for those without a replacement.
  Pose resolve(KeyframeId reference, const Pose& T_reference_camera) const;
  /// Returns the first keyframe of a component, which defines the component's world frame. It may
  /// have been erased.
  KeyframeId first_of(std::uint32_t component) const { return first_.at(component); }
  /// Returns whether it is the first keyframe of its component.
  bool is_first(KeyframeId id) const;
  /// Returns the keyframe that represents `id` now: itself, or its replacement if it was erased;
  /// invalid if it has none.
  KeyframeId current_keyframe(KeyframeId id) const;
  /// Returns the replacements of erased keyframes, which may be erased themselves.
  const std::map<KeyframeId, Replacement>& replacements() const { return replacements_; }

 private:
  void shift_components(std::uint32_t by);
  std::uint32_t end_of_sessions() const;

  Camera camera_;
  PyramidShape pyramid_;
  DepthErrorPtr depth_error_;
  SlotMap<KeyframeTag, Keyframe> keyframes_;
  SlotMap<LandmarkTag, Landmark> landmarks_;
  std::uint32_t next_sequence_ = 0;
  std::uint32_t next_component_ = 0;
  std::uint32_t session_ = 0;
  std::map<KeyframeId, Replacement> replacements_;  // by erased keyframe
  std::map<std::uint32_t, KeyframeId> first_;       // by component
  std::vector<LoopEdge> loops_;                     // in the order they were closed
};

/// Returns the keyframes of a component in creation order.
std::vector<KeyframeId> keyframes_of(const Map& map, std::uint32_t component);

/// Sets new keyframe poses. A landmark moves with the first keyframe that observed it.
void move_keyframes(Map& map, const std::map<KeyframeId, Pose>& T_world_camera);

/// Returns the landmarks that any of the keyframes observes, each once, sorted by id.
std::vector<LandmarkId> landmarks_seen_by(const Map& map, std::span<const KeyframeId> keyframes);

/// Returns the pyramid level at which a landmark's patch appears at distance `range` [m], if it
/// appears at level 0 at `max_distance` [m]; 0 if that is 0.
int expected_level(const PyramidShape& pyramid, double max_distance, double range);

}  // namespace stillmap
