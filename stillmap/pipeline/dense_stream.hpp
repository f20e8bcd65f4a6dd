// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_map.hpp"
#include "stillmap/pipeline/instance_stream.hpp"
#include "stillmap/pipeline/mapping.hpp"
#include "stillmap/pipeline/saved_map.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/pipeline/stage.hpp"
#include "stillmap/track/tracker.hpp"

#include <cstddef>
#include <cstdint>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <vector>

namespace stillmap {

/// The dense map in a thread of its own, beside the camera's critical path. Tracked frames go in,
/// in their order; keyframes and, now and then, a frame between them become views of the dense map.
/// Each view stands relative to a keyframe, so it follows when the map is corrected.
class DenseStream {
 public:
  /// @param enabled whether frames are added; without it the dense map stays empty
  /// @param loaded  views of a map made before; they get poses when the camera is found in that map
  DenseStream(const Camera& camera, const SlamParameters& options, bool enabled,
              std::vector<AnchoredView> loaded);

  /// Hands over a frame, with the objects that the detector found last and the state of the map at
  /// that frame. Frames without a pose only tell what has moved. In lockstep every keyframe is
  /// added, so that the dense map depends on the data alone; in realtime some are left out where
  /// the dense map falls behind the camera.
  void push(const TrackedFramePtr& tracked, const DetectedObjects& found, const MapView& map);

  /// Waits for all that was pushed. Nothing may be pushed after it.
  /// @param made keyframes that push() was not told of
  void finish(const std::vector<NewKeyframe>& made);

  /// Returns the static surfaces as they are known now, coarser than the final cloud; or the cloud
  /// that show() was given. May be called by any thread; the answer comes when the dense map's
  /// thread has finished its present frame. Never null.
  std::future<std::shared_ptr<const Cloud>> ask();
  /// From here on ask() returns this cloud: the final one.
  void show(std::shared_ptr<const Cloud> cloud);

  /// The views of the largest of the unconnected maps, put together where the map says they are.
  /// After finish().
  PlacedMap place(const Map& map);
  /// The views of all maps, relative to the keyframes as Map::content() numbers them. After
  /// finish().
  std::vector<AnchoredView> saved_views(const Map& map) const;

  DenseStatistics statistics() const { return dense_.statistics(); }  ///< after finish()
  /// Returns the number of frames left out because the dense map had fallen behind.
  std::size_t frames_left_out() const { return frames_left_out_; }

 private:
  struct ViewPlace {
    KeyframeId keyframe;  // invalid until the keyframe that begins a map has been made
    Pose T_keyframe_view;
  };
  struct Task {
    TrackedFramePtr tracked;                     // null: no frame to be added
    DetectedObjects found;                       // see push()
    std::vector<NewKeyframe> made;               // since the task before
    std::shared_ptr<const KeyframePoses> moved;  // null: no keyframe has moved
  };
  struct Nothing {};

  bool wants(const TrackedFrame& tracked);
  void work(const Task& task);
  void add(const TrackedFrame& tracked, const DetectedObjects& found);
  void follow(const KeyframePoses& moved);
  void settle(const std::vector<NewKeyframe>& made);
  std::shared_ptr<const Cloud> live_cloud();
  std::uint64_t view_of(std::size_t frame_index) const { return loaded_views_ + frame_index; }
  std::optional<ViewPlace> place_in(const Map& map, std::uint64_t view) const;

  const PropagationOptions propagation_;
  const std::size_t every_;  // frames between two that are no keyframes; 0: none of these is added
  const bool realtime_;
  std::size_t loaded_views_ = 0;  // have the first ids in the dense map, frames follow
  std::size_t last_frame_ = 0;    // added last
  std::size_t frames_left_out_ = 0;
  std::vector<NewKeyframe> made_;  // not handed to the thread yet

  // Of the stage's thread until finish().
  DenseMap dense_;
  std::map<std::uint64_t, ViewPlace> places_;    // of all views
  std::shared_ptr<const Cloud> cloud_;           // made for ask(); null: the map has changed since
  std::unique_ptr<Stage<Task, Nothing>> stage_;  // last: its thread uses the above; null: disabled
};

}  // namespace stillmap
