// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/stage_times.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/pipeline/camera_check.hpp"
#include "stillmap/pipeline/dense_stream.hpp"
#include "stillmap/pipeline/frame_log.hpp"
#include "stillmap/pipeline/instance_stream.hpp"
#include "stillmap/pipeline/keypoint_budget.hpp"
#include "stillmap/pipeline/late_tracking.hpp"
#include "stillmap/pipeline/mapping.hpp"
#include "stillmap/pipeline/mover_stream.hpp"
#include "stillmap/pipeline/saved_map.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/tag/tag_detector.hpp"
#include "stillmap/track/carried_parts.hpp"
#include "stillmap/track/tracker.hpp"

#include <functional>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// Work left out in realtime so that tracking kept up with the camera: first the network sees fewer
/// frames and movers are looked for in fewer, then frames get fewer keypoints, and at last the
/// source drops frames. In lockstep nothing is left out.
struct LoadShedding {
  std::size_t frames_without_movers = 0;      ///< frames in which no movers were looked for
  std::size_t frames_without_view = 0;        ///< frames that were not added to the dense map
  std::size_t frames_of_fewer_keypoints = 0;  ///< frames that got fewer keypoints than configured
  int fewest_keypoints = 0;                   ///< smallest number of keypoints asked for
};

/// All results of a run.
struct SlamResult {
  Trajectory trajectory;  ///< T_world_camera of every frame with a pose, in the final map
  std::vector<UncertainPose> poses;  ///< the same with their covariances
  Trajectory keyframes;              ///< of this run, those still in the map
  ComposedCloud dense;  ///< colored static cloud in the world frame, and the objects in it
  PlacedMap placed;     ///< the views and voxels of the cloud, for meshes and grids
  DenseStatistics dense_statistics;
  std::vector<MoverTrack> movers;  ///< by id, in the world of the trajectory; see MoverTracker
  MoverStatistics mover_statistics;
  std::vector<FrameRecord> frames;  ///< every frame pushed
  StageTimes timing;                ///< milliseconds per stage
  std::size_t landmarks = 0;        ///< number of landmarks in the final map
  std::size_t maps = 0;  ///< number of unconnected maps; more than one if tracking was lost
  /// Number of frames with a pose in each of those, by its component. Localized only: as numbered
  /// in the file.
  std::map<std::uint32_t, int> frames_by_map;
  std::vector<MapEvent> events;         ///< loops closed, maps joined and dropped, in this order
  RefineTotals refined;                 ///< statistics of local mapping
  std::size_t segmented = 0;            ///< number of frames that the network saw
  std::optional<DetectorUse> detector;  ///< The detector and its schedule; none without one.
  std::size_t detector_failures = 0;    ///< Number of frames without a usable mask.
  std::string detector_skipped;         ///< Frames without a usable mask, in one line; empty: none.
  std::optional<Finding> detector_finding;  ///< See Detector::finding().
  std::optional<Finding> carried_parts;     ///< See CarriedParts::finding().
  TextureAgreement texture;                 ///< See MapMaker::texture().
  std::vector<Finding> motion_sensors;      ///< See Tracker::findings().
  /// Upward direction in the world by the accelerometer; none if it is not known.
  std::optional<Eigen::Vector3d> up;
  LoadShedding load_shedding;
  Camera camera;               ///< of the frames, without distortion
  ShutterTiming shutter;       ///< timing of the camera's shutters that was in use at the end
  CameraErrors camera_errors;  ///< That the map shows.
  std::size_t tracked() const { return trajectory.size(); }
  /// Sets `poses` and `trajectory`.
  void set_poses(std::vector<UncertainPose> found);
};

/// Returns the poses of all frames in the map.
/// @param smooth  whether uninterrupted paths are smoothed: see smooth_trajectory()
std::vector<UncertainPose> camera_poses(const FrameLog& log, const Map& map, bool smooth);

/// A map made before, to begin in.
struct StartingMap {
  SavedMap saved;
  bool extend = true;  ///< false: the camera is only found in it, and the map stays as it is
};

/// The whole system behind the public class Slam: frames in, poses out, and at the end everything
/// else.
///
///     SlamSystem slam(source.camera(), options, make_detector(options.segment));
///     while (auto frame = source.next()) slam.push(frame);
///     SlamResult result = slam.finish();
///
/// Threads work behind it (network, masks, map, dense map, movers); the object itself is for one
/// thread. Times are taken from the trace that is bound to the thread that makes it, or else from a
/// trace of its own that keeps times only.
class SlamSystem {
 public:
  /// @param detector finds instances; null for none
  /// @param start    a map to begin in: the camera counts as lost until its place is recognized
  /// Throws Error for a map of another pyramid.
  SlamSystem(const Camera& camera, const SlamParameters& options,
             std::unique_ptr<Detector> detector = nullptr,
             std::optional<StartingMap> start = std::nullopt);
  ~SlamSystem();

  /// The next frame, indices and stamps rising. T_world_camera as known now; none while there is no
  /// map or the camera is lost. Throws Error if the frame's size is not the camera's.
  std::optional<Pose> push(const RgbdFramePtr& frame);

