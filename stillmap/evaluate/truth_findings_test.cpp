// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/truth_findings.hpp"

#include "stillmap/evaluate/truth_frame.hpp"

#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const TrajectoryNames kNames{"truth.txt", "estimate.txt", ""};

std::vector<std::string> texts(const Trajectory& truth, const Trajectory& estimate,
                               const TrajectoryNames& names, bool scale_is_known = true) {
  return texts_of(truth_findings(truth, estimate, names, scale_is_known));
}

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

TEST(TruthFindings, NameTheFileWhoseQuaternionsBeginWithQw) {
  const Trajectory truth = turning(), estimate = estimated(truth, 0.002);
  EXPECT_THAT(texts(truth, misread(estimate), kNames),
              ElementsAre(AllOf(HasSubstr("if the quaternions of estimate.txt are read as qw qx"),
                                HasSubstr("$6,$7,$8,$5}' estimate.txt"))));
  EXPECT_THAT(texts(misread(truth), estimate, kNames),
              ElementsAre(HasSubstr("if the quaternions of truth.txt are read as qw qx")));
  EXPECT_THAT(texts(misread(truth), misread(estimate), kNames),
              ElementsAre(HasSubstr("if the quaternions of both files are read as qw qx")));
}

TEST(TruthFindings, NameAFrameThatTheTruthDoesNotHave) {
  const Trajectory camera = turning(), estimate = estimated(camera, 0.002);
  const TruthFrame bonn = read_truth_frame("bonn");
  const TrajectoryNames names{"truth.txt", "estimate.txt", "bonn"};
  EXPECT_THAT(texts(in_camera_frame(camera, bonn), estimate, names),
              ElementsAre(HasSubstr("without --truth-frame bonn; leave it out")));
  EXPECT_THAT(texts(camera, estimate, names), IsEmpty()) << "a truth of that frame";
}

TEST(TruthFindings, AreNotRaisedByErrorsOfTracking) {
  const Trajectory truth = turning();
  for (const double error : {0.0, 0.002, 0.05})
    EXPECT_THAT(texts(truth, estimated(truth, error), kNames), IsEmpty()) << error;
}

Trajectory inverted(Trajectory trajectory) {
  for (auto& [stamp, T] : trajectory) T = T.inverse();
  return trajectory;
}

TEST(TruthFindings, NameInvertedPoses) {
  const Trajectory truth = turning(), estimate = estimated(truth, 0.002);
  EXPECT_THAT(texts(truth, inverted(estimate), kNames),
              ElementsAre(AllOf(HasSubstr("if the poses of estimate.txt are inverted; write T_"),
                                HasSubstr("to estimate.txt"))));
  EXPECT_THAT(texts(inverted(truth), estimate, kNames),
              ElementsAre(HasSubstr("if the poses of truth.txt are inverted")));
}

TEST(TruthFindings, NeverNameTheOwnEstimateAndOnlyReadingsThatAgree) {
  const Trajectory truth = turning(), estimate = estimated(truth, 0.002);
  TrajectoryNames names = kNames;
  names.estimate_is_own = true;
  EXPECT_THAT(texts(truth, inverted(estimate), names), Each(Not(HasSubstr("estimate.txt are"))));
  EXPECT_THAT(texts(inverted(truth), estimate, names),
              ElementsAre(HasSubstr("if the poses of truth.txt are inverted")));
  Trajectory turned = truth;  // a camera on its side: no other reading has its motions
  for (auto& [stamp, T] : turned) T = T * Pose(so3_exp({0, 0, 1.0}), Eigen::Vector3d::Zero());
  EXPECT_THAT(texts(turned, estimate, kNames), Each(Not(HasSubstr("and by "))));
}

TEST(TruthFindings, NameTurnedCamerasAndInverseRotations) {
  const Trajectory truth = turning(), estimate = estimated(truth, 0.002);
  const auto turned = [&](const Eigen::Vector3d& turn) {
    return in_camera_frame(truth, {Pose(), Pose(so3_exp(turn), Eigen::Vector3d::Zero())});
  };
  constexpr double kPi = std::numbers::pi;
  EXPECT_THAT(texts(turned({kPi, 0, 0}), estimate, kNames),
              ElementsAre(HasSubstr("of truth.txt are turned to the axes of OpenGL or back")));
  EXPECT_THAT(texts(turned({0, 0, -kPi / 2}), estimate, kNames),
              ElementsAre(HasSubstr("of truth.txt are turned by 90 degrees about the optical")));
  EXPECT_THAT(texts(turned({0, 0, kPi}), estimate, kNames),
              ElementsAre(HasSubstr("of truth.txt are turned by 180 degrees about the optical")));
  Trajectory conjugated = estimate;
  for (auto& [stamp, T] : conjugated) T = Pose(T.quaternion().conjugate(), T.translation());
  EXPECT_THAT(texts(truth, conjugated, kNames),
              ElementsAre(HasSubstr("if the quaternions of estimate.txt are inverted")));
}

