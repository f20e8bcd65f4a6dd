// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/finding.hpp"
#include "stillmap/dense/cloud.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/options.hpp"
#include "stillmap/segment/detector.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"
#include "stillmap/warn/warning_event.hpp"

#include <cstddef>
#include <cstdint>
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

/// State of the camera in a frame.
enum class PoseState {
  kTracked,    ///< It has a pose.
  kNoMap,      ///< There is no map yet, and the frame has too few points to start one.
  kLost,       ///< There is a map, but no pose in it.
  kPredicted,  ///< The images give no pose; it has one by the IMU or the wheels, uncertain.
  kSkipped,    ///< options.input leaves the frame out.
};

/// The tracking result of one frame.
struct PoseUpdate {
  std::size_t frame_index = 0;
  double timestamp = 0;  ///< Time of the frame [s].
  PoseState state = PoseState::kNoMap;
  /// Filtered by the motion before it if Options::Map::smooth_trajectory is set. None while there
  /// is no map or the camera is lost.
  std::optional<Pose> T_world_camera;
  /// Motion of the camera since the previous frame, without the filter and corrections of the map,
  /// which make T_world_camera jump: odometry. None in a snapshot, and if the previous frame
  /// has no pose, the frame starts a map, or the camera was relocalized.
  std::optional<Pose> T_previous_camera = std::nullopt;
  /// Reason why there is no pose; empty if there is one. push() and on_pose() add why the place of
  /// a lost camera is not found.
  std::string reason;
  int inliers = 0;           ///< Number of landmarks that agree with the pose.
  bool relocalized = false;  ///< The lost camera was relocalized in this frame.
  /// False if the pose contradicts the motion of the camera in the frames before, or nearly all
  /// keypoints move; its covariance is then enlarged.
  bool certain = true;
  /// Whether T_world_camera is in the world frame of the saved map loaded last: see StartMap and
  /// Slam::load_map(). False until the camera is relocalized in the saved map or the present map is
  /// merged into it, and in parts of the saved map that are not connected with its oldest one.
  bool in_saved_map = false;
  /// Covariance of the pose within the map before the filter, as UncertainPose::covariance; zero
  /// without a pose and for the first frame of a map.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/// A keypoint of a frame, with its motion label.
struct ObservedKeypoint {
  float u = 0, v = 0;               ///< Position in the tracked image [pixels].
  float depth = 0;                  ///< Depth along the optical axis [m]; 0: unknown.
  float static_probability = 0.5F;  ///< Probability that its surface is static [0..1].
  bool moving = false;   ///< It is labeled as moving, so that it does not count for the pose.
  bool matched = false;  ///< It is matched with a landmark.
};

/// What the tracker saw in a frame. Images and objects are shared with it and must not be changed.
struct ObservedFrame {
  PoseUpdate update;
  RgbdFramePtr images;  ///< As tracked: rectified, and halved if the options say so.
  std::vector<ObservedKeypoint> keypoints;
  /// Objects of the network or the masks, at their places in this frame; null without them, and
  /// before the first result.
  SegmentedFramePtr objects;
  cv::Mat1b moving;  ///< 255 at pixels labeled as moving; empty: there are none.
};

/// A keyframe of the sparse map.
struct KeyframePose {
  std::size_t frame_index = 0;  ///< Index of the frame in the run that made it.
  double timestamp = 0;         ///< Time of the frame [s].
  Pose T_world_camera;
};

/// A correction of the whole map: a loop was closed, maps were merged, or global bundle adjustment
/// was applied. Earlier poses and landmarks are out of date.
struct MapCorrection {
  std::size_t frame_index = 0;  ///< First frame that is tracked in the corrected map.
  double timestamp = 0;         ///< Time of that frame [s].
};

/// A landmark of the sparse map.
struct LandmarkPoint {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  ///< Position in the world [m].
  float static_probability = 0.5F;  ///< Probability that it is static, from all frames [0..1].
  int observations = 0;             ///< Number of keyframes that observe it.
};

/// An event that concerned the whole map.
struct MapEvent {
  enum class Kind {
    kLoop,     ///< A loop was closed.
    kMerge,    ///< Two maps were merged.
    kDropped,  ///< A map was dropped because it tracked the camera too briefly.
  };
  Kind kind = Kind::kLoop;
  std::size_t frame_index = 0;  ///< Index of the event's keyframe, or of the dropped map's first.
  double timestamp = 0;         ///< Time of the same keyframe [s].
  std::size_t seen_in = 0;      ///< Frame index of the earlier keyframe that shows the place.
  int inliers = 0;              ///< Number of landmarks that agree with the match.
  int fused = 0;                ///< Number of merged landmarks and of gained observations.
  double meters = 0, radians = 0;  ///< Correction of the camera pose [m], [rad].
  std::size_t keyframes = 0;       ///< Number of keyframes of the map at that time.
  double graph_ms = 0;             ///< Time of the pose graph optimization [ms].
  double milliseconds = 0;         ///< Total time without global bundle adjustment [ms].
};

/// A moving object at one time, in the world frame.
struct MovingObject {
  int id = 0;                          ///< Identity: 1, 2, 3 ... in the order of appearance.
  std::string class_name = "unknown";  ///< Most frequent class of its detections.
  double timestamp = 0;                ///< Time of the frame [s].
  bool observed = false;               ///< It was observed in this frame, not predicted.
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  ///< Position [m].
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< Velocity [m/s].
  Eigen::AlignedBox3d box;                             ///< Extent, including hidden parts [m].
};

/// A moving object over the whole run.
struct MovingObjectTrack {
  int id = 0;
  std::string class_name = "unknown";
  double class_confidence = 0;  ///< Mean confidence of its detections [0..1].
  /// One sample per frame from the first to the last detection; none while the object was unseen
  /// for long. Tracks of an object that was unseen are joined at the end of the run, with the id of
  /// the first.
  std::vector<MovingObject> samples;
};

/// An object that appeared, went or moved between two visits of a place; world frame.
struct ObjectChange {
  std::string class_name = "unknown";         ///< Most frequent class of its detections.
  std::optional<Eigen::AlignedBox3d> before;  ///< Extent in the earlier map [m]; none: it appeared.
  std::optional<Eigen::AlignedBox3d> after;   ///< Present extent [m]; none: it went.
};

/// The state of the system at one time. It is immutable, so any thread may read it.
///
/// Poses, keyframes and landmarks are those of the map that the camera is in; maps from before a
/// tracking loss are not included until they are merged with it.
struct Snapshot {
  PoseUpdate newest;                     ///< Result of the frame pushed last.
  Trajectory trajectory;                 ///< Poses of the tracked frames in the current map.
  std::vector<KeyframePose> keyframes;   ///< Keyframes in the order of their creation.
  std::vector<LandmarkPoint> landmarks;  ///< Landmarks of the sparse map.
  std::vector<MapEvent> events;          ///< Events in the order of their occurrence.
  std::vector<MovingObject> movers;      ///< Moving objects in order of their ids.
  /// Static surfaces in the world frame: coarser than the final cloud while frames are pushed, and
  /// the final cloud after finish(). Never null; empty if the dense map is disabled.
  std::shared_ptr<const Cloud> cloud;
  /// Number of the voxel of each point, each another one, with which the clouds of two snapshots
  /// can be compared: a voxel of the world has the same number in both. Never null; empty after
  /// finish().
  std::shared_ptr<const std::vector<std::uint64_t>> cloud_voxels;
};

/// Figures of a whole run.
struct RunStatistics {
  std::size_t frames = 0;         ///< Number of frames pushed.
  std::size_t tracked = 0;        ///< Number of frames with a pose.
  std::size_t segmented = 0;      ///< Number of frames processed by the network.
  std::size_t maps = 0;           ///< Number of unconnected maps.
  std::size_t landmarks = 0;      ///< Number of landmarks in the final map.
  double tracking_median_ms = 0;  ///< Median time of the tracker per frame [ms].
};

struct RunDetails;

/// All results of a run. Copies share the cloud.
struct Results {
  Trajectory trajectory;  ///< T_world_camera of every frame with a pose, in the final map.
  std::vector<UncertainPose> poses;  ///< The same poses with the covariances of their errors.
  Trajectory keyframes;  ///< T_world_camera of the keyframes of this run, in the final map.
  std::shared_ptr<const Cloud> cloud;  ///< Static cloud in the world frame; never null.
  std::vector<MovingObjectTrack> movers;
  std::vector<MapEvent> events;
  RunStatistics statistics;
  /// What the frames and the map show to be wrong or worth knowing, such as a wrong depth factor;
  /// those of the severity kUntrusted are reasons not to trust the results.
  std::vector<Finding> findings;
  std::shared_ptr<const RunDetails> details;  ///< Data for write_results().
};

/// What the frames do to the map.
enum class Mode {
  kMap,       ///< They extend it.
  kLocalize,  ///< The camera is only localized in it, and it stays as it is.
};

/// A saved map to start from.
struct StartMap {
  std::filesystem::path file;
  bool extend = true;  ///< Starts in Mode::kMap, otherwise in Mode::kLocalize.
};

/// Handle that keeps a callback subscribed while it or a copy of it exists.
using Subscription = std::shared_ptr<const void>;

/// The SLAM system. It runs several threads internally; the object itself is used by one thread,
/// which pushes the frames. Only snapshot(), movers(), changes() and save_map() may be called by
/// any thread at any time.
class Slam {
 public:
  /// @param camera   intrinsics of the images, such as read_camera(file) of
  ///                 stillmap/sensor/make_source.hpp; if it is distorted, make_frame() and
  ///                 push(color, depth, timestamp) rectify them
  /// @param options  options.input selects the frames that are used, and whether they are halved
  /// @param detector object detector; null for the network or the masks that the options name
  /// @param start    saved map, also of another camera; the camera counts as lost until it is
  /// relocalized Throws Error for options or a camera out of range, for classes of objects that
  /// neither COCO nor the detector has, and for a map that cannot be used.
  explicit Slam(const Camera& camera, const Options& options = {},
                std::unique_ptr<Detector> detector = nullptr,
                const std::optional<StartMap>& start = std::nullopt);
  ~Slam();
  Slam(Slam&&) noexcept;
  Slam& operator=(Slam&&) noexcept;

