// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/geometry/trajectory.hpp"

#include <filesystem>
#include <fstream>
#include <iomanip>
#include <numbers>
#include <random>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using Twist = Eigen::Matrix<double, 6, 1>;

double distance(const Pose& a, const Pose& b) { return (a.inverse() * b).log().norm(); }

TEST(Pose, LogInvertsExp) {
  std::mt19937 rng(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const double scale : {1e-12, 1e-6, 1e-3, 0.5, 1.7}) {
    for (int i = 0; i < 50; ++i) {
      const Twist twist = scale * Twist::NullaryExpr([&](Eigen::Index) { return uniform(rng); });
      EXPECT_LT((Pose::exp(twist).log() - twist).norm(), 1e-9 * (1 + scale));
    }
  }
}

TEST(Pose, ExpOfAQuarterTurnAboutZMovesAlongTheArc) {
  Twist twist;
  twist << 1, 0, 0, 0, 0, M_PI / 2;  // Unit forward speed during a quarter turn.
  const Pose T = Pose::exp(twist);
  EXPECT_LT((T.translation() - Eigen::Vector3d(2 / M_PI, 2 / M_PI, 0)).norm(), 1e-12);
  EXPECT_LT((T * Eigen::Vector3d(1, 0, 0) - T.translation() - Eigen::Vector3d(0, 1, 0)).norm(),
            1e-12);
}

TEST(Pose, InverseAndAngle) {
  Twist twist;
  twist << 0.3, -2, 1, 0.2, 0.1, -0.7;
  const Pose T = Pose::exp(twist);
  EXPECT_LT(distance(T * T.inverse(), Pose()), 1e-12);
  EXPECT_NEAR(T.angle(), twist.tail<3>().norm(), 1e-12);
}

TEST(Pose, InterpolationIsExactAtBothEndsAndTheMiddle) {
  const Pose a(so3_exp({0, 0, 0.2}), {0, 0, 0}), b(so3_exp({0, 0, 0.6}), {1, 0, 0});
  EXPECT_LT(distance(interpolate(a, b, 0), a), 1e-12);
  EXPECT_LT(distance(interpolate(a, b, 1), b), 1e-12);
  EXPECT_LT(distance(interpolate(a, b, 0.5), Pose(so3_exp({0, 0, 0.4}), {0.5, 0, 0})), 1e-12);
}

TEST(Camera, UnprojectInvertsProject) {
  const Camera camera;
  const Eigen::Vector3d p(0.3, -0.4, 2.5);
  const Eigen::Vector2d uv = camera.project(p);
  EXPECT_LT((camera.unproject(uv.x(), uv.y(), p.z()) - p).norm(), 1e-12);
}

TEST(AlignPoints, RecoversAKnownMotionExactlyAndRefusesReflections) {
  std::mt19937 rng(2);
  std::normal_distribution<double> normal;
  Eigen::Matrix3Xd b =
      Eigen::Matrix3Xd::NullaryExpr(3, 20, [&](auto, auto) { return normal(rng); });
  const Pose truth(so3_exp({0.4, -1.0, 2.0}), {1, 2, 3});
  Eigen::Matrix3Xd a(3, 20);
  for (int i = 0; i < 20; ++i) a.col(i) = truth * Eigen::Vector3d(b.col(i));
  EXPECT_LT(distance(align_points(a, b), truth), 1e-9);

  b.row(2).setZero();  // A mirrored plane: the best fit must still be a rotation.
  a = b;
  a.row(0) *= -1;
  EXPECT_NEAR(align_points(a, b).rotation().determinant(), 1, 1e-9);
}

class TrajectoryFile : public ::testing::Test {
 protected:
  std::filesystem::path file_ = test::own_path("trajectory.txt");
  void write(const std::string& text) { std::ofstream(file_) << text; }
  std::string error() {
    try {
      read_trajectory(file_);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  }
  void TearDown() override { std::filesystem::remove(file_); }
};

TEST_F(TrajectoryFile, RoundTrip) {
  const Trajectory written{{1.5, Pose(so3_exp({0.1, 0.2, 0.3}), {1, 2, 3})},
                           {2.5, Pose(so3_exp({3.1, 0, 0}), {-4, 5, 6e-7})}};
  write_trajectory(file_, written);
  const Trajectory read = read_trajectory(file_);
  ASSERT_EQ(read.size(), 2u);
  for (int i : {0, 1}) {
    EXPECT_NEAR(read[i].timestamp, written[i].timestamp, 1e-6);
    EXPECT_LT(distance(read[i].T_world_camera, written[i].T_world_camera), 1e-8);
  }
}

TEST_F(TrajectoryFile, SortsByStampAndSkipsComments) {
  write("# a comment\n2 1 0 0 0 0 0 1\n\n1,0,0,0,0,0,0,1\r\n");
  const Trajectory read = read_trajectory(file_);
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[0].timestamp, 1);
  EXPECT_EQ(read[1].T_world_camera.translation().x(), 1);
}

