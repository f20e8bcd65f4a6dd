// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/sensor/frame_source.hpp"
#include "stillmap/simulate/camera_motion.hpp"
#include "stillmap/simulate/depth_camera.hpp"
#include "stillmap/simulate/renderer.hpp"
#include "stillmap/simulate/scene.hpp"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

struct SimulationOptions {
  std::string scene = "office";   ///< Scene: office, flat (four rooms), or yard (crane).
  int people = 2;                 ///< Number of people, 0 to 6.
  std::string activity = "walk";  ///< Activity: walk, sit, wave, mixed, rise, companion, crowd.
  /// Number of movers of no known class, 0 to 3: swinging crate, pushed chair, ball; in the yard
  /// the crane's hook and two vehicles.
  int things = 0;
  bool near_things = false;  ///< Whether they move close to the viewpoint, in its view.
  /// Number of AprilTags: 0 to 12 on walls, in the yard 0 to 9 on containers.
  int tags = 0;
  int visit = 1;              ///< Visit of the office, with other furniture: 1 or 2.
  std::string light = "day";  ///< Light as for SceneOptions: day or evening.
  /// Camera motion: static, xyz, halfsphere, rpy, loop, follow, trolley.
  std::string camera = "xyz";
  int frames = 300;
  double fps = 30;                ///< Frame rate [Hz].
  int width = 640, height = 480;  ///< Image size [pixels].
  double focal = 0;               ///< Focal length [pixels]; 0: 525 at a width of 640.
  /// Name or file of a camera, as for read_camera(), whose intrinsics (without distortion) and
  /// depth sensor are used, scaled to `width`; height, focal and sensor are then ignored. Empty:
  /// none.
  std::string camera_model = {};
  int seed = 1;      ///< Seed of scene, hand shake and noise.
  double speed = 1;  ///< Factor on the speed of the camera motion.
  double shake = 1;  ///< Factor on the hand shake.
  /// Whether there is sensor noise; without it depth is exact, and color has no noise or drift.
  bool noise = true;
  std::string sensor = "kinect_v1";  ///< Depth sensor by a name that find_depth_sensor() knows.
  ColorNoise color_noise = {};       ///< Noise of the color images, used if `noise`.
  int exposures = 1;                 ///< Number of images averaged for motion blur; 1: no blur.
  double exposure_time = 0.012;      ///< Shutter time [s], used with exposures > 1.
  /// Rolling shutter of the color camera: time from the first to the last row [s]; 0: global.
  /// Movers are shown as they are at the middle row.
  double readout = 0;
  double depth_delay = 0;  ///< Time from the color image to the depth image [s], not in its stamp.
  DepthBias depth_bias = {};  ///< Systematic error of the depth, used if `noise`.
  /// Name of the IMU on the camera, as for find_imu(); empty: none.
  std::string imu = {};
  bool wheels = false;  ///< Whether wheels measure the motion of the camera.
  int threads = 2;      ///< Number of rendering threads; the images do not depend on it.
};

/// One mover at the time of a frame; world frame [m].
struct MoverTruth {
  int id = 0;                ///< Value in TruthFrame::instances.
  std::string class_name;    ///< "person", or "unknown" for an object of no known class.
  std::string name;          ///< "person", "crate", "chair", "ball", "hook", "vehicle"
  Eigen::Vector3d centroid;  ///< Area-weighted centroid of its surface.
  Eigen::AlignedBox3d box;   ///< Axis-aligned bounding box.
  Eigen::Vector3d velocity;  ///< Velocity of the centroid [m/s].
  int pixels = 0;            ///< Number of pixels that show it; set in TruthFrame only.
  /// Share of it inside the image borders, occluded or not [0..1]; set in TruthFrame only.
  double in_view = 0;
  /// Share of it that is inside the view and not occluded [0..1]; set in TruthFrame only.
  double shown = 0;
};