  /// Keeps the results so far in a file from now on, so that a process that is killed loses at most
  /// its last second: `stillmap recover` and StartMap read it. The file stays after finish(), and
  /// may be removed when the results are written. Called once, before finish().
  /// Throws Error if the file cannot be written or holds the journal of another run.
  void keep_journal(const std::filesystem::path& file);

  /// Returns a frame made of OpenCV images, which are not kept. The frame gets the next index.
  /// @param color     8-bit BGR or gray, of the camera's size
  /// @param depth     16-bit in units of 1 / camera.depth_factor meters, or 32-bit float in meters,
  ///                  registered to the color image; 0 or NaN where the depth is unknown
  /// @param timestamp time of the color image [s]
  /// Throws Error that names the argument and its type, size or unit, if it is wrong.
  RgbdFramePtr make_frame(const cv::Mat& color, const cv::Mat& depth, double timestamp);

  /// Returns a frame made of a rectified stereo pair: the left image, with depth by semi-global
  /// matching. The baseline of the pair is that of the camera, whose depth sensor is "stereo".
  /// @param left, right  8-bit BGR or gray, of the camera's size
  /// @param timestamp    time of the pair [s]
  /// Throws Error as make_frame(), for a camera with another sensor or with distortion, and for
  /// images that are exchanged.
  RgbdFramePtr make_stereo_frame(const cv::Mat& left, const cv::Mat& right, double timestamp);

