// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

namespace stillmap::test {

/// Two views of an ideal pinhole camera of 640 x 480 pixels with a small motion between them.
struct TwoViews {
  double f = 525, cx = 320, cy = 240;
  Eigen::Matrix3d R =
      Eigen::AngleAxisd(0.02, Eigen::Vector3d(0.2, 1, 0.1).normalized()).toRotationMatrix();
  Eigen::Vector3d t{0.08, -0.02, 0.03};  ///< p_second = R * p_first + t [m]

  cv::Point2f project(const Eigen::Vector3d& p) const {
    return {static_cast<float>(f * p.x() / p.z() + cx), static_cast<float>(f * p.y() / p.z() + cy)};
  }
  cv::Point2f in_first(const Eigen::Vector3d& p) const { return project(p); }
  cv::Point2f in_second(const Eigen::Vector3d& p) const { return project(R * p + t); }

  /// Returns the fundamental matrix of K and the motion (Hartley and Zisserman, 9.2).
  cv::Matx33d F() const {
    Eigen::Matrix3d K, t_cross;
    K << f, 0, cx, 0, f, cy, 0, 0, 1;
    t_cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
    const Eigen::Matrix3d m = K.inverse().transpose() * t_cross * R * K.inverse();
    return {m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2)};
  }

  /// Returns points at 1 to 4 m depth all over the first image, 40 pixels from its border.
  std::vector<Eigen::Vector3d> cloud(int count, std::uint64_t seed) const {
    return points(count, seed, 1, 4);
  }
  /// Returns such points on the plane at 2 m depth.
  std::vector<Eigen::Vector3d> plane(int count, std::uint64_t seed) const {
    return points(count, seed, 2, 2);
  }
  Eigen::Vector3d ahead(double u, double v, double z) const {
    return {(u - cx) / f * z, (v - cy) / f * z, z};
  }

 private:
  std::vector<Eigen::Vector3d> points(int count, std::uint64_t seed, double near,
                                      double far) const {
    cv::RNG rng(seed);
    std::vector<Eigen::Vector3d> all;
    for (int i = 0; i < count; ++i) {
      const double u = rng.uniform(40.0, 600.0), v = rng.uniform(40.0, 440.0);
      all.push_back(ahead(u, v, near + (far - near) * rng.uniform(0.0, 1.0)));
    }
    return all;
  }
};

}  // namespace stillmap::test
