#include "stillmap/evaluate/closure.hpp"

#include "stillmap/base/error.hpp"

#include <array>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

/// A rectangle of 3 m by 4 m out and back, with 10 poses per side, that begins and ends at the
/// origin.
Trajectory rectangle() {
  constexpr int kSteps = 10;
  const std::array<Eigen::Vector3d, 5> corners{
      Eigen::Vector3d(0, 0, 0), {3, 0, 0}, {3, 4, 0}, {0, 4, 0}, {0, 0, 0}};
  Trajectory path;
  for (std::size_t side = 0; side < 4; ++side) {
    for (int i = side == 0 ? 0 : 1; i <= kSteps; ++i) {
      const double share = static_cast<double>(i) / kSteps;
      path.push_back({0.1 * static_cast<double>(path.size()),
                      Pose(Eigen::Matrix3d(Eigen::Matrix3d::Identity()),
                           (1 - share) * corners[side] + share * corners[side + 1])});
    }
  }
  return path;
}

/// Returns the trajectory in the same world as the truth, hence without alignment.
AteResult compared(const Trajectory& truth, const Trajectory& estimate) {
  return absolute_trajectory_error(truth, estimate, {.T_truth_estimate = Pose()});
}

void shift_last(Trajectory& path, const Eigen::Vector3d& by) {
  Pose& last = path.back().T_world_camera;
  last = Pose(last.quaternion(), last.translation() + by);
}

TEST(ClosureError, IsTheDistanceBetweenTheEndsOfAPathThatShouldBeClosed) {
  Trajectory estimate = rectangle();
  shift_last(estimate, {0.03, -0.04, 0.12});
  const ClosureError error = closure_error(compared(rectangle(), estimate));
  EXPECT_NEAR(error.space, 0.13, 1e-12);
  EXPECT_NEAR(error.plane, 0.05, 1e-12);
  EXPECT_NEAR(error.path, 14, 1e-12);
  EXPECT_NEAR(error.space_percent(), 100 * 0.13 / 14, 1e-10);
  EXPECT_NEAR(error.plane_percent(), 100 * 0.05 / 14, 1e-10);
}

TEST(ClosureError, IsZeroForTheTruthWhetherClosedOrNot) {
  Trajectory open = rectangle();
  open.resize(15);
  EXPECT_EQ(closure_error(compared(open, open)).space, 0);
}

TEST(ClosureError, DoesNotCountTheGapOfTheTrueEnds) {
  Trajectory truth = rectangle(), estimate = rectangle();
  shift_last(truth, {0.2, 0, 0});
  shift_last(estimate, {0.2, 0.01, 0});
  EXPECT_NEAR(closure_error(compared(truth, estimate)).space, 0.01, 1e-12);
}

TEST(ClosureError, DoesNotDependOnTheWorldOfTheEstimate) {
  const Pose T(so3_exp({0.3, -0.5, 1.1}), {4, -2, 1});
  Trajectory moved = rectangle();
  for (auto& [stamp, pose] : moved) pose = T * pose;
  EXPECT_NEAR(closure_error(absolute_trajectory_error(rectangle(), moved)).space, 0, 1e-9);
}

TEST(ClosureError, CountsTheHeightOfThePathInSpaceOnly) {
  Trajectory truth = rectangle();
  for (std::size_t i = 1; i < truth.size(); i += 2) {
    Pose& pose = truth[i].T_world_camera;
    pose = Pose(pose.quaternion(), pose.translation() + Eigen::Vector3d(0, 0, 0.1));
  }
  const ClosureError error = closure_error(compared(truth, truth));
  EXPECT_NEAR(error.path_in_plane, 14, 1e-12);
  EXPECT_GT(error.path, 14.1);
}

TEST(ClosureError, TextHasThePlaneOnlyIfWanted) {
  const ClosureError error{0.13, 0.05, 14, 14};
  EXPECT_EQ(closure_text(error, false), "closure error in space   0.1300 m, 0.929 % of 14.00 m\n");
  EXPECT_NE(closure_text(error, true).find("in plane   0.0500 m, 0.357 %"), std::string::npos);
  EXPECT_EQ(nlohmann::json(error)["plane_m"], 0.05);
}

TEST(ClosureError, NeedsTwoPoses) { EXPECT_THROW(closure_error(AteResult{}), Error); }

}  // namespace
}  // namespace stillmap