  /// Tracks a frame.
  /// Throws Error for a frame that is null, not of the camera's size or the wrong type, for one
  /// that make_frame() did not make if the camera is distorted (it would not be rectified), and if
  /// its index or timestamp is not greater than that of the previous frame.
  PoseUpdate push(const RgbdFramePtr& frame);
  /// Tracks a frame made of OpenCV images; the arguments are those of make_frame().
  PoseUpdate push(const cv::Mat& color, const cv::Mat& depth, double timestamp);

  /// Adds a sample of the camera's IMU (Camera::imu). The samples of the time since the frame
  /// before support the pose of a frame; those that come after it do not. A frame of a FrameSource
  /// with samples of its own uses those. If more than a fifth come too late, findings() has
  /// `late-samples`.
  /// @param sample  with the time stamp of the IMU: Imu::time_offset is taken off
  /// Throws Error if the camera has no IMU, and for numbers that are not finite.
  void push_imu(const ImuSample& sample);
  /// Adds a sample of the odometry of the robot that carries the camera (Camera::wheels). The pose
  /// of a frame without enough landmarks is continued by the samples around it and the last one
  /// with a pose.
  /// Throws Error if the camera has no wheels, and for numbers that are not finite.
  void push_odometry(const OdometrySample& sample);

  /// Adds a saved map, also of another camera, while the system runs. Its places are recognized
  /// from now on: a lost camera is relocalized in it, and when a keyframe of the present map, an
  /// earlier one or in Mode::kMap a later one, shows a place of it, the two are merged: the world
  /// is then that of the added map (see on_map_changed()). Returns why no place is recognized yet;
  /// empty if they are merged. Throws Error for a map that cannot be used, and after finish().
  std::string load_map(const std::filesystem::path& file);

