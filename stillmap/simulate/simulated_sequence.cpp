// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/simulated_sequence.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/sample_buffer.hpp"
#include "stillmap/simulate/inertial_unit.hpp"
#include "stillmap/simulate/renderer.hpp"

#include <array>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

using namespace simulate;
void require(bool holds, const char* problem, const char* option) {
  if (!holds) throw Error(problem, option, "");
}

void check(const SimulationOptions& options) {
  require(options.frames > 0, "must be positive", "frames");
  require(options.fps > 0, "must be positive", "fps");
  require(options.width > 0 && options.height > 0, "must be positive", "width, height");
  require(options.focal >= 0, "must not be negative", "focal");
  require(options.readout >= 0 && options.readout < 1, "must be from 0 to 1 s", "readout");
  require(std::abs(options.depth_delay) < 1, "must be below 1 s", "depth-delay");
  require(options.speed > 0, "must be positive", "speed");
  require(options.width <= 8192 && options.height <= 8192, "must be at most 8192", "width, height");
  const double auto_exposure = options.color_noise.auto_exposure;
  require(auto_exposure >= 0 && auto_exposure <= 1, "must be from 0 to 1", "auto-exposure");
  require(options.exposures > 0, "must be positive", "exposures");
  require(options.threads > 0, "must be positive", "threads");
}

/// Returns a camera with images of another width; the height keeps its ratio.
Camera scaled(Camera camera, int width) {
  const double factor = static_cast<double>(width) / camera.width;
  camera.width = width;
  camera.height = static_cast<int>(std::lround(camera.height * factor));
  camera.fx *= factor;
  camera.fy *= factor;
  // Pixel centers have integer coordinates.
  camera.cx = (camera.cx + 0.5) * factor - 0.5;
  camera.cy = (camera.cy + 0.5) * factor - 0.5;
  return camera;
}

Camera camera_of(const SimulationOptions& options) {
  check(options);
  if (!options.camera_model.empty()) {
    Camera camera = scaled(read_camera(options.camera_model), options.width);
    camera.distortion.setZero();
    camera.fps = options.fps;
    return camera;
  }
  Camera camera;
  camera.name = "simulated";
  camera.width = options.width;
  camera.height = options.height;
  camera.fx = camera.fy = options.focal > 0 ? options.focal : 525.0 * options.width / 640;
  camera.cx = (options.width - 1) / 2.0;
  camera.cy = (options.height - 1) / 2.0;
  camera.fps = options.fps;
  camera.depth_sensor = find_depth_sensor(options.sensor);
  if (camera.depth_sensor.baseline > 0) camera.baseline = camera.depth_sensor.baseline;
  return camera;
}

std::shared_ptr<const Scene> scene_of(const SimulationOptions& options) {
  return std::make_shared<const Scene>(make_scene({.scene = options.scene,
                                                   .people = options.people,
                                                   .activity = options.activity,
                                                   .things = options.things,
                                                   .seed = options.seed,
                                                   .tags = options.tags,
                                                   .visit = options.visit,
                                                   .light = options.light,
                                                   .near_things = options.near_things,
                                                   .pace = options.speed,
                                                   .threads = options.threads}));
}

CameraMotionOptions motion_of(const SimulationOptions& options) {
  CameraMotionOptions motion{
      .motion = options.camera, .speed = options.speed, .seed = options.seed};
  motion.shake_position *= options.shake;
  motion.shake_rotation *= options.shake;
  return motion;
}

/// Renders the scene at one time [s].
Rendering draw(const Scene& scene, const Camera& camera, const Pose& T_world_camera, double seconds,
               const RenderOptions& options) {
  std::vector<PosedMover> movers;
  for (const Mover& mover : scene.movers) movers.push_back(pose_at(mover, seconds));
  Mesh shaded;
  std::vector<const Mesh*> meshes{&scene.statics};
  if (options.color && !movers.empty()) {
    shaded.vertices = scene.statics.vertices;
    shaded.faces = scene.statics.faces;
    for (PosedMover& mover : movers) {
      darken(mover.shadows, shaded);
      light_mover(scene.lighting, mover.mesh);
    }
    meshes.front() = &shaded;
  }
  for (const PosedMover& mover : movers) meshes.push_back(&mover.mesh);
  return render(camera, T_world_camera, meshes, scene.textures, options);
}

/// The parts of all movers, numbered from 1 in the order of movers and parts.
struct LabeledParts {
  Mesh mesh;
  std::vector<Eigen::Matrix<double, 3, 4>>
      velocity;  ///< One per part: velocity of [p_world, 1] [m/s].
};

