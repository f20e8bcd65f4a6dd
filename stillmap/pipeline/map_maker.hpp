// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/timing.hpp"
#include "stillmap/loop/places.hpp"
#include "stillmap/map/relocalization_result.hpp"
#include "stillmap/pipeline/options.hpp"
#include "stillmap/refine/global_adjustment.hpp"
#include "stillmap/refine/local_mapper.hpp"

#include <map>
#include <memory>
#include <optional>
#include <vector>

namespace stillmap {

/// Something that happened to the map as a whole.
struct MapEvent {
  enum class Kind {
    kLoop,     ///< a loop was closed
    kMerge,    ///< two maps were joined
    kDropped,  ///< a map was dropped, since it had held the camera too briefly
  };
  Kind kind = Kind::kLoop;
  std::size_t frame_index = 0;     ///< of the keyframe at which it happened, or that began the map
  double timestamp = 0;            ///< of the same [s]
  std::size_t seen_in = 0;         ///< frame index of the keyframe that showed the place before
  int inliers = 0;                 ///< landmarks that agree with the match
  int fused = 0;                   ///< landmarks merged, and observations gained
  double meters = 0, radians = 0;  ///< by which the camera was moved
  std::size_t keyframes = 0;       ///< of the map then
  double graph_ms = 0;             ///< spent on the pose graph [ms]
  double milliseconds = 0;         ///< in all, without the adjustment of the whole map
};

/// T_world_camera of the keyframes of a component, by id; those included that were erased since.
using KeyframePoses = std::map<KeyframeId, Pose>;

/// The owner of the map, and the order of what is done to it; synchronous, for one thread.
class MapMaker {
 public:
  /// @param map  empty, or one made before
  MapMaker(Map map, const SlamOptions& options);

  /// Adds a keyframe with its landmarks. What the tracker may see of the map then.
  LocalMapPtr insert(const KeyframeProposal& proposal);

  /// Makes the map good around the keyframe inserted last; if its place was seen before, closes the
  /// loop or joins the maps. What the tracker may see of the map then.
  /// @param hurry  ends the local adjustment early
  LocalMapPtr refine(const StopRequest& hurry);

  /// What the tracker may see of a map that is not to be extended: around the keyframe that shows
  /// most of the proposal's landmarks.
  LocalMapPtr snapshot_for(const KeyframeProposal& proposal) const;

  /// Where a frame of a lost camera was.
  std::optional<RelocalizationResult> find(const FramePtr& lost);

  /// After a loop was closed or maps were joined: the whole component, to be adjusted elsewhere;
  /// once, else null. One taken earlier is out of date then.
  std::shared_ptr<const MapBundle> take_pending_global_ba();
  /// Takes in what came of it.
  void apply_global_ba(const MapBundle& bundle, const BundleResult& result);

  /// Where the keyframes of a keyframe's component stand.
  KeyframePoses poses_around(KeyframeId keyframe) const;
  /// The same around the keyframe inserted last, if they moved as a whole since last asked: a loop
  /// was closed, maps were joined, or an adjustment of the whole was taken in. Else null.
  std::shared_ptr<const KeyframePoses> take_moved();

  /// Joins what is still apart, the younger of two maps to the older, where any of its keyframes
  /// shows a place of the other; for the end of a run.
  void merge_remaining();

  /// Drops a component, unless some of it was made before this run.
  void drop(std::uint32_t component);
  /// Adjusts every component once more.
  void adjust_all(const BundleOptions& options);

  const Map& map() const { return map_; }
  const TimingRecorder& timing() const { return timing_; }
  const std::vector<MapEvent>& events() const { return events_; }
  const RefineTotals& refined() const { return refined_; }
  /// Returns the keyframe inserted last; invalid before the first.
  KeyframeId newest() const { return newest_; }

 private:
  void index_keyframe(KeyframeId keyframe);
  void close(const LoopMatch& match);
  LoopCorrection join(const LoopMatch& match);

  const MapperOptions options_;
  const LoopCorrectionOptions correction_;
  Map map_;
  LocalMapper mapper_;
  Places places_;
  KeyframeId newest_;
  bool moved_ = false;  // see take_moved()
  std::optional<std::uint32_t>
      pending_global_ba_;         // component that waits to be adjusted as a whole
  std::vector<KeyframeId> made_;  // in this run, those included that were erased since
  std::vector<MapEvent> events_;
  RefineTotals refined_;
  TimingRecorder timing_;
};

}  // namespace stillmap
