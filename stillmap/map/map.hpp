// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/features.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
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

/// "Keypoint `keypoint` of keyframe `keyframe` shows it."
struct Observation {
  KeyframeId keyframe;
  std::uint32_t keypoint = 0;
};

/// A frame kept for good: what it saw, and from where.
struct Keyframe {
  KeyframeId id;
  std::uint32_t sequence = 0;   ///< 0, 1, 2 ... in the order of their making
  std::uint32_t component = 0;  ///< which of the unconnected maps it belongs to
  std::uint32_t session = 0;    ///< the run that made it: a saved map may be extended by another
  std::size_t frame_index = 0;  ///< in that run
  double timestamp = 0;         ///< seconds
  Pose T_world_camera;
  FeaturesPtr features;
  std::vector<float> static_weight;  ///< per keypoint: probability of being static, 0 = left out
  std::vector<LandmarkId>
      landmarks;  ///< per keypoint: what it shows; invalid where nothing is known
};

/// A point of the static world (map point).
struct Landmark {
  LandmarkId id;
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  ///< meters
  std::vector<Observation> observations;              ///< in the order they were made; never empty
  Descriptor
      descriptor{};  ///< of the observations' descriptors the one nearest to all others (medoid)
  Eigen::Vector3d normal =
      Eigen::Vector3d::UnitZ();  ///< mean direction from cameras to point, unit length
  float min_distance = 0;  ///< meters: closer, its patch is larger than the finest level shows
  float max_distance = 0;  ///< meters: farther, it is smaller than the coarsest level shows
  std::uint32_t first_sequence = 0;  ///< Keyframe::sequence of its maker
  std::uint32_t predicted = 1;       ///< frames in which the tracker expected to see it
  std::uint32_t found = 1;           ///< frames in which the tracker did see it
  float static_log_odds = 0;  ///< of its being static, by all frames so far; below 0: it moves
};

/// A keyframe that shares landmarks with another one, and how many.
struct Covisible {
  KeyframeId keyframe;
  int shared = 0;
};

/// All that makes a map, to be written or read. Ids say where in the lists something stands: slot
/// i, generation 0.
struct MapContent {
  Camera camera;
  PyramidShape pyramid;
  std::vector<Keyframe> keyframes;
  std::vector<Landmark> landmarks;
  std::map<std::uint32_t, KeyframeId> first;  ///< of each component: see Map::is_first()
};

/// Two keyframes that saw one place, between which the way was long.
struct LoopEdge {
  KeyframeId a, b;
};

/// The one owner of keyframes and landmarks. Synchronous, one thread at a time; other threads get
/// snapshots (LocalMap). Invariant: landmark L lists observation (K, i) exactly if keyframe K lists
/// L at keypoint i.
class Map {
 public:
  Map(const Camera& camera, const PyramidShape& pyramid) : camera_(camera), pyramid_(pyramid) {}
  /// A map made before, to be extended in a new session. The content must keep the invariant.
  explicit Map(MapContent content);
  /// What it holds now, ids numbered anew in the same order; erased keyframes are forgotten.
  MapContent content() const;

  const Camera& camera() const { return camera_; }
  const PyramidShape& pyramid() const { return pyramid_; }
  /// The present run's, see Keyframe::session.
  std::uint32_t session() const { return session_; }

  /// Adds a keyframe without landmarks; id, sequence and session are given to it. Addresses stay
  /// valid until erased.
  Keyframe& add_keyframe(Keyframe keyframe);
  /// Adds a landmark seen at one keypoint (that shows nothing yet).
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
  void set_position(LandmarkId id, const Eigen::Vector3d& p_world);
  /// Adds to the tracker's statistics of a landmark; unknown ids are passed over.
  void count_visibility(LandmarkId id, std::uint32_t predicted, std::uint32_t found);
  /// What the frames so far say of its being static; an unknown id is passed over.
  void set_static_log_odds(LandmarkId id, float log_odds);

