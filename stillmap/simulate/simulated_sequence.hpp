// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/sensor/frame_source.hpp"
#include "stillmap/simulate/camera_motion.hpp"
#include "stillmap/simulate/kinect.hpp"
#include "stillmap/simulate/scene.hpp"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

struct SimulationOptions {
  std::string scene = "office";   ///< office, or flat: four rooms
  int people = 2;                 ///< 0..6
  std::string activity = "walk";  ///< walk, sit, wave, mixed, rise, companion, crowd
  int things = 0;            ///< movers of no known class, 0..3: swinging crate, pushed chair, ball
  bool near_things = false;  ///< they move close to the viewpoint, in its view
  std::string camera = "xyz";  ///< static, xyz, halfsphere, rpy, loop, follow
  int frames = 300;
  double fps = 30;                ///< [Hz]
  int width = 640, height = 480;  ///< pixels
  double focal = 0;               ///< [px]; 0: that of a Kinect, 525 at a width of 640
  int seed = 1;                   ///< of scene, hand shake and noise
  double speed = 1;               ///< factor on the camera's rate of motion
  double shake = 1;               ///< factor on the hand shake
  bool noise = true;              ///< false: exact depth, and color without noise or drift
  KinectOptions sensor = {};      ///< used with noise
  int exposures = 1;              ///< pictures averaged into one for motion blur; 1: none
  double exposure_time = 0.012;   ///< shutter time [s], used with exposures > 1
  int threads = 2;                ///< for drawing; the pictures do not depend on it
  STILLMAP_FIELDS(scene, people, activity, things, near_things, camera, frames, fps, width, height,
                  focal, seed, speed, shake, noise, sensor, exposures, exposure_time, threads)
};

/// One mover at the time of a frame; world frame, meters.
struct MoverTruth {
  int id = 0;                ///< its value in TruthFrame::instances
  std::string class_name;    ///< "person", or "unknown" for a thing of no known class
  std::string name;          ///< "person", "crate", "chair", "ball"
  Eigen::Vector3d centroid;  ///< of its surface (every square meter counts alike)
  Eigen::AlignedBox3d box;   ///< around them, along the world's axes
  Eigen::Vector3d velocity;  ///< of the centroid [m/s]
  int pixels = 0;  ///< of the picture that show it; known where a picture was drawn (TruthFrame)
  double in_view = 0;  ///< share of it between the picture's borders, covered or not; likewise
  double shown = 0;    ///< share of it that is in view and that nothing else covers; likewise
};

/// Everything that is exactly known about a frame.
struct TruthFrame {
  std::size_t index = 0;
  double timestamp = 0;  ///< seconds
  Pose T_world_camera;   ///< at the middle of the exposure
  cv::Mat depth;         ///< 32FC1 meters along the optical axis, exact; 0 where nothing is
  cv::Mat instances;     ///< 8UC1: 0 static, else the id of the mover seen
  std::vector<MoverTruth> movers;  ///< all, seen or not, by id
};

/// 8UC1: 255 person, 128 mover of no known class, 0 static.
cv::Mat class_mask(const TruthFrame& truth);

struct SimulatedFrame {
  RgbdFramePtr frame;
  TruthFrame truth;
};

/// A rendered RGB-D sequence, and the truth about it. World: z up, floor at z = 0. Frames are made
/// when asked for and are functions of the options and the index alone: equal options, equal bytes.
///
///     SimulatedSequence sequence({.people = 2, .camera = "xyz", .frames = 60, .width = 320,
///     .height = 240}); while (const auto frame = sequence.next()) { ...
///     sequence.T_world_camera(frame->index) ... }
///
/// All const members may be called from several threads at once.
class SimulatedSequence : public FrameSource {
 public:
  /// Camera: width x height, principal point in the middle. Throws Error for an option out of
  /// range.
  explicit SimulatedSequence(const SimulationOptions& options);
  /// With another camera (its distortion is not drawn). Options width, height, focal, fps are not
  /// used.
  SimulatedSequence(const SimulationOptions& options, const Camera& camera);
  /// Several sequences of one scene: making the scene is the expensive part of a short sequence.
  /// Options scene, people, activity, things are not used.
  SimulatedSequence(const SimulationOptions& options, const Camera& camera,
                    std::shared_ptr<const Scene> scene);

  const Camera& camera() const override { return camera_; }
  RgbdFramePtr next() override;
  std::optional<std::size_t> size() const override { return frames() - next_; }
  const std::vector<SkippedFrame>& skipped() const override { return skipped_; }
  /// next() starts from the first frame again.
  void rewind() { next_ = 0; }

  std::size_t frames() const { return static_cast<std::size_t>(options_.frames); }
  double timestamp(std::size_t index) const { return static_cast<double>(index) / camera_.fps; }
  Pose T_world_camera(std::size_t index) const;
  /// Pose of every frame.
  Trajectory trajectory() const;
  std::vector<MoverTruth> movers(std::size_t index) const;
  /// Color and measured depth of a frame.
  RgbdFramePtr frame(std::size_t index) const { return at(index).frame; }
  /// The truth about a frame: several times faster than frame(), as no color is drawn.
  TruthFrame truth(std::size_t index) const;
  /// 32FC1 m/s: how fast what a pixel shows moves through the world, each limb for itself; 0 where
  /// it is static.
  cv::Mat speed(std::size_t index) const;
  /// Both in one go.
  SimulatedFrame at(std::size_t index) const;

  const Scene& scene() const { return *scene_; }
  const std::shared_ptr<const Scene>& shared_scene() const { return scene_; }
  const SimulationOptions& options() const { return options_; }

 private:
  SimulationOptions options_;
  Camera camera_;
  std::shared_ptr<const Scene> scene_;
  CameraMotion motion_;
  std::vector<SkippedFrame> skipped_;
  std::size_t next_ = 0;
};

}  // namespace stillmap
