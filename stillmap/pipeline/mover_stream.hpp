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

/// Number of detected and rejected regions over all frames.
struct MoverStatistics {
  std::size_t detections = 0;     ///< Number of detected movers.
  std::size_t too_small = 0;      ///< Number of regions smaller than the smallest mover.
  std::size_t without_depth = 0;  ///< Number of regions with hardly any depth.
};

/// Detection and tracking of movers on a thread of its own, off the tracker's critical path.
/// Tracked frames are pushed in order. In lockstep each is processed, so that the tracks depend on
/// the data alone; in realtime some are skipped if the movers fall behind the camera.
class MoverStream {
 public:
  MoverStream(const MoverOptions& options, bool realtime);

  /// Adds a frame. Frames without a pose are ignored. A frame that starts a map, or in which the
  /// camera was relocalized, ends all tracks, since its world may be another one.
  void push(const TrackedFramePtr& tracked);

  /// Returns the movers at the newest processed frame, in order of their ids.
  /// @param wait waits until the frame pushed last is processed
  std::vector<Mover> newest(bool wait);
  /// Returns the time of the frame of the movers that newest() returned last [s]; none before the
  /// first.
  std::optional<double> newest_time() const { return newest_time_; }

  /// Returns the movers at the newest processed frame, in order of their ids. May be called by any
  /// thread; the future becomes ready when the movers' thread has finished its current frame.
  std::future<std::vector<Mover>> ask() const;
  /// Calls `read` on the movers' thread between two frames, as DenseStream::ask() does.
  std::future<void> ask(std::function<void(const MoverTracker&)> read) const;

  /// Returns the number of frames skipped because the movers had fallen behind.
  std::size_t frames_skipped() const { return frames_skipped_; }

  /// Waits for all pushed frames. Nothing may be pushed after it.
  void finish();
  /// Returns the tracks of the run by id, one per object; see MoverTracker::tracks() and
  /// joined_movers(). Called after finish().
  std::vector<MoverTrack> tracks(
      const std::function<std::optional<Pose>(std::size_t frame_index)>& pose_of) const;
  /// Returns the statistics of the run. Called after finish().
  const MoverStatistics& statistics() const { return statistics_; }

 private:
  struct MoversAtTime {
    double timestamp = 0;  // [s]
    std::vector<Mover> movers;
  };
  std::vector<Mover> work(const TrackedFrame& tracked);

  const bool realtime_;
  std::vector<Mover> newest_;
  std::optional<double> newest_time_;
  std::size_t frames_skipped_ = 0;
  // Used by the stage's thread until finish().
  MoverDetector detector_;
  MoverTracker tracker_;
  Pose T_odometry_world_;  // of the frame before
  MoverStatistics statistics_;
  // last: its thread uses the above; null: movers are disabled
  std::unique_ptr<Stage<TrackedFramePtr, MoversAtTime>> stage_;
};

}  // namespace stillmap
