// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/map/keyframe_proposal.hpp"
#include "stillmap/map/local_map.hpp"
#include "stillmap/map/relocalization_result.hpp"
#include "stillmap/motion/ego_motion.hpp"
#include "stillmap/optimize/pose_solver.hpp"
#include "stillmap/track/keyframe_policy.hpp"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

struct TrackerOptions {
  int min_start_points = 100;  ///< static keypoints with depth that a new map starts from
  /// Of the 16 parts of the picture, those that must show such keypoints (three or more): what is
  /// crowded into a corner is a thing, and no room.
  int min_start_parts = 4;
  double motion_radius =
      15;  ///< search radius around keypoints predicted by constant velocity [pixels]
  double local_radius =
      4;                  ///< search radius around landmarks once the pose is nearly known [pixels]
  int max_distance = 90;  ///< Hamming distance of a match, of 256
  double ratio = 0.8;     ///< best to second-best distance on one level (Lowe 2004)
  double min_view_cosine =
      0.5;  ///< between a landmark's mean viewing direction and the present one: 60 degrees
  int min_motion_inliers = 15;  ///< for the pose from the previous frame to be believed
  int sure_inliers = 40;  ///< landmarks that make the initial pose without points of one frame only
  /// Of a landmark's log-odds what lasts to the next frame; they are the mean of what frames say,
  /// for these are far from independent.
  double landmark_memory = 0.95;
  int min_inliers = 25;  ///< landmarks for the frame to count as tracked
  int patience = 10;     ///< frames without a pose that could begin a map, before one does
  /// Of what should be seen from the last pose, the share that something close hides: from there on
  /// the camera is taken for covered. What covers it will pass, and no map is begun on it,
  double covered_share = 0.5;
  int covered_patience = 90;  ///< unless it has stayed for so many frames
  int min_map_frames = 15;    ///< a map that held the camera for fewer is dropped when lost
  /// In a map that is not extended: go on by odometry where the camera looks past the map.
  bool tracked_by_odometry = true;
  KeyframePolicyOptions keyframes;
  STILLMAP_FIELDS(min_start_points, min_start_parts, motion_radius, local_radius, max_distance,
                  ratio, min_view_cosine, min_motion_inliers, sure_inliers, landmark_memory,
                  min_inliers, patience, covered_share, covered_patience, min_map_frames,
                  tracked_by_odometry, keyframes)
};

enum class TrackState {
  kWaiting,   ///< no map yet, and not enough in view to begin one
  kStarted,   ///< this frame begins a map
  kTracking,  ///< pose found in the map
  kLost,      ///< no pose
};

/// What became of one frame. Never changed once made.
struct TrackedFrame {
  FramePtr frame;
  TrackState state = TrackState::kWaiting;
  std::string reason;                  ///< in plain words, where there is no pose
  std::optional<Pose> T_world_camera;  ///< in the world as the tracker saw it then
  KeyframeId reference;     ///< the pose's keyframe; invalid where this frame begins a map
  Pose T_reference_camera;  ///< holds while the map moves
  std::vector<LandmarkId>
      landmarks;             ///< per keypoint: what it shows; invalid where nothing is known
  int inliers = 0;           ///< landmarks that agree with the pose
  bool relocalized = false;  ///< the camera was lost, and goes on where the map's side found it
  bool tracked_by_odometry =
      false;  ///< the pose goes on from the frame before, by points not in the map
  std::optional<KeyframeProposal> proposal;

  bool has_pose() const { return T_world_camera.has_value(); }
  /// Whether its world may be another than that of the frames before.
  bool enters_world() const { return state == TrackState::kStarted || relocalized; }
};

using TrackedFramePtr = std::shared_ptr<const TrackedFrame>;

/// "This keypoint shows that point": a landmark, or (id invalid) a point of the previous frame.
struct PointMatch {
  std::uint32_t keypoint = 0;
  LandmarkId landmark;
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  float weight = 1;  ///< what it counts for by the frames so far, 0 to 1
};

/// A frame's pose before it is known what moves in it.
struct InitialPose {
  EgoMotion motion;
  std::vector<PointMatch> matches;  ///< that agree with it
};

/// How a tracker begins.
enum class TrackerStart {
  kNewMap,     ///< the first frame begins a map
  kInMap,      ///< there is one: the camera counts as lost in it until its place is recognized
  kInMapOnly,  ///< likewise, and no new map is ever begun
};

/// Finds the camera's pose in each frame of a sequence: constant-velocity guess, matches with the
/// previous frame, then with the local map (Mur-Artal and Tardos, ORB-SLAM2, TRO 2017, section
/// III). Synchronous; it remembers the previous frame, and sees of the map only the snapshot it is
/// given.
class Tracker {
 public:
  Tracker(const Camera& camera, const PyramidShape& pyramid, const TrackerOptions& options,
          TrackerStart start = TrackerStart::kNewMap);