TEST(TruthFindings, NameTheFrameOfAKnownDataSet) {
  const Trajectory camera = turning();
  const TruthFrame bonn = read_truth_frame("bonn");
  const Trajectory marker =
      in_camera_frame(camera, {bonn.T_world_reference.inverse(), bonn.T_body_camera.inverse()});
  EXPECT_THAT(texts(marker, estimated(camera, 0.002), kNames),
              ElementsAre(HasSubstr("with --truth-frame bonn; give --truth-frame bonn")));
}

TEST(TruthFindings, TellInvertedPosesFromQwFirstOnARobot) {
  Trajectory robot;  // turns about the y axis only, so that both have the same rotations
  for (int i = 0; i < 120; ++i)
    robot.push_back(
        {i / 30.0, Pose(so3_exp({0, 0.01 * i, 0}), {0.3 * std::sin(i / 40.0), 0, i / 50.0})});
  EXPECT_THAT(texts(robot, inverted(robot), kNames),
              ElementsAre(HasSubstr("txt are inverted; write T_world_camera")));
}

TEST(TruthFindings, NameTheOffsetOfTheClocks) {
  const Trajectory estimate = estimated(turning(), 0.002);
  for (const double delay : {0.5, -0.7}) {
    Trajectory truth = turning();
    for (auto& [stamp, T] : truth) stamp += delay;
    EXPECT_THAT(
        texts(truth, estimate, kNames),
        ElementsAre(HasSubstr(fmt::format("if the times of truth.txt are made {:.2f} s {}",
                                          std::abs(delay), delay > 0 ? "earlier" : "later"))));
  }
}

TEST(TruthFindings, NameATruthOfAnotherRecordingOrAtRest) {
  const Trajectory estimate = estimated(turning(), 0.002);
  Trajectory other = turning(), resting = turning();
  for (auto& [t, T] : other)
    T = Pose(so3_exp({std::cos(3 * t), 0.8 * std::sin(2 * t), -0.5 * t}), {t * t, 0, t});
  for (auto& [t, T] : resting) T = Pose();
  EXPECT_THAT(texts(other, estimate, kNames),
              ElementsAre(AllOf(HasSubstr("of estimate.txt and truth.txt have hardly"),
                                HasSubstr("that of another recording"))));
  EXPECT_THAT(texts(resting, estimate, kNames),
              ElementsAre(HasSubstr("the rotations of estimate.txt and truth.txt have hardly")));
  EXPECT_THAT(texts(estimate, resting, kNames),
              ElementsAre(HasSubstr("the rotations of estimate.txt and truth.txt have hardly")));
  EXPECT_THAT(texts(resting, resting, kNames), IsEmpty()) << "a camera at rest";
}

TEST(TruthFindings, NameATruthThatIsThePoseOfAnotherBody) {
  const Pose T_body_camera(so3_exp({0.3, -1.1, 0.9}), {0.1, 0, 0});
  const Trajectory camera = turning(), estimate = estimated(camera, 0.002);
  Trajectory body = camera;
  for (auto& [stamp, T] : body) T = T * T_body_camera.inverse();
  EXPECT_THAT(texts(body, estimate, kNames),
              ElementsAre(AllOf(HasSubstr("about other axes"), HasSubstr("--truth-frame"))));
}

TEST(TruthFindings, NameNoOtherBodyAfterASingleTurn) {
  // The axis of one turn of 70 degrees errs by as much as the tracking.
  const Pose T_body_camera(so3_exp({0.03, -0.02, 0.02}), {0, 0, 0});
  Trajectory camera;
  for (int i = 0; i < 40; ++i)
    camera.push_back({i / 30.0, Pose(so3_exp({0, 1.2 * i / 30.0, 0}), {0.1 * i / 30.0, 0, 0})});
  const Trajectory estimate = estimated(camera, 0.002);
  Trajectory body = camera;
  for (auto& [stamp, T] : body) T = T * T_body_camera.inverse();
  EXPECT_THAT(texts(body, estimate, kNames), IsEmpty());
}

