// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_map.hpp"
#include "stillmap/dense/labeled_cloud.hpp"
#include "stillmap/pipeline/instance_stream.hpp"
#include "stillmap/pipeline/mapping.hpp"
#include "stillmap/pipeline/relative_place.hpp"
#include "stillmap/pipeline/saved_map.hpp"
#include "stillmap/pipeline/saved_views.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/pipeline/stage.hpp"
#include "stillmap/track/tracker.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// Returns the moving pixels of a frame and those of movable classes, which do not belong into a
/// static map even while they are at rest: 255, height x width; empty if there are none.
cv::Mat1b mover_pixels(const Frame& frame, const std::vector<std::string>& classes);

/// Dense mapping on a thread of its own, off the tracker's critical path. Tracked frames are pushed
/// in order; keyframes and, occasionally, frames between them become views of the dense map. The
/// pose of each view is relative to a keyframe, so the view follows corrections of the map.
class DenseStream {
 public:
  /// @param extend whether frames are added; if not, the dense map is the loaded one
  /// @param loaded views of a loaded map; they get poses when the camera is localized in that map
  /// If options.dense_cloud is false, the dense map stays empty.
  DenseStream(const Camera& camera, const SlamParameters& options, bool extend,
              std::vector<AnchoredView> loaded);

  /// Sets whether the frames pushed from now on are added.
  void set_extend(bool extend) { extend_ = extend; }

  /// Adds the views of a loaded map, which get poses when the camera is localized in that map or
  /// the present map is merged into it.
  void add(std::vector<AnchoredView> loaded);

  /// Adds a frame, with the newest detections and the state of the map at that frame. Frames
  /// without a pose only pass on the poses of corrected keyframes. In lockstep every keyframe is
  /// added, so that the dense map depends on the data alone; in realtime some are skipped if the
  /// dense map falls behind the camera.
  void push(const TrackedFramePtr& tracked, const DetectedObjects& found, const MapView& map);

  /// Waits until all pushed frames are in the views.
  void wait();

  /// Waits for all pushed frames. Nothing may be pushed after it.
  /// @param made keyframes that were made after the last push()
  void finish(const std::vector<NewKeyframe>& made);

  /// Returns the current static surfaces with their classes, coarser than the final cloud, or the
  /// cloud that show() set. May be called by any thread; the future becomes ready when the dense
  /// map's thread has finished its current frame. Never null.
  std::future<std::shared_ptr<const LabeledCloud>> ask();
  /// Calls `read` on the thread of the dense map between two of its tasks, for places() and
  /// views(). May be called by any thread; the future becomes ready when `read` has returned.
  std::future<void> ask(std::function<void(const DenseStream&)> read);
  /// Sets the final cloud, which ask() returns from now on.
  void show(std::shared_ptr<const Cloud> cloud);

  /// Returns the dense map of the component in which most frames of the run are, else that with
  /// most views, with their poses in the map, after what this run saw again or through has been
  /// removed from the loaded views. Called after finish().
  /// @param frames  number of frames by component
  PlacedMap place(const Map& map, const std::map<std::uint32_t, int>& frames);
  /// Returns the views of all components, relative to keyframes numbered as in Map::content().
  /// Called in ask() or after finish().
  std::vector<AnchoredView> saved_views(const Map& map) const;

  /// Returns the id of a frame's view; views of loaded maps have smaller ids.
  static std::uint64_t view_of(std::size_t frame_index) {
    return (std::uint64_t{1} << 32) + frame_index;
  }

  // Called in ask() or after finish().
  const std::map<std::uint64_t, RelativePlace>& places() const { return places_; }
  const std::map<std::uint64_t, std::shared_ptr<DenseView>>& views() const {
    return dense_.views();
  }
  /// Returns the id of the view in which depths are still averaged; none without one.
  std::optional<std::uint64_t> open_view() const { return dense_.open_view(); }

  /// Returns the statistics of the dense map. Called after finish().
  DenseStatistics statistics() const { return dense_.statistics(); }
  /// Returns the number of frames skipped because the dense map had fallen behind.
  std::size_t frames_left_out() const { return frames_left_out_; }

 private:
  struct Task {
    TrackedFramePtr tracked;                     // null: no frame is added
    DetectedObjects found;                       // newest detections
    std::vector<NewKeyframe> made;               // keyframes made since the previous task
    std::shared_ptr<const KeyframePoses> moved;  // null: no keyframe was moved
    bool enters_world = false;                   // from now on, poses are in a new world frame
    bool may_become_view = false;                // otherwise it is only averaged
    // Views of a loaded map; shared, since tasks are copied.
    std::shared_ptr<std::vector<AnchoredView>> loaded = nullptr;
  };
  struct Nothing {};

  bool is_due(const TrackedFrame& tracked) const;
  bool wants(const TrackedFrame& tracked);
  std::shared_ptr<const KeyframePoses> poses_to_place(bool localized,
                                                      std::shared_ptr<const KeyframePoses> moved);
  void work(const Task& task);
  void add(const Task& task);
  void follow(const KeyframePoses& moved);
  void settle(const std::vector<NewKeyframe>& made);
  std::shared_ptr<const LabeledCloud> live_cloud();
  std::map<std::uint32_t, ViewPoses> poses_by_component(const Map& map) const;
  void add_loaded(std::vector<AnchoredView> views);

  Camera camera_;
  const std::size_t max_mask_age_;  // maximum age of the labels' detections [frames]
  // number of frames between two added frames that are not keyframes; 0: only keyframes are added
  const std::size_t every_;
  const bool realtime_;
  bool extend_;
  const bool fuse_;               // whether frames between the views are averaged in them
  std::size_t loaded_views_ = 0;  // number of loaded views
  std::size_t pushed_views_ = 0;  // number of frames that might become views
  std::size_t last_frame_ = 0;    // index of the last of them
  std::size_t frames_left_out_ = 0;
  std::vector<NewKeyframe> made_;  // keyframes that are not passed to the thread yet
  // While the map is not extended: keyframe poses of the component in which the camera was
  // localized, and the number of frames for which the live map still gets them, since it places
  // only some views per frame.
  std::shared_ptr<const KeyframePoses> localized_;
  std::size_t frames_to_place_ = 0;

  // Used by the stage's thread until finish().
  DenseMap dense_;
  std::uint64_t next_loaded_ = 0;  // id of the next loaded view
  /// Place of each view by its id. The keyframe is invalid until the first keyframe of a map has
  /// been made.
  std::map<std::uint64_t, RelativePlace> places_;
  std::shared_ptr<const LabeledCloud> cloud_;    // cached answer of ask(); null: out of date
  std::unique_ptr<Stage<Task, Nothing>> stage_;  // last: its thread uses the above; null: disabled
};

}  // namespace stillmap