  /// First pass, for the evidence to be judged by: the pose from what was static up to the frame
  /// before. None for a first frame, and where too little of it is seen again.
  /// @param local_map the newest snapshot; null while there is no map. After a frame that begins a
  /// map
  ///        (TrackState::kStarted) the next call must bring the snapshot made for it.
  std::optional<InitialPose> follow(const Features& features, const LocalMapPtr& local_map);

  /// Second pass: the pose from what the frame's evidence leaves.
  /// @param initial      what follow() gave for the frame's features
  /// @param local_map  as given to it
  /// @param found      where an earlier frame was recognized: taken up if this frame has no pose
  /// otherwise, and is seen from there too
  TrackedFramePtr track(const FramePtr& frame, const std::optional<InitialPose>& initial,
                        const LocalMapPtr& local_map,
                        const std::optional<RelocalizationResult>& found = {});

 private:
  using Match = PointMatch;
  struct Estimate {
    Pose T_world_camera;
    std::vector<Match> matches;  ///< inliers only
  };
  /// A keypoint of this frame that goes on from one of the frame before.
  struct Continuation {
    std::uint32_t previous;
    Match match;
  };

  /// What a pose is sought from.
  struct Stance {
    LocalMapPtr local_map;
    TrackedFramePtr previous;
    std::vector<std::optional<Eigen::Vector3d>> carried;
  };

  TrackedFramePtr begin(const FramePtr& frame, const std::optional<RelocalizationResult>& found);
  TrackedFramePtr start(const FramePtr& frame);
  TrackedFramePtr lost(const FramePtr& frame, const std::string& reason);
  bool may_begin(const Frame& frame);
  bool covered(const Frame& frame) const;
  std::shared_ptr<TrackedFrame> placed(const FramePtr& frame, const Estimate& estimate) const;
  TrackedFramePtr tracked(const FramePtr& frame, const Estimate& estimate, bool relocalized);
  TrackedFramePtr beside(const FramePtr& frame, const Estimate& estimate);
  void go_on_from(const TrackedFramePtr& tracked);
  void adopt(const LocalMapPtr& local_map);
  void stand(const Stance& stance);

  std::optional<InitialPose> follow_previous(const Features& features) const;
  std::optional<InitialPose> initial_pose(const Features& features,
                                          const std::vector<Continuation>& followed,
                                          const Pose& guess) const;
  EgoMotion ego_motion(const Features& features, const std::vector<Continuation>& followed,
                       const Pose& T_world_camera) const;
  std::optional<Estimate> estimate_from_reference(const Frame& frame) const;
  std::optional<Estimate> estimate_in_local_map(const Frame& frame, const Estimate& first);
  std::optional<Estimate> estimate_with_points(const Frame& frame, const Estimate& first,
                                               std::vector<Match> matches) const;
  std::optional<Estimate> estimate_from_place(const Frame& frame,
                                              const RelocalizationResult& found);
  std::optional<Estimate> estimate_beside(const Frame& frame,
                                          const std::optional<InitialPose>& initial) const;
  std::vector<Continuation> match_previous(const Features& features, const Pose& T_world_camera,
                                           double radius) const;
  Eigen::Vector3d seen_before(std::size_t i) const;
  std::vector<Match> match_reference(const Frame& frame) const;
  std::vector<Match> match_local(const Frame& frame, const Pose& T_world_camera,
                                 const std::vector<Match>& known, std::vector<char>& in_view) const;
  std::optional<Estimate> solve(const Features& features, const Pose& guess,
                                const std::vector<Match>& matches, int min_inliers) const;
  void count_sightings(const Frame& frame, const Estimate& estimate,
                       const std::vector<char>& in_view);
  std::vector<VisibilityCount> take_sightings();

  Camera camera_;
  PyramidShape pyramid_;
  TrackerOptions options_;
  TrackerStart start_;
  KeyframePolicy policy_;

  LocalMapPtr local_map_;
  TrackedFramePtr previous_;  // the newest frame with a pose
  Pose T_world_previous_;     // its pose in the newest local map
  Pose T_previous_next_;      // constant-velocity model
  /// Beside the map: per keypoint of the previous frame where its point was seen first, so that
  /// errors add up by point and not by frame. Else empty.
  std::vector<std::optional<Eigen::Vector3d>> carried_;
  int frames_lost_ = 0;
  int could_have_begun_ = 0;  // of these, frames that a map could have begun with
  int covered_ = 0;           // and such before which something stood
  int frames_in_map_ = 0;     // since it was begun; no fewer than are needed to keep an old one
  std::size_t last_proposed_ = 0;                 // frame index
  std::vector<VisibilityCount> sightings_;        // of local maps before this one
  std::vector<std::uint32_t> predicted_, found_;  // per landmark of local_map_
  std::vector<float> static_log_odds_;            // likewise: of its being static
};

}  // namespace stillmap
