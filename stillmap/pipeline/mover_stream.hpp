// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/mover_tracker.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/pipeline/stage.hpp"
#include "stillmap/track/tracker.hpp"

#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <vector>

namespace stillmap {

/// What was left out on the way to the tracks, over all frames.
struct MoverStatistics {
  std::size_t detections = 0;
  std::size_t too_small = 0;      ///< regions smaller than a mover must be
  std::size_t without_depth = 0;  ///< regions of which nearly no pixel has a depth
};

/// The movers' detection and tracking in a thread of its own, beside the camera's critical path.
/// Tracked frames go in, in their order; in lockstep each is worked on, so that the tracks depend
/// on the data alone; in realtime some are passed over where the movers fall behind the camera.
class MoverStream {
 public:
  MoverStream(const MoverOptions& options, bool realtime);

  /// Hands over a frame. Those without a pose are passed over; one that begins a map, or in which
  /// the camera was recognized after it was lost, ends all tracks, as its world may be another.
  void push(const TrackedFramePtr& tracked);

  /// The movers at the newest frame worked on, by id.
  /// @param wait whether to wait until that is the frame pushed last
  std::vector<Mover> newest(bool wait);

  /// Returns the movers at the newest frame worked on, by id. May be called by any thread; the
  /// answer comes when the movers' thread has finished its present frame.
  std::future<std::vector<Mover>> ask() const;

  /// Frames that came too fast, and were not worked on.
  std::size_t passed_over() const { return passed_over_; }

  void finish();
  /// After finish(): all tracks, see MoverTracker::tracks().
  std::vector<MoverTrack> tracks(
      const std::function<std::optional<Pose>(std::size_t frame_index)>& pose_of) const;
  const MoverStatistics& statistics() const { return statistics_; }  ///< after finish()

 private:
  std::vector<Mover> work(const TrackedFrame& tracked);

  const bool realtime_;
  std::vector<Mover> newest_;
  std::size_t passed_over_ = 0;
  // Of the stage's thread until finish().
  MoverDetector detector_;
  MoverTracker tracker_;
  MoverStatistics statistics_;
  std::unique_ptr<Stage<TrackedFramePtr, std::vector<Mover>>>
      stage_;  // last: its thread uses the above; null: nothing is to be done
};

}  // namespace stillmap
