// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/optimize/bundle_adjustment.hpp"
#include "stillmap/optimize/pose_solver.hpp"

#include <random>

/// Worlds with known truth, for the tests and benchmarks of this room.
namespace stillmap::synthetic {

/// What goes wrong with the observations.
struct Noise {
  double pixel_sigma = 0;      ///< Gaussian, u and v [pixels]
  double disparity_sigma = 0;  ///< Gaussian [pixels]
  double outliers = 0;         ///< share with a pixel anywhere in the image
  double depth_outliers = 0;   ///< share with a depth off by 0.3 to 1 m
  double depthless = 0;        ///< share without depth
};

inline Pose random_pose(std::mt19937& rng, double metres, double radians) {
  std::normal_distribution<double> normal;
  const auto draw = [&] { return Eigen::Vector3d(normal(rng), normal(rng), normal(rng)); };
  Vector6d twist;
  twist << metres / std::sqrt(3) * draw(), radians / std::sqrt(3) * draw();
  return Pose::exp(twist);
}

/// A place that the camera sees at a random pixel, 0.7 to 4 m away.
inline Eigen::Vector3d visible_point(std::mt19937& rng, const Camera& camera,
                                     const Pose& T_world_camera) {
  std::uniform_real_distribution<double> u(0, camera.width - 1), v(0, camera.height - 1), z(0.7, 4);
  const double pu = u(rng), pv = v(rng);
  return T_world_camera * camera.unproject(pu, pv, z(rng));
}

/// True pixel and depth of p_camera, then noise. Sets u, v, depth of the observation.
/// Returns whether the pixel (first) and the depth (second) were made outliers.
template <typename Observation>
std::pair<bool, bool> observe(std::mt19937& rng, const Camera& camera,
                              const Eigen::Vector3d& p_camera, const Noise& noise, Observation& o) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  Eigen::Vector3d uvd = predict(camera, p_camera);
  uvd += Eigen::Vector3d(noise.pixel_sigma * normal(rng), noise.pixel_sigma * normal(rng),
                         noise.disparity_sigma * normal(rng));
  double depth = camera.bf() / uvd.z();
  const bool outlier = uniform(rng) < noise.outliers;
  if (outlier) uvd.head<2>() << uniform(rng) * camera.width, uniform(rng) * camera.height;
  const bool depth_outlier = uniform(rng) < noise.depth_outliers;
  if (depth_outlier) depth += 0.3 + 0.7 * uniform(rng);
  if (uniform(rng) < noise.depthless) depth = 0;
  o.u = static_cast<float>(uvd.x());
  o.v = static_cast<float>(uvd.y());
  o.depth = static_cast<float>(depth);
  return {outlier, depth_outlier && depth > 0};
}

struct PoseScene {
  Camera camera;
  Pose T_world_camera;
  std::vector<PoseObservation> observations;
  std::vector<std::uint8_t> outlier, depth_outlier;
};

inline PoseScene pose_scene(unsigned seed, int count, const Noise& noise) {
  std::mt19937 rng(seed);
  PoseScene scene;
  scene.T_world_camera = random_pose(rng, 2, 1);
  const Pose T_camera_world = scene.T_world_camera.inverse();
  for (int i = 0; i < count; ++i) {
    PoseObservation o;
    o.p_world = visible_point(rng, scene.camera, scene.T_world_camera);
    const auto [outlier, depth_outlier] =
        observe(rng, scene.camera, T_camera_world * o.p_world, noise, o);
    scene.observations.push_back(o);
    scene.outlier.push_back(outlier);
    scene.depth_outlier.push_back(depth_outlier);
  }
  return scene;
}

struct BundleScene {
  BundleProblem problem;  ///< guesses off the truth
  std::vector<Pose> T_world_camera;
  std::vector<Eigen::Vector3d> points;
  std::vector<std::uint8_t> outlier, depth_outlier;  ///< per observation
};

struct BundleShape {
  int free_poses = 15, fixed_poses = 20, points = 2500;
  double observations_per_point = 4.8;
  double pose_error = 0.01;   ///< of the guesses [m, rad]
  double point_error = 0.02;  ///< of the guesses [m]
};

/// Cameras side by side along a short path, all looking at one cloud; fixed ones come last.
inline BundleScene bundle_scene(unsigned seed, const BundleShape& shape, const Noise& noise) {
  std::mt19937 rng(seed);
  std::normal_distribution<double> normal;
  BundleScene scene;
  BundleProblem& problem = scene.problem;
  const int poses = shape.free_poses + shape.fixed_poses;
  for (int i = 0; i < poses; ++i) {
    const Pose step(Eigen::Quaterniond::Identity(), {0.02 * i, 0, 0});
    scene.T_world_camera.push_back(step * random_pose(rng, 0.1, 0.05));
    const bool fixed = i >= shape.free_poses;
    problem.pose_fixed.push_back(fixed);
    problem.T_world_camera.push_back(
        fixed ? scene.T_world_camera[i]
              : scene.T_world_camera[i] * random_pose(rng, shape.pose_error, shape.pose_error));
  }
  std::uniform_int_distribution<int> any_pose(0, poses - 1);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int k = 0; k < shape.points; ++k) {
    const int first = any_pose(rng);
    const Eigen::Vector3d p = visible_point(rng, problem.camera, scene.T_world_camera[first]);
    scene.points.push_back(p);
    problem.points.push_back(p + shape.point_error *
                                     Eigen::Vector3d(normal(rng), normal(rng), normal(rng)));
    const int wanted = static_cast<int>(shape.observations_per_point + uniform(rng));
    for (int j = 0, seen = 0; j < poses && seen < wanted; ++j) {
      const int pose = (first + j) % poses;
      const Eigen::Vector3d p_camera = scene.T_world_camera[pose].inverse() * p;
      if (p_camera.z() < 0.3) continue;
      const Eigen::Vector2d uv = problem.camera.project(p_camera);
      if (!problem.camera.contains(uv.x(), uv.y())) continue;
      BundleObservation o;
      o.pose = static_cast<std::uint32_t>(pose);
      o.point = static_cast<std::uint32_t>(k);
      const auto [outlier, depth_outlier] = observe(rng, problem.camera, p_camera, noise, o);
      problem.observations.push_back(o);
      scene.outlier.push_back(outlier);
      scene.depth_outlier.push_back(depth_outlier);
      ++seen;
    }
  }
  return scene;
}

}  // namespace stillmap::synthetic
