// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/relocalization_result.hpp"
#include "stillmap/motion/ego_motion.hpp"
#include "stillmap/optimize/trajectory_filter.hpp"
#include "stillmap/track/dead_reckoning.hpp"
#include "stillmap/track/gyro_prior.hpp"
#include "stillmap/track/keyframe_policy.hpp"
#include "stillmap/track/landmark_statistics.hpp"
#include "stillmap/track/local_map_tracking.hpp"
#include "stillmap/track/motion_consistency.hpp"
#include "stillmap/track/new_map_policy.hpp"
#include "stillmap/track/pose_estimate.hpp"
#include "stillmap/track/previous_frame_tracking.hpp"
#include "stillmap/track/repeated_landmarks.hpp"
#include "stillmap/track/rest_detector.hpp"
#include "stillmap/track/shutter_calibration.hpp"
#include "stillmap/track/start_verification.hpp"
#include "stillmap/track/still_surface.hpp"
#include "stillmap/track/tracked_frame.hpp"
#include "stillmap/track/tracker_state.hpp"

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// A map that tracked the camera for fewer frames is dropped when the camera is lost.
inline constexpr int kMinMapFrames = 15;

struct TrackerOptions {
  /// Minimum number of landmarks that agree with the pose of a tracked frame.
  int min_inliers = 25;
  /// Whether visual odometry takes over where a map that is not extended is out of view.
  bool tracked_by_odometry = true;
  /// Whether landmarks that the depth image sees through are erased, and a map that was started on
  /// moving objects is replaced.
  bool erase_seen_through = true;
  /// Rule for the repeated landmarks that are erased at keyframes.
  RepeatRule repeats = RepeatRule::kNone;
  /// Whether the poses handed out during the run are filtered: see TrajectoryFilter.
  bool filter_poses = true;
  /// Whether points of the previous frame support poses with few landmarks.
  bool previous_frame_points = true;
  /// Whether keypoints are corrected for the motion during the exposure: see MotionCompensation.
  bool compensate_exposure = true;
  /// Whether the gyroscope of the camera's IMU is used, if it has one: see GyroPrior.
  bool gyroscope = true;
  /// Whether IMU and wheels give the pose of a lost camera: see DeadReckoning.
  bool dead_reckoning = true;
  /// Whether a camera at rest keeps its pose: see RestDetector.
  bool rest = true;
  /// Whether poses are checked against the motion before them: see MotionConsistency.
  bool consistency_test = true;
  LandmarkStatisticsOptions statistics;
  NewMapOptions new_map;
  KeyframePolicyOptions keyframes;
  /// Timing of the camera's shutters until the frames show another one, if the camera's is unknown.
  ShutterTiming shutter;
};

/// Pose of a frame before its moving parts are known.
struct InitialPose {
  PoseEstimate estimate;
  EgoMotion motion;
};

/// Start of a tracker.
enum class TrackerStart {
  kNewMap,     ///< The first frame starts a map.
  kInMap,      ///< A map exists. The camera is lost until its place is recognized.
  kInMapOnly,  ///< As kInMap, and no new map is started until set_extend().
};

/// Finds the camera's pose in each frame of a sequence (Mur-Artal and Tardos, ORB-SLAM2, TRO 2017,
/// section III). It orders the pose sources and keeps the state between frames: pose from the
/// previous frame, else from the reference keyframe, refined in the local map; else from a
/// relocalization result; else by visual odometry in a map that is only localized in; else by the
/// IMU or the wheels. A lost camera whose pose these know continues the map where it sees static
/// surfaces again; otherwise it starts another one. Synchronous.
/// Of the map it sees only the snapshot that it is given.
class Tracker {
 public:
  Tracker(const Camera& camera, const PyramidShape& pyramid, const TrackerOptions& options,
          TrackerStart start = TrackerStart::kNewMap);

  /// Sets whether the map is extended from the next frame on; if not, no new map is started.
  void set_extend(bool extend) { extend_ = extend; }

  /// Predicts the motion of the camera up to the next frame from the samples of its IMU. Called
  /// first for each frame.
  void predict_motion(const RgbdFrame& image);

  /// Sets the features of the next frame to those recorded without the effects of the camera's
  /// motion during the exposure (see MotionCompensation) and without the known error of the depth.
  /// @param initial    result of predict_pose() for the frame, or none before it is known
  /// @param local_map  that the frame will be tracked in
  void compensate_motion(Frame& frame, const std::optional<InitialPose>& initial,
                         const LocalMapPtr& local_map) const;

  /// Returns the findings that IMU or wheels contradict the images.
  std::vector<Finding> findings() const;

  /// Returns the timing of the camera's shutters that is in use.
  const ShutterTiming& shutter() const { return calibration_.timing(); }
  const ShutterCalibration& shutter_calibration() const { return calibration_; }

