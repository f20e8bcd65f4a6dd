// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/pipeline/map_maker.hpp"
#include "stillmap/pipeline/stage.hpp"
#include "stillmap/track/tracker.hpp"

#include <deque>
#include <memory>
#include <optional>
#include <vector>

namespace stillmap {

/// A frame that was made a keyframe.
struct NewKeyframe {
  std::size_t frame_index = 0;
  KeyframeId id;
};

/// The state of the map at a frame, as the tracker may see it.
struct MapView {
  LocalMapPtr local_map;                      ///< null while there is no map
  std::optional<RelocalizationResult> found;  ///< the place of the lost camera, if just recognized
  /// Where the keyframes around the camera stand now, if they moved as a whole; null if not.
  std::shared_ptr<const KeyframePoses> moved;
  std::vector<NewKeyframe> made;  ///< since the view before
};

/// The map's side in threads of its own: proposals go in, snapshots of the map come out; frames of
/// a lost camera go in, and where they were comes out. One thread owns the map; a second one, after
/// a loop, adjusts a copy of the whole, which the first takes in again when it is due.
class Mapping {
 public:
  /// @param map     empty, or one made before
  /// @param extend  false: the map is only looked at, and stays as it is
  Mapping(Map map, const SlamOptions& options, bool extend = true);

  /// Hands over what the map's side must know of; other frames are passed over. After a keyframe
  /// two snapshots will follow: with its landmarks, and adjusted; or, if the map is not to be
  /// extended, twice the one around the keyframe that shows most of the same. After a frame of a
  /// lost camera, or of one that goes on beside the map, unless an earlier one is still being
  /// looked for, the answer where it was.
  void push(const TrackedFramePtr& tracked);

  /// What the tracker is to use for a frame: in lockstep the newest that is due by then, waited
  /// for; in realtime the newest there is. After a proposal that begins a map its snapshot is
  /// waited for in both.
  MapView view_for(std::size_t frame_index);

  /// The tracker took up a relocalization: its snapshot is the newest.
  void accept_relocalization(const RelocalizationResult& relocalization) {
    newest_ = relocalization.local_map;
  }

  /// Waits for all that was pushed. From here on the map may be read, and nothing pushed.
  /// Returns the keyframes made since the last view.
  std::vector<NewKeyframe> drain();
  /// Drops a component, unless some of it was made before this run. After drain().
  void drop(std::uint32_t component) { maker_.drop(component); }
  /// If asked to by the options, adjusts the whole map once more. After drain().
  void finish();

  const Map& map() const { return maker_.map(); }                          ///< after drain()
  TimingRecorder timing() const;                                           ///< after drain()
  const std::vector<MapEvent>& events() const { return maker_.events(); }  ///< after drain()
  const RefineTotals& refined() const { return maker_.refined(); }         ///< after drain()

 private:
  /// An output of the map's thread: a snapshot, or the answer where a lost camera was.
  struct MapUpdate {
    LocalMapPtr local_map;                                 // null: it is an answer
    std::optional<RelocalizationResult> found = {};        // nothing: it was not recognized
    std::shared_ptr<const KeyframePoses> moved = nullptr;  // see MapView
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
  void apply_due_adjustment(std::size_t frame_index);

  void expect(std::size_t frame_index);
  std::optional<MapUpdate> next_update(std::size_t frame_index);

  const ScheduleOptions schedule_;
  const bool extend_, final_adjustment_;
  const BundleOptions bundle_;
  std::uint32_t components_started_ = 0;  // components so far

  // Of the map's thread until drain().
  MapMaker maker_;
  std::size_t adjusting_ = 0;    // bundles handed over, whose solutions have not been taken
  std::size_t adjusted_by_ = 0;  // frame from which the newest one's is to be taken in

  TimingRecorder adjust_timing_;  // of the adjuster's thread until drain()

  bool await_first_snapshot_ =
      false;                   // a map was begun, and its first snapshot has not been taken yet
  bool relocalizing_ = false;  // an answer has not been taken yet
  bool relocalization_outdated_ = false;  // a map was begun since the question was asked
  std::deque<std::size_t> due_;  // frame from which each update still to be taken is visible
  LocalMapPtr newest_;
  std::unique_ptr<AdjustStage> adjuster_;  // last: their threads use the above
  std::unique_ptr<MapStage> stage_;        // and this one the adjuster
};

}  // namespace stillmap
