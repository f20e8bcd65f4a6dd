// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/timing.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/pipeline/dense_stream.hpp"
#include "stillmap/pipeline/instance_stream.hpp"
#include "stillmap/pipeline/keypoint_budget.hpp"
#include "stillmap/pipeline/mapping.hpp"
#include "stillmap/pipeline/mover_stream.hpp"
#include "stillmap/pipeline/options.hpp"
#include "stillmap/pipeline/saved_map.hpp"
#include "stillmap/track/tracker.hpp"

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// What became of one frame, kept for the whole run: small.
struct FrameRecord {
  std::size_t index = 0;
  double timestamp = 0;  ///< seconds
  TrackState state = TrackState::kWaiting;
  std::string reason;  ///< where there is no pose
  KeyframeId reference;
  Pose T_reference_camera;
  int keypoints = 0;
  int moving_keypoints = 0;  ///< left out because they move
  int inliers = 0;           ///< landmarks that agree with the pose
  int mask_age = -1;  ///< frames since the network saw what the masks show; -1: there were none
  bool relocalized = false;          ///< the camera was lost, and its place was recognized
  bool tracked_by_odometry = false;  ///< see TrackedFrame::tracked_by_odometry
  bool keyframe = false;
  double milliseconds =
      0;  ///< of work on the camera's critical path: features, masks carried, motion, pose

  bool has_pose() const { return state == TrackState::kStarted || state == TrackState::kTracking; }
};

/// What was done less of, so that tracking kept up with a camera that does not wait: first the
/// network sees fewer frames, and movers are looked for in fewer; then there are fewer keypoints;
/// and at last frames are dropped, by their source. Nothing in lockstep.
struct LoadShedding {
  std::size_t frames_without_movers = 0;      ///< frames in which no movers were looked for
  std::size_t frames_without_view = 0;        ///< keyframes that the dense map was not shown
  std::size_t frames_of_fewer_keypoints = 0;  ///< frames that had to do with fewer keypoints
  int fewest_keypoints = 0;                   ///< that were wanted of a frame
};

/// All that a run yields.
struct SlamResult {
  Trajectory
      trajectory;  ///< every frame with a pose, T_world_camera, in the map as it is at the end
  Trajectory keyframes;  ///< of this run, those still in the map
  ComposedCloud dense;   ///< static colored cloud and the things in it, world frame
  PlacedMap placed;      ///< what the cloud was made of, for meshes and grids
  DenseStatistics dense_statistics;
  /// What moved, by id, in the trajectory's world; see MoverTracker.
  std::vector<MoverTrack> movers;
  MoverStatistics mover_statistics;
  std::vector<FrameRecord> frames;  ///< every frame pushed
  TimingRecorder timing;            ///< milliseconds per stage
  std::size_t landmarks = 0;
  std::size_t maps =
      0;  ///< unconnected maps; more than one means that tracking was lost in between
  std::vector<MapEvent> events;  ///< loops closed, maps joined and dropped, in this order
  RefineTotals refined;          ///< what keeping the map good took
  std::size_t segmented = 0;     ///< frames the network saw
  LoadShedding load_shedding;
  std::size_t tracked() const { return trajectory.size(); }
};

/// A map made before, to begin in.
struct StartingMap {
  SavedMap saved;
  bool extend = true;  ///< false: the camera is only found in it, and the map stays as it is
};

/// The façade: frames in, poses out, and at the end everything else.
///
///     Slam slam(source.camera(), options, make_detector(options.segment));
///     while (auto frame = source.next()) slam.push(frame);
///     SlamResult result = slam.finish();
///
/// Threads work behind it (network, mapper, dense map); the object itself is for one thread.
class Slam {
 public:
  /// @param detector what finds instances; null for none
  /// @param start    a map to begin in: the camera counts as lost until its place is recognized
  /// Throws Error for options that make no sense, and for a map of another camera.
  Slam(const Camera& camera, const SlamOptions& options,
       std::unique_ptr<Detector> detector = nullptr,
       std::optional<StartingMap> start = std::nullopt);
  ~Slam();

  /// The next frame, indices and stamps rising. T_world_camera as known now; none while there is no
  /// map or the camera is lost. Throws Error if the frame's size is not the camera's.
  std::optional<Pose> push(const RgbdFramePtr& frame);

  /// The frame pushed last, as the tracker saw it; null before the first.
  const TrackedFramePtr& newest() const { return newest_; }

  /// What moves, by id, as known now and in the world as it is now. In lockstep at the frame pushed
  /// last; in realtime at the newest that was worked on.
  std::vector<Mover> movers() { return movers_.newest(!options_.schedule.realtime()); }

  /// Waits for all threads, adjusts the map once more, and collects the results. Call once; no push
  /// after it.
  SlamResult finish();

  /// The whole map, to be saved; one begun in included. After finish().
  /// @param writer  the program, with its version
  SavedMap saved_map(const std::string& writer) const;

 private:
  void check(const RgbdFrame& frame) const;
  void shed_load(const RgbdFrame& image, double busy);
  void record(const TrackedFrame& tracked, double milliseconds);
  void record(const RelocalizationResult& confirmed);
  std::optional<Pose> final_pose(const FrameRecord& record) const;
  void record(const std::vector<NewKeyframe>& made);
  bool is_placed(const FrameRecord& record) const;
  void drop_brief_maps();

  const SlamOptions options_;
  const Camera camera_;
  const bool extend_;
  OrbExtractor extractor_;
  KeypointBudget keypoint_budget_;
  LoadShedding load_shedding_;
  MotionEstimator motion_;
  Tracker tracker_;
  InstanceStream instances_;
  Mapping mapping_;
  DenseStream dense_;
  MoverStream movers_;
  TrackedFramePtr newest_;
  std::vector<FrameRecord> records_;
  TimingRecorder timing_;
};

}  // namespace stillmap