TEST_F(TrajectoryFile, LinesWithoutAPoseAreSkippedAndCounted) {
  write("1 0 0 0 0 0 0 1\n2 nan nan nan nan nan nan nan\n3 0 0 0 0 0 0 0\n4 0 0 0 0 0 0 1\n");
  ::testing::internal::CaptureStderr();
  EXPECT_EQ(read_trajectory(file_).size(), 2u);
  EXPECT_NE(::testing::internal::GetCapturedStderr().find("left out: 2 of 4 poses"),
            std::string::npos);
}

TEST_F(TrajectoryFile, MayBeUtf16) {
  std::string text = "\xFF\xFE";
  for (const char c : std::string("1 0 0 0 0 0 0 1\r\n")) text += {c, '\0'};
  write(text);
  EXPECT_EQ(read_trajectory(file_).size(), 1u);
}

TEST_F(TrajectoryFile, PositionsWithoutRotationsAreRead) {
  write("timestamp,x,y,z\n1.5,1,2,3\n2.5,4,5,6\n");
  const Trajectory read = read_trajectory(file_);
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[1].timestamp, 2.5);
  EXPECT_LT(distance(read[1].T_world_camera, Pose(so3_exp({0, 0, 0}), {4, 5, 6})), 1e-12);
  write("1 1 2 3 0 0 0 1\n2 4 5 6\n");
  EXPECT_NE(error().find(":2: expected 8 numbers"), std::string::npos) << "a truncated line";
}

TEST_F(TrajectoryFile, MatricesOfReplicaAreAt30Hz) {
  write("1 0 0 5 0 0 -1 6 0 1 0 7 0 0 0 1\n1 0 0 5 0 1 0 6 0 0 1 8 0 0 0 1\n");
  const Trajectory read = read_trajectory(file_);
  ASSERT_EQ(read.size(), 2u);
  EXPECT_NEAR(read[1].timestamp, 1 / 30.0, 1e-12);
  EXPECT_LT(
      distance(read[0].T_world_camera, Pose(so3_exp({std::numbers::pi / 2, 0, 0}), {5, 6, 7})),
      1e-9);
  write("1 0 0 5 0 9 0 6 0 0 1 8 0 0 0 1\n");
  EXPECT_NE(error().find(":1: has 16 numbers that are not the matrix"), std::string::npos)
      << error();
}

TEST_F(TrajectoryFile, PosesOfArkitAreThoseOfTheWorldInTheCamera) {
  file_.replace_extension(".traj");
  const Pose pose(so3_exp({0.1, -0.2, 0.3}), {1, 2, 3});
  const Pose T = pose.inverse();
  const Eigen::AngleAxisd turn(T.quaternion());
  const Eigen::Vector3d w = turn.angle() * turn.axis();
  std::ofstream(file_) << std::setprecision(12) << "6792.023 " << w.transpose() << ' '
                       << T.translation().transpose() << '\n';
  const Trajectory read = read_trajectory(file_);
  ASSERT_EQ(read.size(), 1u);
  EXPECT_NEAR(read[0].timestamp, 6792.023, 1e-9);
  EXPECT_LT(distance(read[0].T_world_camera, pose), 1e-9);
}

TEST_F(TrajectoryFile, MayBeginWithAByteOrderMark) {
  write("\xEF\xBB\xBF# a comment\n1 0 0 0 0 0 0 1\n");
  EXPECT_EQ(read_trajectory(file_).size(), 1u);
}

TEST_F(TrajectoryFile, ErrorsNameTheLine) {
  write("1 0 0 0 0 0 0 1\n2 0 0 0 0 0 1\n");
  EXPECT_NE(error().find(":2: expected 8 numbers"), std::string::npos) << error();
  write("1 0 0 zero 0 0 0 1\n");
  EXPECT_NE(error().find("'zero' is not a number"), std::string::npos) << error();
  write("1 0 0 nan 0 0 0 1\n2 0 0 0 0 0 0 0\n");
  EXPECT_NE(error().find("contains no pose: 2 lines with numbers that are not finite"),
            std::string::npos)
      << error();
  write("1 0 0 0 .5 .5 .5 .45\n2 0 0 0 12 30 18 4\n");
  EXPECT_NE(error().find(":2: the quaternion has the norm 37.2 instead"), std::string::npos)
      << error();
  std::filesystem::remove(file_);
  std::filesystem::create_directory(file_);
  EXPECT_NE(error().find("is a folder\n  fix: name the trajectory in it: groundtruth.txt"),
            std::string::npos)
      << error();
  std::filesystem::remove(file_);
  write("# nothing\n");
  EXPECT_NE(error().find("contains no pose"), std::string::npos) << error();
}