  /// First pass: returns the pose from the points that were static up to the previous frame, or
  /// none for a first frame and where too few points are found again.
  /// @param local_map the newest snapshot; null while there is no map. After a frame that starts a
  ///        map (TrackState::kStarted) the next call must pass the snapshot made for it.
  /// @param weights of the keypoints, if the frame's evidence is known already: keypoints of weight
  ///        0 are not matched; empty before the evidence is known
  std::optional<InitialPose> predict_pose(const Features& features, const LocalMapPtr& local_map,
                                          const std::vector<float>& weights = {});

  /// Second pass: returns the frame with its pose from the points that its evidence leaves.
  /// @param initial   result of predict_pose() for the frame's features
  /// @param local_map as passed to predict_pose()
  /// @param found     relocalization of an earlier frame; used if this frame has no pose otherwise
  TrackedFramePtr track(const FramePtr& frame, const std::optional<InitialPose>& initial,
                        const LocalMapPtr& local_map,
                        const std::optional<RelocalizationResult>& found = {});

 private:
  Vector6d twist_of(const RgbdFrame& image, const std::optional<InitialPose>& initial) const;
  struct Relabeled {
    FramePtr frame;
    LocalMapPose pose;
  };
  std::optional<PosePrior> odometry_prior(const Frame& frame, const PoseEstimate& initial) const;
  std::optional<LocalMapPose> pose_in_map(const Frame& frame, const PoseEstimate& first,
                                          bool continues) const;
  std::optional<Relabeled> pose_without_motion(const Frame& frame, const PoseEstimate& first,
                                               const LocalMapPose& pose) const;
  void compare_gyroscope(const TrackedFrame& tracked, const PoseEstimate& by_both);
  void calibrate_shutter(const FramePtr& frame, const std::optional<InitialPose>& initial,
                         const LocalMapPose& pose);
  TrackedFramePtr track_without_map(const FramePtr& frame,
                                    const std::optional<RelocalizationResult>& found);
  TrackedFramePtr relocalized(const FramePtr& frame, const RelocalizationResult& found,
                              const std::optional<InitialPose>& initial);
  std::shared_ptr<TrackedFrame> starting_frame(const FramePtr& frame,
                                               const Pose& T_world_camera) const;
  TrackedFramePtr start_map(const FramePtr& frame, const Pose& T_world_camera);
  bool started_in_motion(const Frame& frame) const;
  Pose tracked_backward(const Frame& earlier, const Pose& T_world_earlier) const;
  TrackedFramePtr restart_map(const FramePtr& frame, const InitialPose& initial);
  std::optional<StartVerification::Motion> motion_against_map(const FramePtr& frame,
                                                              const LocalMapPose& pose);
  TrackedFramePtr replace_map(const Frame& frame, const StartVerification::Motion& motion);
  void begin_map(const FramePtr& frame, const TrackedFramePtr& first, const Pose& T_previous_next);
  std::optional<LocalMapPose> pose_of_lost(const FramePtr& frame) const;
  bool agrees_with_prediction(const LocalMapPose& pose) const;
  bool is_confirmed(const PoseEstimate& estimate) const;
  TrackedFramePtr lost(const FramePtr& frame, const std::string& reason);
  TrackedFramePtr lost_at(const FramePtr& frame, const std::string& reason,
                          const UncertainPose& predicted);
  TrackedFramePtr continue_map(const FramePtr& frame, const UncertainPose& pose,
                               const Pose& T_world_predicted);
  TrackedFramePtr tracked(const FramePtr& frame, const LocalMapPose& pose, bool relocalized);
  TrackedFramePtr tracked_by_odometry(const FramePtr& frame, const PoseEstimate& estimate);
  std::shared_ptr<TrackedFrame> frame_at(const FramePtr& frame, const PoseEstimate& estimate) const;
  void note_prediction(TrackedFrame& tracked) const;
  std::optional<Pose> motion_since_previous(const Pose& T_world_camera) const;
  void note_rest(const Features& features);
  EgoMotion ego_motion(const Features& features, const PreviousFramePose& pose) const;
  void judge(TrackedFrame& tracked);
  void end_loss();
  void set_previous(const TrackedFramePtr& tracked);
  void adopt(const LocalMapPtr& local_map);

  TrackingModel model_;
  TrackerOptions options_;
  const TrackerStart start_;
  bool extend_;  // whether new maps are started
  ShutterCalibration calibration_;
  KeyframePolicy keyframe_policy_;
  NewMapPolicy new_map_policy_;

  TrackerState state_;
  LandmarkStatistics statistics_;
  std::optional<Vocabulary> vocabulary_;  // none: no repeated landmarks are erased
  GyroPrior gyro_;
  std::optional<Pose> T_world_by_images_;  // of the previous frame, with an IMU
  DeadReckoning dead_reckoning_;
  StillSurface still_surface_;
  RestDetector rest_;
  Pose T_odometry_world_;             // see TrackedFrame
  std::optional<Pose> T_world_lost_;  // newest pose by dead reckoning while the camera is lost
  MotionConsistency consistency_;
  TrajectoryFilter filter_;
  StartVerification start_verification_;
  int frames_lost_ = 0;
  int frames_in_map_ = 0;          // since its start; at least kMinMapFrames after relocalization
  std::size_t last_proposed_ = 0;  // frame index
};

}  // namespace stillmap
