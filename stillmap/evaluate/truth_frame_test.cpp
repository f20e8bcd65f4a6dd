// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/truth_frame.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/evaluate/trajectory_error.hpp"

#include <cmath>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

std::filesystem::path matrix_file(const Pose& T, double scale) {
  const Eigen::Matrix3d A = scale * T.rotation();
  std::string text = "# T_body_camera\n";
  for (int r = 0; r < 3; ++r)
    text += fmt::format("{} {} {} {}\n", A(r, 0), A(r, 1), A(r, 2), T.translation()(r));
  const std::filesystem::path file = test::own_path("frame.txt");
  write_file(file, text + "0 0 0 1\n");
  return file;
}

std::string message_for(const std::string& text) {
  const std::filesystem::path file = test::own_path("bad.txt");
  write_file(file, text);
  try {
    read_truth_frame(file.string());
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

/// A body that turns while it moves, so that a lever arm matters.
Trajectory turning_body() {
  Trajectory body;
  for (int i = 0; i < 60; ++i) {
    const double s = 0.05 * i;
    body.push_back({0.03 * i, Pose(so3_exp({0.5 * std::sin(s), s, 0}), {std::cos(s), 0, s})});
  }
  return body;
}

TEST(TruthFrame, MovesTheTruthToTheCamera) {
  const Pose T_body_camera(so3_exp({0.4, -1, 2}), {0.3, -0.2, 0.1});
  const Trajectory body = turning_body();
  Trajectory camera = body;
  for (StampedPose& pose : camera) pose.T_world_camera = pose.T_world_camera * T_body_camera;
  const TruthFrame frame = read_truth_frame(matrix_file(T_body_camera, 1.06).string());
  EXPECT_GT(relative_pose_error(body, camera).translation.rmse, 0.05);
  EXPECT_LT(relative_pose_error(in_camera_frame(body, frame), camera).translation.max, 1e-9);
}

TEST(TruthFrame, BonnKeepsDistancesAndIsRigid) {
  const TruthFrame frame = read_truth_frame("bonn");
  EXPECT_NEAR(frame.T_body_camera.translation().norm(), std::hypot(0.0113, 0.0098, 0.0111), 1e-12);
  const Trajectory body = turning_body(), camera = in_camera_frame(body, frame);
  for (std::size_t i = 1; i < body.size(); ++i) {
    const Pose moved = camera[0].T_world_camera.inverse() * camera[i].T_world_camera;
    const Pose expected = body[0].T_world_camera.inverse() * body[i].T_world_camera;
    EXPECT_NEAR(moved.angle(), expected.angle(), 1e-9);
  }
}

TEST(TruthFrame, RejectsTransformsThatAreNotRigid) {
  EXPECT_NE(message_for("1 2 3").find("has 3 numbers instead of 16"), std::string::npos);
  EXPECT_NE(message_for("1 0 0 0 0 1 0 0 0 0 one 0 0 0 0 1").find("'one' is not a number"),
            std::string::npos);
  for (const char* text : {"1 0 0 0 0 1 0 0 0 0 -1 0 0 0 0 1", "1 0 0 0 0 1 0 0 0 0 2 0 0 0 0 1",
                           "1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1"}) {
    EXPECT_NE(message_for(text).find("is not a rigid transform"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace stillmap