/// The exact truth of a frame.
struct TruthFrame {
  std::size_t index = 0;
  double timestamp = 0;  ///< Time [s].
  Pose T_world_camera;   ///< Pose at the middle of exposure and readout.
  cv::Mat depth;  ///< Exact depth of the color image, 32FC1, along the optical axis [m]; 0 without
                  ///< a surface.
  cv::Mat instances;  ///< Instance mask, 8UC1: 0 static, else the id of the visible mover.
  std::vector<MoverTruth> movers;  ///< All movers, visible or not, by id.
};

/// Returns an 8UC1 mask: 255 person, 128 mover of no known class, 0 static.
cv::Mat class_mask(const TruthFrame& truth);

struct SimulatedFrame {
  RgbdFramePtr frame;
  TruthFrame truth;
};

/// A rendered RGB-D sequence with its truth. World: z up, floor at z = 0. Frames are rendered on
/// demand and depend on the options and the index only: equal options give equal bytes.
///
///     SimulatedSequence sequence({.people = 2, .camera = "xyz", .frames = 60, .width = 320,
/// .height = 240});
///     while (const auto frame = sequence.next()) use(frame,
/// sequence.T_world_camera(frame->index));
///
/// All const members are thread-safe.
class SimulatedSequence : public FrameSource {
 public:
  /// Camera: width x height, principal point in the center, the sensor named. Throws Error for an
  /// option out of range.
  explicit SimulatedSequence(const SimulationOptions& options);
  /// Uses another camera (without its distortion). Options width, height, focal, fps and
  /// sensor are ignored.
  SimulatedSequence(const SimulationOptions& options, const Camera& camera);
  /// Shares a scene between sequences, since making it dominates the cost of a short sequence.
  /// Options scene, people, activity, things and tags are ignored.
  SimulatedSequence(const SimulationOptions& options, const Camera& camera,
                    std::shared_ptr<const Scene> scene);

  const Camera& camera() const override { return camera_; }
  RgbdFramePtr next() override;
  std::optional<std::size_t> size() const override { return frames() - next_; }
  const std::vector<SkippedFrame>& skipped() const override { return skipped_; }
  /// Makes next() start from the first frame again.
  void rewind() { next_ = 0; }

  std::size_t frames() const { return static_cast<std::size_t>(options_.frames); }
  double timestamp(std::size_t index) const { return static_cast<double>(index) / camera_.fps; }
  Pose T_world_camera(std::size_t index) const;
  /// Returns T_world_camera at any time [s].
  Pose motion(double seconds) const { return motion_.T_world_camera(seconds); }
  /// Returns the pose of every frame.
  Trajectory trajectory() const;
  std::vector<MoverTruth> movers(std::size_t index) const;
  /// Returns color and measured depth of a frame.
  RgbdFramePtr frame(std::size_t index) const { return at(index).frame; }
  /// Returns the truth of a frame; several times faster than frame(), since no color is rendered.
  TruthFrame truth(std::size_t index) const;
  /// Returns the speed of the visible surface in the world frame, separate for each limb, 32FC1
  /// [m/s]; 0 where it is static.
  cv::Mat speed(std::size_t index) const;
  /// Returns frame and truth at once.
  SimulatedFrame at(std::size_t index) const;

  /// Samples of the IMU, from before the first frame to after the last one; empty without one.
  const std::vector<ImuSample>& imu_samples() const { return imu_samples_; }
  /// The same of the wheels.
  const std::vector<OdometrySample>& odometry() const { return odometry_; }

  const Scene& scene() const { return *scene_; }
  const std::shared_ptr<const Scene>& shared_scene() const { return scene_; }
  const SimulationOptions& options() const { return options_; }

 private:
  simulate::RenderOptions render_options(double seconds, bool color) const;
  cv::Mat delayed_depth(double seconds) const;

  SimulationOptions options_;
  Camera camera_;
  std::shared_ptr<const Scene> scene_;
  CameraMotion motion_;
  std::vector<ImuSample> imu_samples_;
  std::vector<OdometrySample> odometry_;
  std::vector<SkippedFrame> skipped_;
  std::size_t next_ = 0;
};

}  // namespace stillmap