LabeledParts labeled_parts(const Scene& scene, double seconds) {
  constexpr double kStep = 2e-3;  // seconds
  LabeledParts labeled;
  for (const Mover& mover : scene.movers) {
    const auto now = mover.T_world_part(seconds), before = mover.T_world_part(seconds - kStep),
               after = mover.T_world_part(seconds + kStep);
    for (std::size_t i = 0; i < now.size(); ++i) {
      const Eigen::Matrix4d change =
          (after[i].matrix() - before[i].matrix()).cast<double>() / (2 * kStep);
      const Eigen::Matrix4d T_part_world = now[i].inverse().matrix().cast<double>();
      labeled.velocity.push_back((change * T_part_world).topRows<3>());
      append_transformed(mover.parts[i].mesh, now[i],
                         static_cast<std::uint8_t>(labeled.velocity.size()), labeled.mesh);
    }
  }
  return labeled;
}

MoverTruth truth_of(const Mover& mover, double seconds) {
  const PosedMover posed = pose_at(mover, seconds);
  return {mover.id,  mover.person ? "person" : "unknown", mover.name, posed.centroid,
          posed.box, velocity_at(mover, seconds)};
}

/// Returns the shares of a mover's vertices inside the image borders, and of those not occluded by
/// other objects.
struct Shares {
  double in_view = 0, shown = 0;
};
Shares shares_of(const Mesh& mesh, int id, const Camera& camera, const Pose& T_camera_world,
                 const TruthFrame& truth) {
  constexpr double kTouch = 0.02;  // Surfaces closer than this do not occlude each other [m].
  std::size_t inside = 0, covered = 0;
  for (const Vertex& vertex : mesh.vertices) {
    const Eigen::Vector3d p = T_camera_world * vertex.position.cast<double>();
    if (p.z() <= 0) continue;
    const Eigen::Vector2d uv = camera.project(p);
    if (!camera.contains(uv.x(), uv.y(), -0.5)) continue;
    ++inside;
    const cv::Point pixel(cvRound(uv.x()), cvRound(uv.y()));
    const float z = truth.depth.at<float>(pixel);
    covered += truth.instances.at<std::uint8_t>(pixel) != id && z > 0 && z < p.z() - kTouch;
  }
  const auto all = static_cast<double>(mesh.vertices.size());
  return {static_cast<double>(inside) / all, static_cast<double>(inside - covered) / all};
}

/// Computes the movers' positions and visible shares.
/// @param truth  with pose, depth and instances
std::vector<MoverTruth> seen_movers(const Scene& scene, const Camera& camera, double seconds,
                                    const TruthFrame& truth) {
  std::array<int, 256> pixels{};
  for (const std::uint8_t id : cv::Mat1b(truth.instances)) ++pixels[id];
  const Pose T_camera_world = truth.T_world_camera.inverse();
  std::vector<MoverTruth> movers;
  for (const Mover& mover : scene.movers) {
    movers.push_back(truth_of(mover, seconds));
    movers.back().pixels = pixels[static_cast<std::size_t>(mover.id)];
    const Shares shares =
        shares_of(pose_at(mover, seconds).mesh, mover.id, camera, T_camera_world, truth);
    movers.back().in_view = shares.in_view;
    movers.back().shown = shares.shown;
  }
  return movers;
}

}  // namespace

cv::Mat class_mask(const TruthFrame& truth) {
  cv::Mat lookup = cv::Mat::zeros(1, 256, CV_8UC1), mask;
  for (const MoverTruth& mover : truth.movers) {
    lookup.at<std::uint8_t>(mover.id) = mover.class_name == "person" ? 255 : 128;
  }
  cv::LUT(truth.instances, lookup, mask);
  return mask;
}

SimulatedSequence::SimulatedSequence(const SimulationOptions& options)
    : SimulatedSequence(options, camera_of(options)) {}

SimulatedSequence::SimulatedSequence(const SimulationOptions& options, const Camera& camera)
    : SimulatedSequence(options, camera, scene_of(options)) {}

SimulatedSequence::SimulatedSequence(const SimulationOptions& options, const Camera& camera,
                                     std::shared_ptr<const Scene> scene)
    : options_(options),
      camera_(camera),
      scene_(std::move(scene)),
      motion_(motion_of(options), *scene_) {
  check(options);
  if (motion_.duration() && timestamp(frames() - 1) > *motion_.duration())
    throw Error(fmt::format("the trajectory lasts {:.2f} s", *motion_.duration()), options.camera,
                fmt::format("take at most {} frames",
                            1 + static_cast<int>(*motion_.duration() * options.fps)));
  if (!options.imu.empty()) camera_.imu = find_imu(options.imu);
  if (options.wheels) camera_.wheels = Wheels();
  constexpr double kMargin = 0.1;  // s
  const double end = timestamp(frames()) + kMargin;
  const auto T_world_camera = [&](double time) { return motion_.T_world_camera(time); };
  if (camera_.imu)
    imu_samples_ =
        simulated_imu(T_world_camera, -kMargin, end, *camera_.imu, options.seed, options.noise);
  if (camera_.wheels)
    odometry_ = simulated_odometry(T_world_camera, -kMargin, end, *camera_.wheels, options.seed,
                                   options.noise);
}