  /// Sets what the frames pushed from now on do to the map. Throws Error after finish().
  void set_mode(Mode mode);

  /// Evaluates the zones and distances of a file of rules (docs/view.md) in each frame from now on,
  /// in place of those of an earlier call. Throws Error for a file that cannot be used, for classes
  /// that no moving object can have, and after finish().
  void watch(const std::filesystem::path& rules);
  /// Returns the begins of the warnings that are present in the newest frame; none without watch().
  std::vector<WarningEvent> warnings() const;

  /// Returns what the frames pushed so far show to be wrong, such as a wrong depth factor; those of
  /// the severity kUntrusted are reasons not to trust the poses. The results have more findings.
  std::vector<Finding> findings() const;

  /// Returns what the tracker saw in the frame used last, for the thread that pushes; none before
  /// the first.
  std::optional<ObservedFrame> newest() const;

  /// Returns the state of the system. May be called by any thread, before and after finish().
  /// Each thread of the system contributes its part between two of its tasks, so the call may take
  /// some 100 ms; the tracker continues meanwhile.
  std::shared_ptr<const Snapshot> snapshot() const;

  /// Returns the moving objects of a snapshot, without the time that the rest of it takes.
  std::vector<MovingObject> movers() const;

  /// Returns what changed since the saved map (StartMap, load_map()) was made, as far as the frames
  /// of Mode::kMap show it, the largest object first. May be called by any thread before finish();
  /// it computes for about a second, while the tracker continues. Throws Error after finish(), when
  /// what went is no longer in the map.
  std::vector<ObjectChange> changes() const;

  // Subscriptions to events, which end when the returned handle is destroyed. The callbacks run on
  // the thread that pushes, within push() and finish(), and block the tracker while they run.
  // Subscriptions are made by the same thread. An empty function is an Error.

  /// Calls a function after every frame.
  [[nodiscard]] Subscription on_pose(std::function<void(const PoseUpdate&)> call);
  /// Calls a function for every new keyframe.
  [[nodiscard]] Subscription on_keyframe(std::function<void(const KeyframePose&)> call);
  /// Calls a function after every correction of the whole map.
  [[nodiscard]] Subscription on_map_changed(std::function<void(const MapCorrection&)> call);
  /// Calls a function for every warning that begins or ends: see watch().
  [[nodiscard]] Subscription on_warning(std::function<void(const WarningEvent&)> call);
  /// Calls a function with the moving objects after every frame.
  [[nodiscard]] Subscription on_movers(std::function<void(const std::vector<MovingObject>&)> call);

  /// Waits for all threads, applies global bundle adjustment and returns the results. Called once;
  /// nothing may be pushed after it.
  Results finish();

