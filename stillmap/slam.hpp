// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/cloud.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/options.hpp"
#include "stillmap/segment/detector.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <opencv2/core.hpp>

/// RGB-D SLAM for dynamic scenes: frames in, poses out, and at any time a snapshot of the map.
///
///     stillmap::Options options = stillmap::read_options("fused");
///     stillmap::Slam slam(camera, options);
///     while (camera_delivers(color, depth, timestamp)) slam.push(color, depth, timestamp);
///     stillmap::Results results = slam.finish();
///     stillmap::write_results(results, "results");  // stillmap/write_results.hpp
///
/// World frame: the camera frame of the first frame of a map (x right, y down, z ahead), meters.
namespace stillmap {

/// The tracking result of one frame.
struct PoseUpdate {
  std::size_t frame_index = 0;
  double timestamp = 0;                ///< [s]
  std::optional<Pose> T_world_camera;  ///< none while there is no map or the camera is lost
  std::string reason;                  ///< why there is no pose; empty where there is one
  int inliers = 0;                     ///< number of landmarks that agree with the pose
  bool relocalized = false;            ///< whether the camera was lost and was found in this frame
};

/// A keyframe of the sparse map.
struct KeyframePose {
  std::size_t frame_index = 0;  ///< in the run that made it
  double timestamp = 0;         ///< [s]
  Pose T_world_camera;
};

/// A correction of the map as a whole: a loop was closed, maps were merged, or the map was adjusted
/// as a whole. Poses and landmarks known from before are out of date.
struct MapCorrection {
  std::size_t frame_index = 0;  ///< first frame that is tracked in the corrected map
  double timestamp = 0;         ///< of that frame [s]
};

/// A landmark of the sparse map.
struct LandmarkPoint {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  ///< [m]
  float static_probability = 0.5F;  ///< probability that it is static, by all frames so far [0..1]
  int observations = 0;             ///< number of keyframes that observe it
};

/// An event that concerned the map as a whole.
struct MapEvent {
  enum class Kind {
    kLoop,     ///< a loop was closed
    kMerge,    ///< two maps were merged
    kDropped,  ///< a map was dropped because it had held the camera too briefly
  };
  Kind kind = Kind::kLoop;
  std::size_t frame_index = 0;     ///< of the keyframe at which it happened, or that began the map
  double timestamp = 0;            ///< of the same keyframe [s]
  std::size_t seen_in = 0;         ///< frame index of the earlier keyframe that shows the place
  int inliers = 0;                 ///< number of landmarks that agree with the match
  int fused = 0;                   ///< number of landmarks merged, and of observations gained
  double meters = 0, radians = 0;  ///< correction of the camera pose
  std::size_t keyframes = 0;       ///< number of keyframes of the map at that time
  double graph_ms = 0;             ///< time of the pose graph optimization [ms]
  double milliseconds = 0;         ///< total time without the adjustment of the whole map [ms]
};

/// A moving object at one time, world frame.
struct MovingObject {
  int id = 0;                          ///< 1, 2, 3 ... in the order of appearance
  std::string class_name = "unknown";  ///< class of most of its detections
  double timestamp = 0;                ///< [s]
  bool observed = false;               ///< whether it was detected in this frame or is predicted
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s]
  Eigen::AlignedBox3d box;                             ///< extent, hidden parts included [m]
};

/// A moving object over the whole run.
struct MovingObjectTrack {
  int id = 0;
  std::string class_name = "unknown";
  double class_confidence = 0;        ///< mean confidence of its detections [0..1]
  std::vector<MovingObject> samples;  ///< one per frame from the first detection to the last
};

/// The state of the system at one time. Never changed once made, so any thread may read it.
///
/// Poses, keyframes and landmarks are those of the map that the camera is in; maps from before a
/// tracking loss are left out until they are merged with it.
struct Snapshot {
  PoseUpdate newest;                     ///< the frame pushed last
  Trajectory trajectory;                 ///< frames with a pose, in the map as it is now
  std::vector<KeyframePose> keyframes;   ///< in the order in which they were made
  std::vector<LandmarkPoint> landmarks;  ///< of the sparse map
  std::vector<MapEvent> events;          ///< in the order in which they happened
  std::vector<MovingObject> movers;      ///< by id
  /// Static surfaces, world frame: coarser than the final cloud while frames are pushed, and the
  /// final cloud after finish(). Never null; empty where the dense map is turned off.
  std::shared_ptr<const Cloud> cloud;
};

