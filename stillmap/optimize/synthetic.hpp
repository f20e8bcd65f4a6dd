// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/optimize/bundle_adjustment.hpp"
#include "stillmap/optimize/pose_solver.hpp"

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

/// Synthetic problems with known truth, for the tests and benchmarks of this module.
namespace stillmap::synthetic {

/// Noise and outliers of the observations.
struct Noise {
  double pixel_sigma = 0;      ///< Standard deviation of u and v [pixels].
  double disparity_sigma = 0;  ///< Standard deviation of the disparity [pixels].
  double outliers = 0;         ///< Share with a random pixel [0..1].
  double depth_outliers = 0;   ///< Share with a depth 0.5 to 1.5 m too large [0..1].
  double depthless = 0;        ///< Share without depth [0..1].
};

/// Three normally distributed numbers, drawn one by one: the order of arguments depends on the
/// computer.
inline Eigen::Vector3d normal_vector(std::mt19937& rng, std::normal_distribution<double>& normal) {
  Eigen::Vector3d drawn;
  for (const int i : {2, 1, 0}) drawn[i] = normal(rng);
  return drawn;
}

inline Pose random_pose(std::mt19937& rng, double meters, double radians) {
  std::normal_distribution<double> normal;
  const auto draw = [&] { return normal_vector(rng, normal); };
  Vector6d twist;
  twist << meters / std::numbers::sqrt3 * draw(), radians / std::numbers::sqrt3 * draw();
  return Pose::exp(twist);
}

/// A random pixel [pixels] and depth [m] within the view. Floats, as in observations, so that the
/// point made of them is observed without rounding.
struct PixelAndDepth {
  float u, v, depth;
};

inline PixelAndDepth random_pixel(std::mt19937& rng, const Camera& camera) {
  std::uniform_real_distribution<float> unit(0, 1);
  PixelAndDepth s{};
  s.u = unit(rng) * static_cast<float>(camera.width - 1);
  s.v = unit(rng) * static_cast<float>(camera.height - 1);
  s.depth = 0.7F + 3.3F * unit(rng);
  return s;
}

/// Parts of an observation that were made outliers.
struct Corruption {
  bool pixel = false, depth = false;
};

/// Adds noise to the observation of a point truly at `truth` (u, v, d); sets u, v and depth.
template <typename Observation>
Corruption corrupt(std::mt19937& rng, const Camera& camera, const Eigen::Vector3d& truth,
                   const Noise& noise, Observation& o) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  Corruption made;
  Eigen::Vector3d uvd =
      truth + Eigen::Vector3d(noise.pixel_sigma * normal(rng), noise.pixel_sigma * normal(rng),
                              noise.disparity_sigma * normal(rng));
  double depth = camera.bf() / uvd.z();
  made.pixel = uniform(rng) < noise.outliers;
  if (made.pixel) uvd.head<2>() << uniform(rng) * camera.width, uniform(rng) * camera.height;
  made.depth = uniform(rng) < noise.depth_outliers;
  if (made.depth) depth += 0.5 + uniform(rng);
  if (uniform(rng) < noise.depthless) depth = 0, made.depth = false;
  o.u = static_cast<float>(uvd.x());
  o.v = static_cast<float>(uvd.y());
  o.depth = static_cast<float>(depth);
  return made;
}

struct PoseScene {
  Camera camera;
  Pose T_world_camera;
  std::vector<PoseObservation> observations;
  std::vector<Corruption> corruption;  ///< One per observation.
};

inline PoseScene pose_scene(unsigned seed, int count, const Noise& noise) {
  std::mt19937 rng(seed);
  PoseScene scene;
  scene.T_world_camera = random_pose(rng, 2, 1);
  for (int i = 0; i < count; ++i) {
    const PixelAndDepth pixel = random_pixel(rng, scene.camera);
    PoseObservation o;
    o.p_world = scene.T_world_camera * scene.camera.unproject(pixel.u, pixel.v, pixel.depth);
    const Eigen::Vector3d truth(pixel.u, pixel.v, scene.camera.bf() / pixel.depth);
    scene.corruption.push_back(corrupt(rng, scene.camera, truth, noise, o));
    scene.observations.push_back(o);
  }
  return scene;
}