TEST_F(TrajectoryFile, OtherFormatsAreReadAsWhatTheyAreOrRefused) {
  const Pose pose(Eigen::Quaterniond(0.8, 0.6, 0, 0), {1, 2, 3});
  const auto expect_pose = [&](const std::string& format) {
    const Trajectory read = read_trajectory(file_);
    ASSERT_EQ(read.size(), 1u) << format;
    EXPECT_NEAR(read[0].timestamp, 1403636579.758555, 1e-6) << format;
    EXPECT_LT(distance(read[0].T_world_camera, pose), 1e-9) << format;
  };
  write(
      "#timestamp, p_x, p_y, p_z, q_w, q_x, q_y, q_z, v, bw, ba\n"
      "1403636579758555392,1,2,3,0.8,0.6,0,0,9,9,9,9,9,9,9,9,9\n");
  expect_pose("ground truth of EuRoC");
  write("1403636579758555392, 1, 2, 3, 0.8, 0.6, 0, 0\n");
  expect_pose("EuRoC without velocities");
  write("1403636579758555392.000000 1 2 3 0.6 0 0 0.8\n");
  expect_pose("EuRoC as ORB-SLAM3 writes it");
  write("1403636579758555392,1,2,3,0.8,0.6,0,0,0.1,0.2,0.3,\n");
  expect_pose("VINS-Fusion");
  write("#timestamp x y z qx qy qz qw id\n1403636579.758555392 1 2 3 0.6 0 0 0.8 7\n");
  expect_pose("RTAB-Map with the ids of nodes");
  write("1 0 0 5 0 1 0 6 0 0 1 7\n");
  EXPECT_NE(error().find("KITTI"), std::string::npos) << error();
  write("1 0 0 0 0 0 0 1 9\n");
  EXPECT_NE(error().find("found 9"), std::string::npos) << error();
}

TEST_F(TrajectoryFile, TheUnitOfTheTimestampsIsThatOfTheFile) {
  write(
      "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],"
      "q_RS_z []\n0,1,2,3,0.8,0.6,0,0\n33333333,1,2,3,0.8,0.6,0,0\n");
  EXPECT_NEAR(read_trajectory(file_).at(1).timestamp, 0.033333333, 1e-12) << "by its heading";
  EXPECT_NEAR(read_trajectory(file_)[1].T_world_camera.quaternion().x(), 0.6, 1e-12);
  write("1000000000000 1 2 3 0 0 0 1\n1000033333333 1 2 3 0 0 0 1\n");
  EXPECT_NEAR(read_trajectory(file_).at(0).timestamp, 1000, 1e-6) << "by its largest number";
  for (const char* stamps :
       {"1305031229500 {0}\n1305031229540 {0}\n", "1305031229500000 {0}\n1305031229540000 {0}\n"}) {
    write(fmt::format(fmt::runtime(stamps), "1 2 3 0 0 0 1"));
    EXPECT_NEAR(read_trajectory(file_).at(1).timestamp, 1305031229.54, 1e-6) << "since 1970";
  }
}

TEST_F(TrajectoryFile, AHeadingTellsTheOrderOfTheQuaternion) {
  write("#timestamp,tx,ty,tz,qw,qx,qy,qz\n1.5,0,0,0,0.8,0.6,0,0\n");
  EXPECT_NEAR(read_trajectory(file_).at(0).T_world_camera.quaternion().x(), 0.6, 1e-12);
  write("# timestamp tx ty tz qx qy qz qw\n1.5 0 0 0 0.6 0 0 0.8\n");
  EXPECT_NEAR(read_trajectory(file_).at(0).T_world_camera.quaternion().x(), 0.6, 1e-12);
}

TEST_F(TrajectoryFile, TwoPlacesAtOneTimeAreRefused) {
  write("1 0 0 0 0 0 0 1\n1 0.01 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n");
  EXPECT_EQ(read_trajectory(file_).size(), 3U) << "nearly the same place";
  write("1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n1 0.5 0 0 0 0 0 1\n");
  EXPECT_NE(error().find("two poses at 1.000000 s, 0.50 m apart"), std::string::npos) << error();
}

TEST_F(TrajectoryFile, AFileThatCannotBeWrittenIsAnError) {
  EXPECT_THROW(write_trajectory("/nonexistent/folder/t.txt", {}), Error);
}

}  // namespace
}  // namespace stillmap
