// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/pipeline/map_maker.hpp"
#include "stillmap/pipeline/stage.hpp"
#include "stillmap/track/tracker.hpp"

#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <vector>

namespace stillmap {

/// A frame that was made a keyframe.
struct NewKeyframe {
  std::size_t frame_index = 0;
  double timestamp = 0;  ///< [s]
  KeyframeId id;
};

/// The state of the map at a frame, as the tracker may see it.
struct MapView {
  LocalMapPtr local_map;                      ///< Null while there is no map.
  std::optional<RelocalizationResult> found;  ///< the place of the lost camera, if just recognized
  /// Poses of the keyframes around the camera if they were moved; otherwise null.
  std::shared_ptr<const KeyframePoses> moved;
  std::vector<NewKeyframe> made;  ///< since the view before
};

/// Mapping in threads of its own: keyframe proposals and frames of a lost camera go in; local map
/// snapshots and relocalization results come out. One thread owns the map; a second one runs global
/// bundle adjustment on a copy, whose result the first applies when it is due.
class Mapping {
 public:
  /// @param map     empty, or loaded
  /// @param extend  false: the map is only read and stays unchanged
  Mapping(Map map, const SlamParameters& options, bool extend = true);

  /// Passes a tracked frame to mapping; frames without a task are ignored. A keyframe proposal
  /// gives two snapshots: with its landmarks, and refined; or, if the map is not extended, twice
  /// the one around the keyframe that shows most of the same landmarks. A frame of a lost camera,
  /// or one tracked by odometry, gives a relocalization result, unless an earlier request is
  /// pending.
  void push(const TrackedFramePtr& tracked);

  /// Returns the map data for a frame: in lockstep the newest that is due, waiting if necessary; in
  /// realtime the newest available. The first snapshot of a new map is waited for in both.
  MapView view_for(std::size_t frame_index);

  /// The tracker accepted a relocalization: its snapshot becomes the newest.
  void accept_relocalization(const RelocalizationResult& relocalization) {
    newest_ = relocalization.local_map;
  }

  /// Waits for all pending work. Afterwards the map may be read, and nothing may be pushed.
  /// Returns the view after the last frame.
  MapView drain();
  /// Drops a component, unless it has keyframes of an earlier session. After drain().
  void drop(std::uint32_t component);
  /// Runs the final bundle adjustment if the options request it. After drain().
  void finish();

  /// Has the map's thread read the map between two pieces of its work. May be called by any thread;
  /// the future becomes ready when `read` has returned.
  std::future<void> ask(std::function<void(const MapMaker&)> read);

  const Map& map() const { return maker_.map(); }                          ///< after drain()
  const std::vector<MapEvent>& events() const { return maker_.events(); }  ///< after drain()
  const RefineTotals& refined() const { return maker_.refined(); }         ///< after drain()

 private:
  /// An output of the map's thread: a snapshot, or the answer where a lost camera was.
  struct MapUpdate {
    LocalMapPtr local_map;                                 // Null for a relocalization result.
    std::optional<RelocalizationResult> found = {};        // Nothing if relocalization failed.
    std::shared_ptr<const KeyframePoses> moved = nullptr;  // See MapView.
    NewKeyframe made = {};                                 // invalid id: no keyframe was inserted
  };
  struct Adjusted {
    std::shared_ptr<const MapBundle> bundle;
    BundleResult result;
  };
  using BundlePtr = std::shared_ptr<const MapBundle>;
  using MapStage = Stage<TrackedFramePtr, MapUpdate>;
  using AdjustStage = Stage<BundlePtr, Adjusted>;

  void work(const TrackedFrame& tracked, const MapStage::Publish& publish);
  MapUpdate relocalization_update(const FramePtr& lost);
  void adjust(const BundlePtr& bundle, const AdjustStage::Publish& publish);
  void begin_adjustment(std::size_t frame_index);
  void change(const std::function<void()>& work);
  void apply_due_adjustment(std::size_t frame_index);

  void expect(std::size_t frame_index);
  std::optional<MapUpdate> next_update(std::size_t frame_index);

  const ScheduleOptions schedule_;
  const bool extend_, final_adjustment_;
  const BundleOptions bundle_;
  std::uint32_t components_started_ = 0;  // number of components so far

  // used by the mapping thread until drain()
  MapMaker maker_;
  std::size_t adjusting_ = 0;    // number of bundles without a received solution
  std::size_t adjusted_by_ = 0;  // frame from which the newest solution is applied

  bool await_first_snapshot_ = false;     // a new map has no snapshot yet
  bool relocalizing_ = false;             // a relocalization is pending
  bool relocalization_outdated_ = false;  // a map was started after the pending request
  std::deque<std::size_t> due_;  // frame from which each update still to be taken is visible
  LocalMapPtr newest_;
  std::unique_ptr<AdjustStage> adjuster_;  // last members: their threads use the above
  std::unique_ptr<MapStage> stage_;        // this one uses the adjuster
};

}  // namespace stillmap
