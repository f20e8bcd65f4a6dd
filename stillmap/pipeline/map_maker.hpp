// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/loop/places.hpp"
#include "stillmap/map/keyframe_pager.hpp"
#include "stillmap/map/relocalization_result.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/refine/global_adjustment.hpp"
#include "stillmap/refine/local_mapper.hpp"
#include "stillmap/slam.hpp"

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// T_world_camera of the keyframes of a component, by id, including erased ones.
using KeyframePoses = std::map<KeyframeId, Pose>;

/// A keyframe that was erased because another one was made of the same frame.
struct RepeatedKeyframe {
  KeyframeId erased, kept;
};

/// A saved map that was added to the map of a run.
struct AddedMap {
  std::vector<KeyframeId> keyframes;  ///< Ids of its keyframes by their slots in the saved map.
  std::vector<RepeatedKeyframe> repeated;  ///< Keyframes that were in the map of the run already.
  /// The local map snapshot of the camera, if its component was merged into the added map.
  LocalMapPtr local_map;
  std::string not_found;  ///< Why it was not; empty if it was.
};

/// Owner of the map, which orders all changes; synchronous, for one thread.
class MapMaker {
 public:
  /// @param map  empty, or loaded
  MapMaker(Map map, const SlamParameters& options);

  /// Adds a keyframe with its landmarks. Returns the new local map snapshot.
  LocalMapPtr insert(const KeyframeProposal& proposal);

  /// Adds a saved map, whose components count as older than those here, and merges these into it if
  /// any keyframe shows a place of it.
  /// @param here  the reference keyframe of the camera; invalid before the first
  AddedMap add(MapContent content, KeyframeId here);

  /// Refines the map around the last inserted keyframe; if its place is recognized, closes the loop
  /// or merges the components. Returns the new local map snapshot.
  /// @param hurry  ends the local bundle adjustment early
  LocalMapPtr refine(const StopRequest& hurry);

  /// Returns the local map snapshot of a map that is not extended: around the keyframe that shows
  /// most of the proposal's landmarks.
  LocalMapPtr snapshot_for(const KeyframeProposal& proposal);

  /// Relocalizes a frame of a lost camera. Returns none if its place is not found.
  /// @param reason  set to the reason, or to an empty text
  std::optional<RelocalizationResult> find(const FramePtr& lost, std::string& reason);

  /// Returns the bundle of the whole component for global bundle adjustment after a loop closure or
  /// merge, once; otherwise null. It invalidates earlier bundles.
  std::shared_ptr<const MapBundle> take_pending_global_ba();
  /// Applies the result of global bundle adjustment.
  void apply_global_ba(const MapBundle& bundle, const BundleResult& result);

  /// Returns the poses of the keyframe's component.
  KeyframePoses poses_around(KeyframeId keyframe) const;
  /// Returns the poses around the last inserted keyframe if its component was moved since the last
  /// call (loop closure, merge, or global bundle adjustment); otherwise null.
  std::shared_ptr<const KeyframePoses> take_moved();

  /// Merges components that are still separate, the younger into the older, if any keyframe shows a
  /// place of the other.
  void merge_remaining();

  /// Connects the components of several saved maps: see merge_maps(). A component is adjusted
  /// whenever it has twice as many keyframes as at its last adjustment, since landmarks are welded
  /// only where their projections agree within pixels. Where places of components that are already
  /// connected are recognized, loops are closed. Returns all comparisons.
  std::vector<PlaceComparison> merge_all();
  /// Erases the keyframes of connected maps that have the time and the features of another one,
  /// which replaces them: one of `kept`, or else the first in the map.
  std::vector<RepeatedKeyframe> erase_repeated_keyframes(const std::vector<KeyframeId>& kept = {});
  /// Erases redundant keyframes: see cull_keyframes(). Returns their number.
  std::size_t erase_redundant_keyframes();

  /// Drops a component, unless it has keyframes of an earlier session.
  void drop(std::uint32_t component);
  /// Runs bundle adjustment on every component.
  void adjust_all();

  const Map& map() const { return map_; }
  const std::vector<MapEvent>& events() const { return events_; }
  const RefineTotals& refined() const { return refined_; }
  /// Returns the agreement of all proposed keyframes with the map of earlier sessions.
  const TextureAgreement& texture() const { return texture_; }
  /// Returns the keyframe inserted last; invalid before the first.
  KeyframeId newest() const { return newest_; }

 private:
  void index_keyframe(KeyframeId keyframe);
  void close(const LoopMatch& match);
  LoopCorrection join(const LoopMatch& match);
  LocalMapPtr snapshot_around(KeyframeId reference);
  void compare_texture(const KeyframeProposal& proposal);
  void check_depths();
  void remove_depth_error(const SmoothDepthError& error);

  const MapperOptions options_;
  Map map_;
  LocalMapper mapper_;
  Places places_;
  KeyframePager pager_;
  KeyframeId newest_;
  bool moved_ = false;  // see take_moved()
  // component that waits for global bundle adjustment
  std::optional<std::uint32_t> pending_global_ba_;
  bool adjusting_ = false;            // a bundle was taken that is not applied yet
  std::size_t next_depth_check_ = 3;  // number of keyframes: see check_depths()
  std::vector<KeyframeId> made_;      // in this run, those included that were erased since
  std::vector<MapEvent> events_;
  RefineTotals refined_;
  TextureAgreement texture_;
};

}  // namespace stillmap
