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
#include <string>
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
  std::optional<RelocalizationResult> found;  ///< Result of a relocalization, if one succeeded.
  std::string not_found;  ///< Reason why the newest relocalization failed; empty if it did not.
  /// Poses of the keyframes around the camera if they were moved; otherwise null.
  std::shared_ptr<const KeyframePoses> moved;
  std::vector<NewKeyframe> made;  ///< Keyframes made since the previous view.
};

/// Mapping on its own threads. Its inputs are keyframe proposals and frames of a lost camera, its
/// outputs local map snapshots and relocalization results. One thread owns the map; a second one
/// runs global bundle adjustment on a copy, and the first applies the result when it is due.
class Mapping {
 public:
  /// @param map     empty, or loaded
  /// @param extend  false: the map is only read and stays unchanged, until set_extend()
  Mapping(Map map, const SlamParameters& options, bool extend = true);

  /// Sets whether the frames pushed from now on extend the map.
  void set_extend(bool extend);

  /// Adds a saved map after all frames so far: see MapMaker::add(). Waits for the map's thread. If
  /// the present map is merged into it, the next views are of the merged one.
  /// @param frame_index  of the newest frame
  AddedMap add(MapContent content, std::size_t frame_index);

  /// Passes a tracked frame to mapping; frames without a task are ignored. A keyframe proposal
  /// gives two snapshots: with its landmarks, and refined; or, if the map is not extended, twice
  /// the one around the keyframe that shows most of the same landmarks. A frame of a lost camera,
  /// or one tracked by odometry, gives a relocalization result, unless an earlier request is
  /// pending.
  void push(const TrackedFramePtr& tracked);

  /// Returns the map data for a frame: in lockstep the newest that is due, waiting if necessary; in
  /// realtime the newest available. Both schedules wait for the first snapshot of a new map.
  MapView view_for(std::size_t frame_index);

  /// Makes the snapshot of a relocalization that the tracker accepted the newest one.
  void accept_relocalization(const RelocalizationResult& relocalization) {
    newest_ = relocalization.local_map;
  }

  /// Waits until all frames pushed are in the map.
  void wait() { stage_->drain(); }
  /// Waits for all pending work. Afterwards the map may be read, and nothing may be pushed.
  /// Returns the view after the last frame.
  MapView drain();
  /// Drops a component, unless it has keyframes of an earlier session. Called after drain().
  void drop(std::uint32_t component);
  /// Runs the final bundle adjustment if the options request it. Called after drain().
  void finish();

  /// Calls `read` on the map's thread between two of its tasks. May be called by any thread; the
  /// future becomes ready when `read` has returned.
  std::future<void> ask(std::function<void(const MapMaker&)> read);

  // The map and its history may be read after drain().
  const Map& map() const { return maker_.map(); }
  const std::vector<MapEvent>& events() const { return maker_.events(); }
  const RefineTotals& refined() const { return maker_.refined(); }
  const TextureAgreement& texture() const { return maker_.texture(); }

 private:
  /// Output of the map's thread: a snapshot, or the result of a relocalization.
  struct MapUpdate {
    LocalMapPtr local_map;                                 // Null for a relocalization result.
    std::optional<RelocalizationResult> found = {};        // Nothing if relocalization failed.
    std::string not_found = {};                            // See MapView.
    std::shared_ptr<const KeyframePoses> moved = nullptr;  // See MapView.
    NewKeyframe made = {};                                 // Invalid id if none was inserted.
  };
  struct Adjusted {
    std::shared_ptr<const MapBundle> bundle;
    BundleResult result;
  };
  using BundlePtr = std::shared_ptr<const MapBundle>;
  using MapStage = Stage<std::function<void(const std::function<void(MapUpdate)>&)>, MapUpdate>;
  using AdjustStage = Stage<BundlePtr, Adjusted>;

  void push_work(const TrackedFramePtr& tracked);
  void work(const TrackedFrame& tracked, bool extend, const MapStage::Publish& publish);
  MapUpdate relocalization_update(const FramePtr& lost);
  void adjust(const BundlePtr& bundle, const AdjustStage::Publish& publish);
  void begin_adjustment(std::size_t frame_index);
  void change(const std::function<void()>& work);
  void apply_due_adjustment(std::size_t frame_index);

  void expect(std::size_t frame_index);
  std::optional<MapUpdate> next_update(std::size_t frame_index);

  const ScheduleOptions schedule_;
  const bool final_adjustment_;
  bool extend_;    // whether frames extend the map now
  bool extended_;  // whether they ever did

  // used by the mapping thread until drain()
  MapMaker maker_;
  std::size_t adjusting_ = 0;    // number of bundles without a received solution
  std::size_t adjusted_by_ = 0;  // frame from which the newest solution is applied

  // The frame that starts a map or a part of it, while there is no snapshot with its keyframe.
  std::optional<std::size_t> awaited_;
  bool relocalizing_ = false;             // a relocalization is pending
  bool relocalization_outdated_ = false;  // a map was started after the pending request
  std::deque<std::size_t> due_;  // frame from which each update still to be taken is visible
  LocalMapPtr newest_;
  std::string not_found_;                  // see MapView
  std::unique_ptr<AdjustStage> adjuster_;  // last members: their threads use the above
  std::unique_ptr<MapStage> stage_;        // this one uses the adjuster
};

}  // namespace stillmap