TEST(TruthFindings, NameAnotherUnitOfLength) {
  const Trajectory truth = turning(), estimate = estimated(truth, 0.002);
  Trajectory millimeters = truth;
  for (auto& [stamp, T] : millimeters) T = Pose(T.quaternion(), 1000 * T.translation());
  EXPECT_THAT(texts(millimeters, estimate, kNames), ElementsAre(HasSubstr("write both in meters")));
  EXPECT_THAT(texts(truth, millimeters, kNames), ElementsAre(HasSubstr("write both in meters")));
  EXPECT_THAT(texts(millimeters, estimate, kNames, false), IsEmpty())
      << "the scale of the estimate is not known";
}

TEST(TruthFindings, NameAPointOfTheSameBody) {
  const Eigen::Vector3d point(0.3, -0.1, 0.15);
  const Trajectory camera = turning(), estimate = estimated(camera, 0.002);
  Trajectory marker = camera;
  for (auto& [stamp, T] : marker) T = T * Pose(Eigen::Quaterniond::Identity(), point);
  EXPECT_THAT(texts(marker, estimate, kNames),
              ElementsAre(AllOf(HasSubstr("of one body 0.35 m apart"),
                                HasSubstr("translation (-0.3"), HasSubstr("--truth-frame"))));
}

TEST(TruthFindings, AreNotRaisedByAScaleThatIsABitWrong) {
  // A camera that looks at the center of the sphere that it moves on, roughly.
  Trajectory truth;
  for (int i = 0; i < 120; ++i) {
    const Eigen::Quaterniond q = so3_exp({0.2 * std::sin(i / 20.0), i / 60.0, 0});
    truth.push_back({i / 30.0, Pose(q, q * Eigen::Vector3d(0, 0, -1 - 0.1 * std::sin(i / 9.0)))});
  }
  Trajectory estimate = truth;
  for (auto& [stamp, T] : estimate) T = Pose(T.quaternion(), 0.85 * T.translation());
  EXPECT_THAT(texts(truth, estimate, kNames), IsEmpty());
  for (std::size_t i = 60; i < estimate.size(); ++i)
    estimate[i].T_world_camera = estimate[59].T_world_camera;
  EXPECT_THAT(texts(truth, estimate, kNames),
              testing::Not(testing::Contains(HasSubstr("in meters"))))
      << "tracking that got stuck";
}

TEST(TruthFindings, NameRoundedTimes) {
  const Trajectory truth = turning();
  Trajectory rounded = truth;
  for (auto& [stamp, T] : rounded) stamp = std::round(10 * stamp) / 10;
  EXPECT_THAT(
      texts(truth, rounded, kNames),
      testing::Contains(HasSubstr("of 120 poses of estimate.txt have the time of another")));
  Trajectory twice;
  for (const StampedPose& pose : truth) twice.insert(twice.end(), 2, pose);
  EXPECT_THAT(texts(truth, twice, kNames), IsEmpty()) << "lines that are there twice";
}

TEST(TruthFindings, NameMillimetersInBothFiles) {
  Trajectory truth = turning();
  for (auto& [stamp, T] : truth) T = Pose(T.quaternion(), 1000 * T.translation());
  EXPECT_THAT(texts(truth, estimated(truth, 0.002), kNames),
              ElementsAre(HasSubstr("write both in meters")));
}

TEST(TruthFindings, AreNotRaisedByATruthWithoutRotationsOrAShortOne) {
  const Trajectory estimate = estimated(turning(), 0.002);
  Trajectory positions = turning();
  for (auto& [stamp, T] : positions) T = Pose(Eigen::Quaterniond::Identity(), T.translation());
  EXPECT_THAT(texts(positions, estimate, kNames), IsEmpty());
  EXPECT_THAT(texts(estimate, positions, kNames), IsEmpty());
  Trajectory faster = positions;
  for (auto& [stamp, T] : faster) T = Pose(T.quaternion(), 20 * T.translation());
  EXPECT_THAT(texts(faster, estimate, kNames), ElementsAre(HasSubstr("in meters")));
  EXPECT_THAT(texts(positions, misread(estimate), kNames), IsEmpty());
  const Trajectory shorter(estimate.begin(), estimate.begin() + 20);
  EXPECT_THAT(texts(turning(), misread(shorter), kNames), IsEmpty());
}

}  // namespace
}  // namespace stillmap
