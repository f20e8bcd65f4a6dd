// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/reading_doubts.hpp"

#include "stillmap/evaluate/truth_frame.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const TrajectoryNames kNames{"truth.txt", "estimate.txt", ""};

/// Returns a camera that moves and turns by some 20 degrees per second.
Trajectory turning() {
  Trajectory trajectory;
  for (int i = 0; i < 120; ++i) {
    const double t = i / 30.0;
    trajectory.push_back({t, Pose(so3_exp({0.3 * std::sin(t), 0.35 * t, 0.2 * std::cos(t)}),
                                  {std::cos(t), 0.1 * t, std::sin(t)})});
  }
  return trajectory;
}

/// Returns the same path in another world, with an error of its rotations [rad].
Trajectory estimated(const Trajectory& truth, double error) {
  const Pose T_other_world(so3_exp({1, -0.4, 0.7}), {1, 2, 3});
  Trajectory result = truth;
  for (std::size_t i = 0; i < result.size(); ++i) {
    const Eigen::Vector3d wobble(std::sin(2.0 * i), std::sin(3.0 * i), std::cos(5.0 * i));
    result[i].T_world_camera =
        T_other_world * result[i].T_world_camera * Pose(so3_exp(error * wobble), {0, 0, 0});
  }
  return result;
}

/// Returns the poses as they are read from a file with qw qx qy qz.
Trajectory misread(Trajectory trajectory) {
  for (auto& [stamp, T] : trajectory) {
    const Eigen::Quaterniond q = T.quaternion();
    T = Pose(Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()), T.translation());
  }
  return trajectory;
}

TEST(ReadingDoubts, NameTheFileWhoseQuaternionsBeginWithQw) {
  const Trajectory truth = turning(), estimate = estimated(truth, 0.002);
  EXPECT_THAT(reading_doubts(truth, misread(estimate), kNames),
              ElementsAre(AllOf(HasSubstr("if the quaternions of estimate.txt are read as qw qx"),
                                HasSubstr("$6,$7,$8,$5}' estimate.txt"))));
  EXPECT_THAT(reading_doubts(misread(truth), estimate, kNames),
              ElementsAre(HasSubstr("if the quaternions of truth.txt are read as qw qx")));
  EXPECT_THAT(reading_doubts(misread(truth), misread(estimate), kNames),
              ElementsAre(HasSubstr("if the quaternions of both files are read as qw qx")));
}

TEST(ReadingDoubts, NameAFrameThatTheTruthDoesNotHave) {
  const Trajectory camera = turning(), estimate = estimated(camera, 0.002);
  const TruthFrame bonn = read_truth_frame("bonn");
  const TrajectoryNames names{"truth.txt", "estimate.txt", "bonn"};
  EXPECT_THAT(reading_doubts(in_camera_frame(camera, bonn), estimate, names),
              ElementsAre(HasSubstr("without --truth-frame bonn; leave it out")));
  EXPECT_THAT(reading_doubts(camera, estimate, names), IsEmpty()) << "a truth of that frame";
}

TEST(ReadingDoubts, AreNotRaisedByErrorsOfTracking) {
  const Trajectory truth = turning();
  for (const double error : {0.0, 0.002, 0.05, 0.3})
    EXPECT_THAT(reading_doubts(truth, estimated(truth, error), kNames), IsEmpty()) << error;
}

TEST(ReadingDoubts, AreNotRaisedByATruthWithoutRotationsOrAShortOne) {
  const Trajectory estimate = estimated(turning(), 0.002);
  Trajectory positions = turning();
  for (auto& [stamp, T] : positions) T = Pose(Eigen::Quaterniond::Identity(), T.translation());
  EXPECT_THAT(reading_doubts(positions, estimate, kNames), IsEmpty());
  EXPECT_THAT(reading_doubts(positions, misread(estimate), kNames), IsEmpty());
  const Trajectory shorter(estimate.begin(), estimate.begin() + 20);
  EXPECT_THAT(reading_doubts(turning(), misread(shorter), kNames), IsEmpty());
}

}  // namespace
}  // namespace stillmap