  /// Sets whether the frames pushed from now on extend the map.
  void set_extend(bool extend);

  /// Adds a saved map, and merges the present one into it if a place of it is recognized, now or in
  /// a later keyframe. Returns why no place is recognized yet; empty if they are merged.
  /// Throws Error for a map of another pyramid.
  std::string load(SavedMap saved);

  /// The frame pushed last, as the tracker saw it; null before the first.
  const TrackedFramePtr& newest() const { return newest_; }

  /// Returns the record of the frame pushed last. Called after the first push().
  const FrameRecord& newest_record() const { return log_.back(); }
  /// Returns the work left out so far.
  LoadShedding load_shedding() const;

  /// The timing of the camera's shutters that is in use.
  const ShutterTiming& shutter() const { return tracker_.shutter(); }
  const ShutterCalibration& shutter_calibration() const { return tracker_.shutter_calibration(); }

  /// The state of the map at the frame pushed last, as the tracker saw it; after finish() that
  /// after the last frame.
  const MapView& view() const { return view_; }

  /// The state of the whole system. May be called by any thread at any time. See Slam::snapshot().
  std::shared_ptr<const Snapshot> snapshot();
  /// Returns the live cloud with its classes. May be called by any thread; see DenseStream::ask().
  std::future<std::shared_ptr<const LabeledCloud>> ask_labeled_cloud() { return dense_.ask(); }
  /// From here on snapshots show this cloud.
  void show(std::shared_ptr<const Cloud> cloud) { dense_.show(std::move(cloud)); }

  /// What moves, by id, as known now and in the world as it is now. In lockstep at the frame pushed
  /// last; in realtime at the newest that was worked on.
  std::vector<Mover> movers() { return movers_.newest(!options_.schedule.realtime); }

  /// Returns the time of the frame of the movers that movers() returned last [s]; none before the
  /// first.
  std::optional<double> movers_time() const { return movers_.newest_time(); }

  /// Returns the movers at the newest processed frame, in order of their ids. May be called by any
  /// thread; see MoverStream::ask().
  std::future<std::vector<Mover>> ask_movers() const { return movers_.ask(); }

  const Camera& camera() const { return camera_; }
  PyramidShape pyramid() const { return options_.orb.pyramid(); }
  /// Returns the records of all frames pushed, for the thread that pushes.
  const std::vector<FrameRecord>& records() const { return log_.records(); }

  /// Waits until all pushed frames are in the views of the dense map.
  void wait_for_views() { dense_.wait(); }
  /// Waits until all pushed frames are in the whole map.
  void wait_for_map() {
    mapping_.wait();
    dense_.wait();
  }

  // Call `read` on one of the threads between two of its tasks. May be called by any thread; the
  // future becomes ready when `read` has returned. Results do not depend on it.
  std::future<void> ask_map(std::function<void(const MapMaker&)> read) {
    return mapping_.ask(std::move(read));
  }
  std::future<void> ask_views(std::function<void(const DenseStream&)> read) {
    return dense_.ask(std::move(read));
  }
  std::future<void> ask_mover_tracks(std::function<void(const MoverTracker&)> read) const {
    return movers_.ask(std::move(read));
  }

  /// Waits for all threads, adjusts the map once more, and collects the results. Call once; no push
  /// after it.
  SlamResult finish();

  /// The map of the keyframes and landmarks, after finish().
  const Map& map() const { return mapping_.map(); }

  /// The whole map, to be saved; one begun in included. May be called by any thread at any time.
  /// @param writer  the program, with its version
  SavedMap saved_map(const std::string& writer);

 private:
  void check(const RgbdFramePtr& frame) const;
  void track(const RgbdFramePtr& image);
  Features features_of(const RgbdFrame& image);
  MotionInput motion_input(const Frame& frame, const std::optional<InitialPose>& initial) const;
  TrackingTimes tracking_times(double propagation) const;
  void shed_load(const RgbdFrame& image);

  void finish_streams();
  void drop_brief_maps();
  Trajectory keyframe_trajectory() const;
  void collect_movers(SlamResult& result) const;
  void collect_dense_map(SlamResult& result);
  void collect_statistics(SlamResult& result) const;
  StageTimes stage_times() const;

  // First, since the threads of the streams write to it.
  const std::unique_ptr<Trace> own_trace_;    // null: the thread that made this is traced
  TraceTrack& track_;                         // of the thread that pushes
  const std::size_t first_track_;             // of the streams' threads
  std::size_t end_track_ = 0;                 // one beyond their last
  std::optional<TraceBinding> construction_;  // while their threads are made

  const SlamParameters options_;
  const Camera camera_;
  OrbExtractor extractor_;
  std::optional<TagDetector> tags_;
  KeypointBudget keypoint_budget_;
  LoadShedding load_shedding_;
  MotionEstimator motion_;
  Tracker tracker_;
  InstanceStream instances_;
  Mapping mapping_;
  DenseStream dense_;
  MoverStream movers_;
  FrameLog log_;
  LateTracking late_;
  CarriedParts carried_;
  TrackedFramePtr newest_;
  MapView view_;
  double propagation_ = 0;  // time that propagating the masks to the newest frame took [ms]
};

}  // namespace stillmap