  /// Saves the map, for StartMap. During the run it is the map of that moment, without the final
  /// adjustment. Throws Error if it cannot be written.
  void save_map(const std::filesystem::path& file) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Two maps of a merge, and whether places of one were recognized in the other.
struct MergedPair {
  std::filesystem::path a, b;
  std::size_t places = 0;  ///< Number of keyframes whose place is known in the other map.
  bool connected = false;  ///< They lie in one world, through these places or other maps.
  /// Without places: "connected by other maps", or the test that the most similar keyframes failed.
  std::string reason;
};

/// Cells of a NavigationGrid, and the heights of obstacles above the floor [m].
struct NavigationGridOptions {
  double cell = 0.05;  ///< Side of a cell.
  double lowest = 0.1, highest = 1.8;
  double radius = 0.2;  ///< Of the robot: so far about its way the cells are free.
};

/// A grid for planners on the floor of a frame `map`: z upwards, the floor at z = 0. Cell (row,
/// column) begins at origin + cell * (column, row).
struct NavigationGrid {
  double cell = 0;                                   ///< Side of a cell [m].
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< [m]
  /// 0 free, 100 occupied, -1 unknown: as in nav_msgs/OccupancyGrid.
  cv::Mat_<std::int8_t> cells;
  /// Euclidean distance of a cell's center from that of the nearest occupied cell [m]; infinite if
  /// there is none.
  cv::Mat1f distances;

  /// Returns the distance at a position between cells, by bilinear interpolation; none outside.
  std::optional<double> distance_at(const Eigen::Vector2d& p_map) const;
};

/// Returns the grid of static surfaces, such as those of Snapshot::cloud during a run. A cell is
/// occupied if surfaces are in it between the two heights. Otherwise it is free if floor was seen
/// in it, or if the robot drove over it. None without surfaces and way.
/// @param way          positions of the robot's base in the world frame [m]
/// @param T_map_world  the same for all grids of a run: by the mounting of the camera, or as in
///                     floor.json
/// Throws Error for options out of range.
std::optional<NavigationGrid> navigation_grid(const Cloud& cloud,
                                              const std::vector<Eigen::Vector3d>& way,
                                              const Pose& T_map_world,
                                              const NavigationGridOptions& options = {});

/// Euclidean distances from static surfaces in space (a Euclidean distance field, ESDF), for
/// planners. Cell (x, y, z) begins at origin + cell * (x, y, z), world frame. Space that nobody has
/// seen has no surfaces.
struct DistanceField {
  double cell = 0;                                   ///< Side of a cell [m].
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3i size = Eigen::Vector3i::Zero();    ///< Number of cells along x, y and z.
  /// Distance of each cell's center from that of the nearest cell with a surface [m], for
  /// ((x * size.y) + y) * size.z + z.
  std::vector<float> distances;

  /// Returns the distance at a position between cells, by trilinear interpolation; none outside.
  std::optional<double> distance_at(const Eigen::Vector3d& p_world) const;
  /// Returns the change of that distance with the position, which points away from the nearest
  /// surface; none outside.
  std::optional<Eigen::Vector3d> gradient_at(const Eigen::Vector3d& p_world) const;
};

/// Returns the distances from the surfaces of a cloud, such as Snapshot::cloud during a run: exact
/// between the centers of cells (Felzenszwalb and Huttenlocher 2012). None without points.
/// @param cell    side of a cell [m]
/// @param margin  width of the space around the cloud [m]
/// Throws Error for values out of range, and for more than 1e8 cells.
std::optional<DistanceField> distance_field(const Cloud& cloud, double cell = 0.1,
                                            double margin = 0.5);

/// Merges saved maps, also of different cameras, in one file; see `stillmap map merge`. The world
/// is that of the map in the frame of a site, else of the oldest, and what nothing connects stays
/// apart. The result does not depend on
/// the order of the maps.
/// @param maps  map files or folders of runs, two or more
/// @returns all pairs of maps
/// Throws Error for a map that cannot be read or is given twice, for maps of different pyramids, if
/// the file is one of the maps, or exists and is no map, and if it cannot be written.
std::vector<MergedPair> merge_saved_maps(const std::vector<std::filesystem::path>& maps,
                                         const std::filesystem::path& out,
                                         const Options& options = {});

/// Returns the objects that appeared, went or moved between two visits, the largest first, with
/// their extents in both maps, in the world of the older one; see `stillmap map changes`.
/// @param before,after  map files or folders of runs
/// Throws Error for maps that cannot be read or have no dense views, show no common place, or are
/// of the same recordings.
std::vector<ObjectChange> compare_saved_maps(const std::filesystem::path& before,
                                             const std::filesystem::path& after,
                                             const Options& options = {});

}  // namespace stillmap
