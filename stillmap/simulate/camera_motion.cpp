// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/camera_motion.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/simulate/path.hpp"
#include "stillmap/simulate/random.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include <fmt/ranges.h>

namespace stillmap {
namespace {

using Eigen::Vector3d;
using simulate::Path, simulate::Random;
constexpr double kTau = 2 * std::numbers::pi;
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kEyeHeight = 1.45;  // Height of a hand-held camera [m].

double wave(double seconds, double period, double phase = 0) {
  return std::sin(kTau * (seconds / period + phase));
}

Eigen::Quaterniond turn(double radians, const Vector3d& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(radians, axis));
}

/// Returns a rotation by roll, pitch and yaw in the camera frame [rad].
Eigen::Quaterniond turned(double roll, double pitch, double yaw) {
  return turn(yaw, Vector3d::UnitY()) * turn(pitch, Vector3d::UnitX()) *
         turn(roll, Vector3d::UnitZ());
}

}  // namespace

const std::vector<std::string>& camera_motion_names() {
  static const std::vector<std::string> kNames{"static", "xyz",    "halfsphere", "rpy",
                                               "loop",   "follow", "trolley"};
  return kNames;
}

Pose look_at(const Vector3d& position, const Vector3d& target) {
  Eigen::Matrix3d R;
  R.col(2) = (target - position).normalized();
  R.col(0) = R.col(2).cross(Vector3d::UnitZ()).normalized();
  R.col(1) = R.col(2).cross(R.col(0));
  return Pose(R, position);
}

double CameraMotion::Tremor::at(double seconds) const {
  double sum = 0;
  for (const Wave& w : waves) sum += w.amplitude * std::sin(w.frequency * seconds + w.phase);
  return sum;
}

CameraMotion::CameraMotion(const CameraMotionOptions& options, const Scene& scene)
    : options_(options),
      viewpoint_(scene.viewpoint),
      home_(look_at(scene.viewpoint.position, scene.viewpoint.target)),
      round_(scene.round),
      trolley_(scene.trolley) {
  const auto& names = camera_motion_names();
  if (std::find(names.begin(), names.end(), options.motion) == names.end()) {
    if (!std::filesystem::exists(options.motion))
      throw Error(
          fmt::format("'{}' is neither known nor a file", options.motion), "camera motion",
          fmt::format("take one of: {}, or the file of a trajectory", fmt::join(names, ", ")));
    recorded_ = simulate::read_path(options.motion);
    options_.shake_position = options_.shake_rotation = 0;
  }
  if (options.motion == "trolley") {
    if (!trolley_)
      throw Error("there is no trolley in this scene", "camera motion", "take the scene yard");
    constexpr double kMotors = 1.0 / 3;  // share of the shake of a hand
    options_.shake_position *= kMotors;
    options_.shake_rotation *= kMotors;
  }
  Random random(static_cast<std::uint64_t>(options.seed), 2);
  for (Tremor& tremor : tremor_) {
    double power = 0;
    for (auto& w : tremor.waves) {
      const double hertz = 0.5 * std::pow(12, random.uniform());
      w = {1 / hertz, kTau * hertz, random.uniform(0, kTau)};
      power += 0.5 * w.amplitude * w.amplitude;
    }
    for (auto& w : tremor.waves) w.amplitude /= std::sqrt(power);
  }
}

Pose CameraMotion::T_world_camera(double seconds) const {
  std::array<double, 6> shake{};
  for (std::size_t i = 0; i < 6; ++i) {
    shake[i] = tremor_[i].at(seconds) * (i < 3 ? options_.shake_position : options_.shake_rotation);
  }
  return steady(seconds * options_.speed) *
         Pose(turned(shake[3], shake[4], shake[5]), {shake[0], shake[1], shake[2]});
}

std::optional<double> CameraMotion::duration() const {
  if (!recorded_) return std::nullopt;
  return recorded_->duration() / options_.speed;
}

Pose CameraMotion::steady(double t) const {
  if (recorded_) return home_ * recorded_->at(t);
  if (options_.motion == "xyz") {
    const Vector3d offset(0.24 * wave(t, 5.3), 0.15 * wave(t, 7.1, 0.1), 0.2 * wave(t, 8.9, 0.05));
    return home_ *
           Pose(turned(0.025 * wave(t, 4.1), 0.05 * wave(t, 5.1), 0.09 * wave(t, 6.7)), offset);
  }
  if (options_.motion == "rpy") {
    const auto turns = turned(16 * kDegree * wave(t, 4.7), 14 * kDegree * wave(t, 5.9, 0.1),
                              24 * kDegree * wave(t, 7.7, 0.05));
    const Vector3d wrist(0.04 * wave(t, 3.9), 0.04 * wave(t, 4.9), 0.03 * wave(t, 5.7));
    return home_ *
           // Rotation about the wrist behind the camera.
           Pose(turns, wrist + turns * Vector3d(0, 0, 0.1));
  }
  if (options_.motion == "halfsphere") return half_sphere(t);
  if (options_.motion == "loop") return loop(t);
  if (options_.motion == "follow") return follow(t);
  if (options_.motion == "trolley") return Pose(home_.quaternion(), trolley_->at(t));
  return home_;
}

Pose CameraMotion::half_sphere(double t) const {
  constexpr double kRadius = 0.7;  // meters
  const Vector3d view = viewpoint_.target - viewpoint_.position;
  const Vector3d center = viewpoint_.position + kRadius * view.normalized();
  const double azimuth = std::atan2(-view.y(), -view.x()) + 42 * kDegree * wave(t, 9.1);
  const double elevation = (13 + 17 * wave(t, 5.7, 0.9)) * kDegree;
  const Vector3d out(std::cos(elevation) * std::cos(azimuth),
                     std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
  return look_at(center + kRadius * out, center);
}

Pose CameraMotion::loop(double t) const {
  const Path path(round_);
  const double arc = kCarriedSpeed * t;
  const Eigen::Vector2d p = path.at(arc).cast<double>(), h = path.heading(arc).cast<double>();
  const Vector3d position(p.x(), p.y(), kEyeHeight);
  return look_at(position, position + Vector3d(h.x(), h.y(), -0.22)) *
         Pose(turned(0, 0, 12 * kDegree * wave(t, 11)), Vector3d::Zero());
}

Pose CameraMotion::follow(double t) const {
  constexpr double kChest = 1.2;  // meters
  const Path path(round_);
  const double arc = kCarriedSpeed * t;
  const Eigen::Vector2d p = path.at(arc).cast<double>(),
                        q = path.at(arc + kCompanionDistance).cast<double>();
  return look_at({p.x(), p.y(), kEyeHeight}, {q.x(), q.y(), kChest});
}

}  // namespace stillmap