RgbdFramePtr SimulatedSequence::next() { return next_ < frames() ? frame(next_++) : nullptr; }

Pose SimulatedSequence::T_world_camera(std::size_t index) const {
  return motion_.T_world_camera(timestamp(index));
}

Trajectory SimulatedSequence::trajectory() const {
  Trajectory trajectory;
  for (std::size_t i = 0; i < frames(); ++i)
    trajectory.push_back({timestamp(i), T_world_camera(i)});
  return trajectory;
}

std::vector<MoverTruth> SimulatedSequence::movers(std::size_t index) const {
  std::vector<MoverTruth> movers;
  for (const Mover& mover : scene_->movers) movers.push_back(truth_of(mover, timestamp(index)));
  return movers;
}

TruthFrame SimulatedSequence::truth(std::size_t index) const {
  const Pose T = T_world_camera(index);
  const Rendering rendering =
      draw(*scene_, camera_, T, timestamp(index), render_options(timestamp(index), false));
  TruthFrame truth{index, timestamp(index), T, rendering.depth, rendering.instances, {}};
  truth.movers = seen_movers(*scene_, camera_, truth.timestamp, truth);
  return truth;
}

cv::Mat SimulatedSequence::speed(std::size_t index) const {
  const LabeledParts parts = labeled_parts(*scene_, timestamp(index));
  const Pose T = T_world_camera(index);
  const std::vector<const Mesh*> meshes{&scene_->statics, &parts.mesh};
  const Rendering rendering =
      render(camera_, T, meshes, scene_->textures, render_options(timestamp(index), false));
  cv::Mat speed = cv::Mat::zeros(rendering.depth.size(), CV_32FC1);
  for (int v = 0; v < speed.rows; ++v) {
    for (int u = 0; u < speed.cols; ++u) {
      const int part = rendering.instances.at<std::uint8_t>(v, u);
      if (part == 0) continue;
      const Eigen::Vector3d p_world = T * camera_.unproject(u, v, rendering.depth.at<float>(v, u));
      const auto& velocity = parts.velocity[static_cast<std::size_t>(part - 1)];
      speed.at<float>(v, u) = static_cast<float>((velocity * p_world.homogeneous()).norm());
    }
  }
  return speed;
}

RenderOptions SimulatedSequence::render_options(double seconds, bool color) const {
  RenderOptions options{.color = color, .threads = options_.threads};
  if (options_.readout > 0) {
    const double half = options_.readout / 2;
    options.motion =
        (motion_.T_world_camera(seconds - half).inverse() * motion_.T_world_camera(seconds + half))
            .log();
  }
  return options;
}

/// Renders the depth image, which has a global shutter and its own delay.
cv::Mat SimulatedSequence::delayed_depth(double seconds) const {
  return draw(*scene_, camera_, motion_.T_world_camera(seconds), seconds,
              {.color = false, .threads = options_.threads})
      .depth;
}

SimulatedFrame SimulatedSequence::at(std::size_t index) const {
  const double t = timestamp(index);
  const Pose T = T_world_camera(index);
  Rendering rendering = draw(*scene_, camera_, T, t, render_options(t, true));
  // The middle exposure exists; the others are around it.
  for (int i = 1; i < options_.exposures; ++i) {
    const int side = (i + 1) / 2 * (i % 2 == 0 ? 1 : -1);
    const double moment = t + options_.exposure_time * side / options_.exposures;
    rendering.color +=
        draw(*scene_, camera_, motion_.T_world_camera(moment), moment, render_options(moment, true))
            .color;
  }
  if (options_.exposures > 1) rendering.color *= 1.0 / options_.exposures;

  auto frame = std::make_shared<RgbdFrame>();
  frame->index = index;
  frame->timestamp = t;
  if (camera_.imu) {
    frame->imu = samples_until(imu_samples_, t + camera_.imu->time_offset);
    for (ImuSample& sample : frame->imu) sample.timestamp -= camera_.imu->time_offset;
  }
  frame->odometry = samples_until(odometry_, t);
  const auto seed = static_cast<std::uint64_t>(options_.seed);
  const bool delayed = options_.readout > 0 || options_.depth_delay != 0;
  const cv::Mat depth = delayed ? delayed_depth(t + options_.depth_delay) : rendering.depth;
  if (options_.noise) {
    frame->depth = measure_depth(depth, camera_, seed, index, options_.depth_bias);
    frame->color = measure_color(rendering.color, t, options_.color_noise, seed, index);
  } else {
    frame->depth = depth.clone();
    rendering.color.convertTo(frame->color, CV_8UC3);
  }
  cv::cvtColor(frame->color, frame->gray, cv::COLOR_BGR2GRAY);
  TruthFrame truth{index, t, T, rendering.depth, rendering.instances, {}};
  truth.movers = seen_movers(*scene_, camera_, t, truth);
  return {frame, std::move(truth)};
}

}  // namespace stillmap
