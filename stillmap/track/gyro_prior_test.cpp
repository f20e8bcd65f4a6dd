// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/gyro_prior.hpp"

#include "stillmap/track/pose_estimate.hpp"

#include <memory>
#include <numbers>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using Eigen::Vector3d;

constexpr double kInterval = 1.0 / 30;  // of the frames [s]

/// A camera that turns, with an IMU mounted on it.
struct TurningCamera {
  Imu imu = [] {
    Imu mounted = find_imu("d435i");
    mounted.T_camera_imu = Pose(so3_exp({0.4, -1.1, 0.7}), {0.02, 0, 0.01});
    return mounted;
  }();
  Vector3d bias = {0.015, -0.01, 0.02};                      // [rad/s]
  Eigen::Matrix3d wrong_axes = Eigen::Matrix3d::Identity();  // applied to the measurements
  /// Angular velocity of the camera in its own frame [rad/s].
  static Vector3d rate(double time) { return {0.5 * std::cos(2 * time), 0.4, -0.3 * time}; }

  RgbdFrame frame(int index) const {
    RgbdFrame frame;
    frame.timestamp = index * kInterval;
    for (int i = -60; i <= 1; ++i) {
      const double time = frame.timestamp + i / 200.0;
      const Vector3d measured = imu.T_camera_imu.quaternion().conjugate() * rate(time) + bias;
      frame.imu.push_back({.timestamp = time, .angular_velocity = wrong_axes * measured});
    }
    return frame;
  }
  /// Rotation of the camera between two frames.
  static Pose motion(int index) {
    constexpr int kSteps = 100;
    Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
    for (int i = 0; i < kSteps; ++i)
      q = q * so3_exp(rate((index - 1 + (i + 0.5) / kSteps) * kInterval) * kInterval / kSteps);
    return {q, Vector3d(0.01, 0, 0)};
  }
  /// Tracks frames from 1 on with their true motions. Returns the last prior.
  std::optional<MotionPrior> track(GyroPrior& gyro, int frames) const {
    const Matrix6d covariance = 1e-8 * Matrix6d::Identity();
    std::optional<MotionPrior> prior;
    for (int i = 1; i <= frames; ++i) {
      prior = gyro.motion(frame(i), (i - 1) * kInterval, covariance);
      gyro.compare(frame(i), motion(i), covariance);
    }
    return prior;
  }
};

TEST(GyroPrior, PredictsTheRotationOfTheCameraAndLearnsTheBias) {
  const TurningCamera camera;
  GyroPrior gyro(camera.imu);
  const auto first = camera.track(gyro, 1);
  ASSERT_TRUE(first);
  const auto error = [](const MotionPrior& prior, int index) {
    return (prior.T_previous_camera.inverse() * TurningCamera::motion(index)).angle();
  };
  EXPECT_GT(error(*first, 1), 5e-4);
  EXPECT_LT(error(*first, 1), 2 * camera.bias.norm() * kInterval);
  const auto later = camera.track(gyro, 90);
  ASSERT_TRUE(later);
  EXPECT_LT(error(*later, 90), 1e-4);
  EXPECT_TRUE((later->information.topRows<3>().isZero())) << "translations are not known";
  EXPECT_GT(later->information(5, 5), 1 / (0.002 * 0.002));
  EXPECT_FALSE(gyro.finding());
}

TEST(GyroPrior, AGyroscopeWithOtherAxesIsLeftOut) {
  TurningCamera camera;
  camera.wrong_axes << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  GyroPrior gyro(camera.imu);
  EXPECT_FALSE(camera.track(gyro, 50)) << "until its orientation is known";
  ASSERT_TRUE(gyro.finding());
  EXPECT_EQ(gyro.finding()->code, "gyroscope-unlike");
}

TEST(GyroPrior, AGyroscopeThatIsMountedOtherwiseIsUsedAsTheImagesShow) {
  const TurningCamera camera;
  Imu said = camera.imu;
  said.T_camera_imu = Pose(Eigen::Quaterniond::Identity(), camera.imu.T_camera_imu.translation());
  GyroPrior gyro(said);
  std::optional<Imu> mounted;
  std::optional<MotionPrior> prior;
  const Matrix6d covariance = 1e-8 * Matrix6d::Identity();
  for (int i = 1; i <= 120; ++i) {
    prior = gyro.motion(camera.frame(i), (i - 1) * kInterval, covariance);
    const auto found = gyro.compare(camera.frame(i), TurningCamera::motion(i), covariance);
    if (!found) continue;
    EXPECT_FALSE(mounted) << "once";
    mounted = found;
  }
  ASSERT_TRUE(mounted);
  EXPECT_LT((mounted->T_camera_imu.inverse() * camera.imu.T_camera_imu).angle(), 1e-3);
  EXPECT_EQ(mounted->T_camera_imu.translation(), camera.imu.T_camera_imu.translation());
  ASSERT_TRUE(prior);
  EXPECT_LT((prior->T_previous_camera.inverse() * TurningCamera::motion(120)).angle(), 2e-4);
  ASSERT_TRUE(gyro.finding());
  EXPECT_NE(gyro.finding()->fix.find("T_camera_imu: ["), std::string::npos);
  EXPECT_NEAR(gyro.finding()->evidence.at("angle_deg"), 78.1, 0.1);  // length of (0.4, -1.1, 0.7)
}