  /// Notes that a keypoint shows a landmark. False, and nothing done, if the keypoint shows
  /// something already or the keyframe sees the landmark elsewhere.
  bool observe(LandmarkId landmark, const Observation& observation);
  /// Takes an observation back; a landmark without any is erased.
  void forget(LandmarkId landmark, KeyframeId keyframe);
  /// Makes two landmarks one: `keep` takes over the observations of `drop` (where a keyframe has
  /// both, its own stays), which is erased.
  void merge(LandmarkId keep, LandmarkId drop);
  void erase(LandmarkId id);
  /// Erases a keyframe and its observations. Frames that refer to it are henceforth placed relative
  /// to `replacement`: see resolve().
  void erase(KeyframeId id, KeyframeId replacement);

  /// Recomputes a landmark's descriptor, normal and distance range from its observations.
  void refresh(LandmarkId id);

  /// The keyframes that share at least `min_shared` landmarks with `id`, most first, ties by
  /// sequence.
  std::vector<Covisible> covisible(KeyframeId id, int min_shared = 1) const;

  /// Notes that a loop was closed, or two components joined, between two keyframes.
  void add_loop(KeyframeId a, KeyframeId b) { loops_.push_back({a, b}); }
  /// The loops closed so far, between current_keyframe keyframes: where one was erased its
  /// replacement stands in.
  std::vector<LoopEdge> loops() const;

  /// Ids of the components there are, sorted.
  std::vector<std::uint32_t> components() const;
  /// Moves a component as a whole: what was at p is at T p.
  void move_component(std::uint32_t component, const Pose& T);
  /// Makes the keyframes of component `absorbed` some of component `kept`, where they are.
  void join_components(std::uint32_t kept, std::uint32_t absorbed);
  /// Erases a component with all that it holds. Its keyframes have no heirs.
  void erase_component(std::uint32_t component);

  /// A pose given relative to a keyframe, in the world as it is now; works for erased keyframes
  /// too, but not for those of an erased component.
  Pose resolve(KeyframeId reference, const Pose& T_reference_camera) const;
  /// Whether it is the first keyframe of its component, which holds the component's place in the
  /// world.
  bool is_first(KeyframeId id) const;
  /// The current_keyframe keyframe that stands in for `id` (itself while it lives); invalid if its
  /// component was erased.
  KeyframeId current_keyframe(KeyframeId id) const;

 private:
  struct Replacement {
    KeyframeId keyframe;
    Pose T_replacement_erased;
  };

  Camera camera_;
  PyramidShape pyramid_;
  SlotMap<KeyframeTag, Keyframe> keyframes_;
  SlotMap<LandmarkTag, Landmark> landmarks_;
  std::uint32_t next_sequence_ = 0;
  std::uint32_t session_ = 0;
  std::map<KeyframeId, Replacement> replacements_;  // of erased keyframes
  std::map<std::uint32_t, KeyframeId> first_;       // by component
  std::vector<LoopEdge> loops_;                     // in the order they were closed
};

/// The keyframes of a component, in the order of their making.
std::vector<KeyframeId> keyframes_of(const Map& map, std::uint32_t component);

/// The number that no keyframe's component has reached yet: one more than the largest.
std::uint32_t next_component(const Map& map);

/// Gives keyframes new poses. A landmark moves along with the keyframe that saw it first.
void move_keyframes(Map& map, const std::map<KeyframeId, Pose>& T_world_camera);

/// The landmarks that any of the keyframes sees, each once, sorted by id.
std::vector<LandmarkId> landmarks_seen_by(const Map& map, std::span<const KeyframeId> keyframes);

/// The pyramid level on which a landmark's patch appears at distance `range` (meters) if it fits
/// level 0 at `max_distance`.
int expected_level(const PyramidShape& pyramid, double max_distance, double range);

}  // namespace stillmap