/// Figures of a whole run.
struct RunStatistics {
  std::size_t frames = 0;         ///< number of frames pushed
  std::size_t tracked = 0;        ///< number of frames with a pose
  std::size_t segmented = 0;      ///< number of frames that the network saw
  std::size_t maps = 0;           ///< number of unconnected maps
  std::size_t landmarks = 0;      ///< number of landmarks in the final map
  double tracking_median_ms = 0;  ///< median time of the tracker per frame [ms]
};

struct RunDetails;

/// All results of a run. Copies share the cloud.
struct Results {
  Trajectory trajectory;  ///< T_world_camera of every frame with a pose, in the final map
  Trajectory keyframes;   ///< the same of the keyframes of this run
  std::shared_ptr<const Cloud> cloud;  ///< static cloud, world frame; never null
  std::vector<MovingObjectTrack> movers;
  std::vector<MapEvent> events;
  RunStatistics statistics;
  std::shared_ptr<const RunDetails> details;  ///< for write_results()
};

/// A saved map to begin in.
struct StartMap {
  std::filesystem::path file;
  bool extend = true;  ///< whether the map is extended; otherwise the camera is only localized
};

/// Keeps a callback subscribed as long as it, or a copy of it, lives.
using Subscription = std::shared_ptr<const void>;

/// The SLAM system. Work is spread over several threads behind it; the object itself is used by one
/// thread, which pushes the frames. Only snapshot() may be called by any thread at any time.
class Slam {
 public:
  /// @param camera   intrinsics of the images; if it is distorted, push(color, depth, timestamp)
  ///                 rectifies them
  /// @param detector finds objects; null for the network or the masks that the options name, if any
  /// @param start    a saved map of this camera: the camera counts as lost until its place is found
  /// Throws Error for options or a camera out of range, and for a map that cannot be used.
  explicit Slam(const Camera& camera, const Options& options = {},
                std::unique_ptr<Detector> detector = nullptr,
                const std::optional<StartMap>& start = std::nullopt);
  ~Slam();
  Slam(Slam&&) noexcept;
  Slam& operator=(Slam&&) noexcept;

  /// Makes a frame of images as OpenCV users have them; the images are not kept. The frame gets the
  /// next index.
  /// @param color     8-bit BGR or gray, of the camera's size
  /// @param depth     16-bit in units of 1 / camera.depth_factor meters, or 32-bit float in meters,
  ///                  registered to the color image; 0, and not-a-number, where unknown
  /// @param timestamp of the color image [s]
  /// Throws Error that names the argument and its type or size, if it is wrong.
  RgbdFramePtr make_frame(const cv::Mat& color, const cv::Mat& depth, double timestamp);

  /// Tracks a frame. Returns its pose in the map as it is now; none while there is no map or the
  /// camera is lost. Throws Error for a frame that is null, not of the camera's size or the wrong
  /// type, and if its index or timestamp is not greater than that of the frame before.
  std::optional<Pose> push(const RgbdFramePtr& frame);
  /// The same for the images of make_frame().
  std::optional<Pose> push(const cv::Mat& color, const cv::Mat& depth, double timestamp);

  /// Returns the state of the system. May be called by any thread, before and after finish() too.
  /// Nothing is prepared for it in advance: each thread of the system contributes its part between
  /// two pieces of its work, so the call may take some 100 ms; the tracker goes on meanwhile.
  std::shared_ptr<const Snapshot> snapshot() const;

  /// Calls a function whenever something has happened, until the subscription is destroyed. All
  /// functions are called by the thread that pushes, from push() and finish(), and keep the tracker
  /// waiting while they run. To be called by that thread, too.
  [[nodiscard]] Subscription on_pose(std::function<void(const PoseUpdate&)> call);
  [[nodiscard]] Subscription on_keyframe(std::function<void(const KeyframePose&)> call);
  [[nodiscard]] Subscription on_map_changed(std::function<void(const MapCorrection&)> call);
  [[nodiscard]] Subscription on_movers(std::function<void(const std::vector<MovingObject>&)> call);

  /// Waits for all threads, adjusts the whole map once more and returns the results. Called once;
  /// nothing may be pushed after it.
  Results finish();

  /// Saves the map, for StartMap. Called after finish(). Throws Error if it cannot be written.
  void save_map(const std::filesystem::path& file) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace stillmap