TEST(GyroPrior, AGyroscopeInDegreesPerSecondIsLeftOut) {
  TurningCamera camera;
  camera.wrong_axes *= 180 / std::numbers::pi;
  GyroPrior gyro(camera.imu);
  EXPECT_FALSE(camera.track(gyro, 60));
  EXPECT_TRUE(gyro.finding());
}

TEST(GyroPrior, WithoutSamplesThereIsNone) {
  const TurningCamera camera;
  GyroPrior without(std::nullopt), with(camera.imu);
  EXPECT_FALSE(without.motion(camera.frame(1), 0, Matrix6d::Zero()));
  RgbdFrame frame = camera.frame(1);
  EXPECT_FALSE(with.motion(frame, -1, Matrix6d::Zero())) << "before the first sample";
  frame.imu.clear();
  EXPECT_FALSE(with.motion(frame, 0, Matrix6d::Zero()));
}

/// Keypoints of two bodies, most of them of one that moves.
struct TwoBodies {
  TrackingModel model;
  Features features;
  std::vector<PointMatch> matches;
  Pose T_static{so3_exp({0, 0.002, 0}), {0, 0, 0}}, T_moving{so3_exp({0, 0.014, 0}), {0.03, 0, 0}};

  TwoBodies() {
    for (std::uint32_t i = 0; i < 300; ++i) {
      const bool moves = i % 20 < 11;
      const Vector3d p(-1.2 + 0.17 * (i % 15), -0.9 + 0.09 * (i / 15), 1.5 + 0.4 * (i % 11));
      const Vector3d q = (moves ? T_moving : T_static).inverse() * p;
      const Eigen::Vector2d uv = model.camera.project(q);
      features.keypoints.push_back({.u = static_cast<float>(uv.x()),
                                    .v = static_cast<float>(uv.y()),
                                    .depth = static_cast<float>(q.z())});
      matches.push_back({i, LandmarkId{}, p});
    }
  }
  Pose pose(const std::optional<PosePrior>& prior) const {
    return estimate_pose(model, features, Pose(), matches, 20, prior).value().T_world_camera;
  }
};

TEST(EstimatePose, APriorDecidesBetweenTwoMotions) {
  const TwoBodies bodies;
  EXPECT_LT((bodies.T_moving.inverse() * bodies.pose({})).translation().norm(), 1e-3);
  PosePrior prior{Pose(bodies.T_static.quaternion(), Vector3d::Zero())};
  prior.information.bottomRightCorner<3, 3>() = 1e6 * Eigen::Matrix3d::Identity();
  const Pose error = bodies.T_static.inverse() * bodies.pose(prior);
  EXPECT_LT(error.translation().norm(), 1e-3);
  EXPECT_LT(error.angle(), 1e-3);
}

TEST(EstimatePose, APriorOfAllDegreesOfFreedomNeedsAFewMatches) {
  TwoBodies bodies;
  PosePrior prior{bodies.T_static};
  prior.information.diagonal() << 1e5, 1e5, 1e5, 1e5, 1e5, 1e5;
  std::erase_if(bodies.matches,
                [](const PointMatch& m) { return m.keypoint % 20 >= 11 && m.keypoint % 60 >= 20; });
  const Pose error = bodies.T_static.inverse() * bodies.pose(prior);
  EXPECT_LT(error.translation().norm(), 1e-3) << "a fifth of the matches";
  std::erase_if(bodies.matches, [](const PointMatch& m) { return m.keypoint % 20 >= 11; });
  EXPECT_LT((bodies.T_moving.inverse() * bodies.pose(prior)).translation().norm(), 1e-3)
      << "no match";
}

TEST(EstimatePose, APriorThatHardlyAnyMatchFitsDoesNotDecide) {
  const TwoBodies bodies;
  PosePrior prior{Pose(so3_exp({0.1, -0.1, 0.2}), Vector3d::Zero())};
  prior.information.bottomRightCorner<3, 3>() = 1e6 * Eigen::Matrix3d::Identity();
  EXPECT_LT((bodies.T_moving.inverse() * bodies.pose(prior)).angle(), 0.01);
}

}  // namespace
}  // namespace stillmap