struct BundleScene {
  BundleProblem problem;  ///< Initial values with errors.
  std::vector<Pose> T_world_camera;
  std::vector<Eigen::Vector3d> points;
  std::vector<Corruption> corruption;  ///< One per observation.
};

struct BundleShape {
  int free_poses = 15, fixed_poses = 20, points = 2500;
  double observations_per_point = 4.8;
  double pose_error = 0.01;   ///< Standard deviation of the initial poses [m, rad].
  double point_error = 0.02;  ///< Standard deviation of the initial points [m].
  double spacing = 0.02;      ///< Distance between consecutive cameras [m].
};

/// Places cameras along a short path; fixed ones come last.
inline void place_cameras(std::mt19937& rng, const BundleShape& shape, BundleScene& scene) {
  BundleProblem& problem = scene.problem;
  for (int i = 0; i < shape.free_poses + shape.fixed_poses; ++i) {
    const Pose step(Eigen::Quaterniond::Identity(), {shape.spacing * i, 0, 0});
    const Pose truth = step * random_pose(rng, 0.1, 0.05);
    const Pose error = random_pose(rng, shape.pose_error, shape.pose_error);
    const bool fixed = i >= shape.free_poses;
    scene.T_world_camera.push_back(truth);
    problem.pose_fixed.push_back(fixed);
    problem.T_world_camera.push_back(fixed ? truth : truth * error);
  }
}

/// Adds up to `wanted` observations of point k by cameras from `first` on that see it.
inline void observe_point(std::mt19937& rng, std::size_t k, std::size_t first, int wanted,
                          const Noise& noise, BundleScene& scene) {
  const Camera& camera = scene.problem.camera;
  const std::size_t poses = scene.T_world_camera.size();
  for (std::size_t j = 0; j < poses && wanted > 0; ++j) {
    const std::size_t pose = (first + j) % poses;
    const Eigen::Vector3d p_camera = scene.T_world_camera[pose].inverse() * scene.points[k];
    if (p_camera.z() < 0.3) continue;
    const Eigen::Vector3d truth = predict(camera, p_camera);
    if (!camera.contains(truth.x(), truth.y())) continue;
    BundleObservation o;
    o.pose = static_cast<std::uint32_t>(pose);
    o.point = static_cast<std::uint32_t>(k);
    scene.corruption.push_back(corrupt(rng, camera, truth, noise, o));
    scene.problem.observations.push_back(o);
    --wanted;
  }
}

inline BundleScene bundle_scene(unsigned seed, const BundleShape& shape, const Noise& noise) {
  std::mt19937 rng(seed);
  std::normal_distribution<double> normal(0, shape.point_error);
  std::uniform_real_distribution<double> uniform(0, 1);
  BundleScene scene;
  place_cameras(rng, shape, scene);
  std::uniform_int_distribution<std::size_t> any_pose(0, scene.T_world_camera.size() - 1);
  for (int k = 0; k < shape.points; ++k) {
    const std::size_t first = any_pose(rng);
    const PixelAndDepth s = random_pixel(rng, scene.problem.camera);
    const Eigen::Vector3d p =
        scene.T_world_camera[first] * scene.problem.camera.unproject(s.u, s.v, s.depth);
    scene.points.push_back(p);
    scene.problem.points.push_back(p + normal_vector(rng, normal));
    const int wanted = static_cast<int>(shape.observations_per_point + uniform(rng));
    observe_point(rng, static_cast<std::size_t>(k), first, wanted, noise, scene);
  }
  return scene;
}

}  // namespace stillmap::synthetic
