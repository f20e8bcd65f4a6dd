// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/orb_extractor.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/motion/frame.hpp"

#include <cmath>
#include <memory>
#include <vector>

namespace stillmap {

/// A camera with rolling shutters that turns and moves in front of a slanted plane with points.
struct RollingCamera {
  Camera camera;
  ShutterTiming timing;
  std::vector<Eigen::Vector3d> points;

  RollingCamera(const Camera& with, const ShutterTiming& exposed) : camera(with), timing(exposed) {
    for (double v = 60; v < camera.height - 60; v += 18) {
      for (double u = 80; u < camera.width - 80; u += 24) points.push_back(on_plane(Pose(), u, v));
    }
  }

  /// The plane n . p = 2 m in the world.
  static Eigen::Vector3d normal() { return Eigen::Vector3d(0.5, 0.3, 1).normalized(); }

  Eigen::Vector3d on_plane(const Pose& T_world_camera, double u, double v) const {
    const Eigen::Vector3d ray = T_world_camera.quaternion() * camera.unproject(u, v, 1);
    const double z = (2 - normal().dot(T_world_camera.translation())) / normal().dot(ray);
    return T_world_camera.translation() + z * ray;
  }

  /// T_world_camera at time t [s]: turns of up to 50 degrees per second about three axes.
  static Pose pose(double t) {
    Eigen::Matrix<double, 6, 1> xi;
    xi << 0.05 * std::sin(3 * t), 0.05 * std::cos(2 * t), 0.02 * t,  //
        0.12 * std::sin(7 * t), 0.12 * std::cos(6 * t), 0.1 * std::sin(5 * t + 1);
    return Pose::exp(xi);
  }
  static Eigen::Matrix<double, 6, 1> twist(double t) {
    constexpr double kStep = 1e-4;
    return (pose(t - kStep).inverse() * pose(t + kStep)).log() / (2 * kStep);
  }

  double row_time(double v) const { return (v / camera.height - 0.5) * timing.readout; }

  /// Keypoint of a point in an image recorded at time t.
  Keypoint recorded(const Eigen::Vector3d& p_world, double t) const {
    Eigen::Vector2d uv(0, camera.height / 2.0);
    for (int i = 0; i < 10; ++i)
      uv = camera.project(pose(t + row_time(uv.y())).inverse() * p_world);
    Keypoint k;
    k.u = static_cast<float>(uv.x());
    k.v = static_cast<float>(uv.y());
    return k;
  }

  /// The depth image with timestamp t.
  cv::Mat1f depth(double t) const {
    cv::Mat1f image(camera.height, camera.width);
    for (int v = 0; v < image.rows; ++v) {
      const Pose T_world_camera = pose(t + timing.depth_delay + row_time(v));
      const Pose T_camera_world = T_world_camera.inverse();
      for (int u = 0; u < image.cols; ++u)
        image(v, u) = static_cast<float>((T_camera_world * on_plane(T_world_camera, u, v)).z());
    }
    return image;
  }

  /// The frame whose images both have timestamp t. Keypoint i shows point i; those outside the
  /// image have weight 0.
  std::shared_ptr<Frame> frame(std::size_t index, double t) const {
    auto image = std::make_shared<RgbdFrame>();
    image->index = index;
    image->timestamp = t;
    image->depth = depth(t);
    auto features = std::make_shared<Features>();
    auto result = std::make_shared<Frame>();
    for (const Eigen::Vector3d& p : points) {
      Keypoint k = recorded(p, t);
      const bool inside = camera.contains(k.u, k.v, 1);
      if (inside) k.depth = depth_at(image->depth, k.u, k.v, {});
      features->keypoints.push_back(k);
      result->evidence.weight.push_back(inside ? 1 : 0);
    }
    features->descriptors.resize(features->keypoints.size());
    result->image = image;
    result->recorded_features = features;
    result->features = features;
    return result;
  }
};

}  // namespace stillmap
