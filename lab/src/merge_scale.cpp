// SPDX-License-Identifier: Apache-2.0
/// Time and memory of a merge against the number of maps. A floor is filled with random landmarks,
/// and short paths across it are observed with noise and drift, without images. The floor grows
/// with the number of paths, so that every place is on the same number of paths. Printed for each
/// number of maps: keyframes, connected maps, ATE of each component, time and peak memory, and the
/// exponents of their growth.
#include "stillmap/base/machine.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/evaluate.hpp"
#include "stillmap/pipeline/merge_maps.hpp"
#include "stillmap/simulate/random.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <tuple>
#include <vector>

#include "commands.hpp"
#include <fmt/format.h>

namespace stillmap::lab {
namespace {

using simulate::Random;
using simulate::scramble;

constexpr int kPerCell = 12;        // landmarks per cubic meter
constexpr int kHeight = 3;          // of the floor [m]
constexpr int kKeyframes = 12;      // of a path
constexpr double kStep = 0.4;       // between keyframes [m]
constexpr double kRange = 5;        // of the camera [m]
constexpr double kFloorPerMap = 6;  // [m^2]

struct Arguments {
  std::vector<int> counts{10, 30, 100};
};

using Cell = std::tuple<int, int, int>;
using LandmarkKey = std::pair<Cell, int>;

Camera camera() {
  Camera camera;
  camera.width = 640, camera.height = 480;
  camera.fx = camera.fy = 525, camera.cx = 319.5, camera.cy = 239.5;
  camera.depth_sensor = find_depth_sensor("kinect_v1");
  return camera;
}

/// A true landmark, by its cell and number there.
struct TrueLandmark {
  Eigen::Vector3d p_world;
  Descriptor descriptor;
};

TrueLandmark landmark_at(const LandmarkKey& key) {
  const auto& [cell, number] = key;
  const auto& [x, y, z] = cell;
  const auto bits = [](int i) { return static_cast<std::uint64_t>(i); };
  Random random(scramble(bits(x) << 40 | bits(y) << 16 | bits(z)), bits(number));
  TrueLandmark landmark;
  landmark.p_world = {x + random.uniform(), y + random.uniform(), z + random.uniform()};
  for (auto& word : landmark.descriptor) word = random.bits();
  return landmark;
}

/// The keypoints of a view, and the landmarks that they show.
struct View {
  std::shared_ptr<Features> features = std::make_shared<Features>();
  std::vector<LandmarkKey> landmarks;
};

/// Adds a landmark to a view, if it is in it.
void observe(const LandmarkKey& key, const Camera& camera, const Pose& T_camera_world,
             Random& random, View& view) {
  TrueLandmark landmark = landmark_at(key);
  const Eigen::Vector3d p = T_camera_world * landmark.p_world;
  if (p.z() < 0.5 || p.z() > kRange) return;
  const Eigen::Vector2d pixel = camera.project(p);
  if (!camera.contains(pixel.x(), pixel.y())) return;
  Keypoint keypoint;
  keypoint.u = static_cast<float>(pixel.x() + 0.5 * random.normal());
  keypoint.v = static_cast<float>(pixel.y() + 0.5 * random.normal());
  keypoint.depth = static_cast<float>(p.z() + camera.depth_sensor.sigma(p.z()) * random.normal());
  const double level = std::floor(std::log(kRange / p.norm()) / std::log(1.2));
  keypoint.level = static_cast<std::uint8_t>(std::clamp(level, 0.0, 7.0));
  keypoint.response = 1;
  for (int flips = 0; flips < 20; ++flips)
    landmark.descriptor[random.bits() % 4] ^= std::uint64_t{1} << random.bits() % 64;
  view.features->keypoints.push_back(keypoint);
  view.features->descriptors.push_back(landmark.descriptor);
  view.landmarks.push_back(key);
}

View view_from(const Pose& T_world_camera, const Camera& camera, double side, Random& random) {
  View view;
  const Pose T_camera_world = T_world_camera.inverse();
  const Eigen::Vector3d& at = T_world_camera.translation();
  const auto cell = [](double x) { return static_cast<int>(std::floor(x)); };
  for (int x = cell(at.x() - kRange); x <= cell(at.x() + kRange); ++x) {
    for (int y = cell(at.y() - kRange); y <= cell(at.y() + kRange); ++y) {
      if (x < 0 || y < 0 || x >= side || y >= side) continue;
      for (int z = 0; z < kHeight; ++z)
        for (int i = 0; i < kPerCell; ++i)
          observe({{x, y, z}, i}, camera, T_camera_world, random, view);
    }
  }
  view.features->grid = KeypointGrid(view.features->keypoints, camera.width, camera.height);
  return view;
}

/// Returns the poses of a level camera that walks across the floor.
std::vector<Pose> path_across(double side, Random& random) {
  Eigen::Vector2d at(random.uniform(0, side), random.uniform(0, side));
  double heading = random.uniform(0, 2 * std::numbers::pi);
  std::vector<Pose> poses;
  for (int k = 0; k < kKeyframes; ++k) {
    const Eigen::Vector3d ahead(std::cos(heading), std::sin(heading), 0);
    Eigen::Matrix3d R;
    R << ahead.y(), 0, ahead.x(), -ahead.x(), 0, ahead.y(), 0, -1, 0;
    poses.emplace_back(Eigen::Quaterniond(R), Eigen::Vector3d(at.x(), at.y(), 1.5));
    at += kStep * ahead.head<2>();
    const Eigen::Vector2d inward = Eigen::Vector2d::Constant(side / 2) - at;
    const bool leaves = (at.array() < 2).any() || (at.array() > side - 2).any();
    heading = leaves ? std::atan2(inward.y(), inward.x()) : heading + 0.25 * random.normal();
  }
  return poses;
}

double stamp_of(int map, int keyframe) { return 1000.0 * map + keyframe; }

/// Returns the motion with an error of 2 mm and 0.05 degrees.
Pose with_drift(const Pose& motion, Random& random) {
  const auto noise = [&](double sigma) -> Eigen::Vector3d {
    return sigma * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
  };
  return motion * Pose(so3_exp(noise(0.0009)), noise(0.002));
}

/// Returns the map of a path, and adds its true poses.
SavedMap map_of(int number, double side, Trajectory& truth) {
  Random random(7, static_cast<std::uint64_t>(number));
  const Camera images = camera();
  Map map(images, PyramidShape{});
  const std::uint32_t component = map.new_component();
  const std::vector<Pose> poses = path_across(side, random);
  std::map<LandmarkKey, std::vector<Observation>> seen;
  Pose estimate;
  for (int k = 0; k < kKeyframes; ++k) {
    const Pose& T_world_camera = poses[static_cast<std::size_t>(k)];
    if (k > 0)
      estimate =
          estimate *
          with_drift(poses[static_cast<std::size_t>(k - 1)].inverse() * T_world_camera, random);
    const View view = view_from(T_world_camera, images, side, random);
    Keyframe keyframe;
    keyframe.component = component;
    keyframe.frame_index = static_cast<std::size_t>(k);
    keyframe.timestamp = stamp_of(number, k);
    keyframe.T_world_camera = estimate;
    keyframe.features = view.features;
    keyframe.static_weight.assign(view.landmarks.size(), 1);
    keyframe.landmarks.resize(view.landmarks.size());
    const KeyframeId id = map.add_keyframe(std::move(keyframe)).id;
    for (std::uint32_t i = 0; i < view.landmarks.size(); ++i)
      seen[view.landmarks[i]].push_back({id, i});
    truth.push_back({stamp_of(number, k), T_world_camera});
  }
  for (const auto& [key, observations] : seen) {
    if (observations.size() < 2) continue;
    const Keyframe& first = map.at(observations[0].keyframe);
    const Keypoint& keypoint = first.features->keypoints[observations[0].keypoint];
    const Eigen::Vector3d p =
        first.T_world_camera * images.unproject(keypoint.u, keypoint.v, keypoint.depth);
    const LandmarkId landmark = map.add_landmark(p, observations[0]).id;
    for (const Observation& observation : observations) map.observe(landmark, observation);
    map.refresh(landmark);
  }
  return {"lab", map.content(), {}};
}

/// Returns the trajectories of the components, the largest first.
std::vector<Trajectory> trajectories_of(const MapContent& map) {
  std::map<std::uint32_t, Trajectory> by_component;
  for (const Keyframe& k : map.keyframes)
    by_component[k.component].push_back({k.timestamp, k.T_world_camera});
  std::vector<Trajectory> trajectories;
  for (auto& [component, trajectory] : by_component) {
    std::ranges::sort(trajectory, {}, &StampedPose::timestamp);
    trajectories.push_back(std::move(trajectory));
  }
  std::ranges::sort(trajectories, std::greater(), &Trajectory::size);
  return trajectories;
}

struct Figures {
  double maps = 0, seconds = 0, mib = 0;
};

Figures measure(int maps) {
  Trajectory truth;
  std::vector<NamedMap> made;
  for (int i = 0; i < maps; ++i)
    made.push_back({fmt::format("{:05}", i), map_of(i, std::sqrt(kFloorPerMap * maps), truth)});
  const double cpu = process_cpu_ms();
  const Stopwatch watch;
  const MergedMap result = merge_maps(std::move(made), {}, "lab");
  const double seconds = watch.milliseconds() / 1000, cpu_seconds = (process_cpu_ms() - cpu) / 1000;
  const std::vector<Trajectory> components = trajectories_of(result.saved.map);
  double worst = 0;
  for (const Trajectory& component : components)
    if (component.size() >= 3)
      worst = std::max(worst, absolute_trajectory_error(truth, component).translation.rmse);
  const double mib = peak_memory_mib();
  fmt::print("| {} | {} | {} | {} | {} | {:.0f} | {:.1f} | {:.1f} | {:.1f} | {:.0f} |\n", maps,
             truth.size(), result.saved.map.keyframes.size(), result.saved.map.landmarks.size(),
             components.size(),
             100.0 * static_cast<double>(components.front().size()) /
                 static_cast<double>(result.saved.map.keyframes.size()),
             1000 * worst, seconds, cpu_seconds, mib);
  std::fflush(stdout);
  return {static_cast<double>(maps), cpu_seconds, mib};
}

void measure_all(const Arguments& arguments) {
  fmt::print(
      "| maps | keyframes | kept | landmarks | components | keyframes in the largest [%] | worst "
      "ATE of a component [mm] | time [s] | CPU [s] | peak memory [MiB] |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n");
  std::vector<Figures> all;
  for (const int maps : arguments.counts) all.push_back(measure(maps));
  for (std::size_t i = 1; i < all.size(); ++i) {
    const double decades = std::log(all[i].maps / all[i - 1].maps);
    fmt::print("from {} to {} maps: time as n^{:.2f}, memory as n^{:.2f}\n", all[i - 1].maps,
               all[i].maps, std::log(all[i].seconds / all[i - 1].seconds) / decades,
               std::log(all[i].mib / all[i - 1].mib) / decades);
  }
}

}  // namespace

void add_merge_scale_command(CLI::App& app) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "merge-scale", "time and memory of a merge against the number of maps of a simulated floor");
  command->add_option("--maps", arguments->counts, "numbers of maps, ascending")
      ->delimiter(',')
      ->capture_default_str();
  command->callback([arguments] { measure_all(*arguments); });
}

}  // namespace stillmap::lab
