// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/timing.hpp"
#include "stillmap/loop/places.hpp"
#include "stillmap/map/placement.hpp"
#include "stillmap/pipeline/options.hpp"
#include "stillmap/pipeline/stage.hpp"
#include "stillmap/refine/local_mapper.hpp"
#include "stillmap/track/tracker.hpp"

#include <deque>
#include <map>
#include <memory>

namespace stillmap {

/// What the tracker knows of the map at a frame.
struct MapView {
  LocalMapPtr local_map;           ///< null while there is no map
  std::optional<Placement> found;  ///< if an answer has come where the lost camera was
};

/// The map's side in a thread of its own: proposals go in, snapshots of the map come out; frames of
/// a lost camera go in, and where they were comes out. Owns the map.
class Mapping {
 public:
  Mapping(const Camera& camera, const PyramidShape& pyramid, const SlamOptions& options);

  /// Hands over what the map's side must know of; other frames are passed over. After a keyframe
  /// two snapshots will follow: with its landmarks, and adjusted. After a frame of a lost camera,
  /// unless an earlier one is still being looked for, the answer where it was.
  void push(const TrackedFramePtr& tracked);

  /// What the tracker is to use for a frame: in lockstep the newest that is due by then, waited
  /// for; in realtime the newest there is. After a proposal that begins a map its snapshot is
  /// waited for in both.
  MapView view_for(std::size_t frame_index);

  /// The tracker took up a placement: its snapshot is the newest.
  void take_up(const Placement& placement) { newest_ = placement.local_map; }

  /// Waits for all that was pushed and, if asked to by the options, adjusts the whole map once
  /// more. From here on the map may be read.
  void finish();

  const Map& map() const { return map_; }                   ///< after finish()
  const TimingRecorder& timing() const { return timing_; }  ///< after finish()
  std::uint32_t components() const { return components_; }
  /// The keyframe made of a frame; invalid if none was. After finish().
  KeyframeId keyframe_of(std::size_t frame_index) const;

 private:
  /// What comes out: a snapshot, or the answer where a lost camera was.
  struct News {
    LocalMapPtr local_map;           ///< null: it is an answer
    std::optional<Placement> found;  ///< nothing: it was not recognised
  };
  using MapStage = Stage<TrackedFramePtr, News>;

  void add(const KeyframeProposal& proposal, const MapStage::Publish& publish);
  void find(const FramePtr& lost, const MapStage::Publish& publish);
  void expect(std::size_t frame_index);
  std::optional<News> next_news(std::size_t frame_index);

  const ScheduleOptions schedule_;
  const bool final_adjustment_;
  const BundleOptions bundle_;
  // Of the stage's thread until finish().
  Map map_;
  LocalMapper mapper_;
  Places places_;
  TimingRecorder timing_;
  std::map<std::size_t, KeyframeId> keyframe_of_;

  std::uint32_t components_ = 0;
  bool await_first_ = false;     // a map was begun, and its first snapshot has not been taken yet
  bool seeking_ = false;         // an answer has not been taken yet
  std::deque<std::size_t> due_;  // frame from which each of the news still to be taken is visible
  LocalMapPtr newest_;
  std::unique_ptr<MapStage> stage_;  // last: its thread uses the above
};

}  // namespace stillmap
