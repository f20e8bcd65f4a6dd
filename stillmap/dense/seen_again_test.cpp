// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/seen_again.hpp"

#include "stillmap/dense/synthetic_frame.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

const Plane kWall{Eigen::Vector3d::UnitZ(), 2.5};
const Plane kNearer{Eigen::Vector3d::UnitZ(), 2}, kFurther{Eigen::Vector3d::UnitZ(), 3};

Pose at_z(double z) { return Pose(Eigen::Quaterniond::Identity(), {0, 0, z}); }

DenseView static_view(const Plane& plane, const Pose& T_world_camera = Pose()) {
  return make_dense_view(small_camera(), view_of(small_camera(), T_world_camera, plane), {}).view;
}

// Returns the share of the surfaces in a view of the wall that are new beside another view, which
// is there several times.
double rest_after(const DenseView& newer, int times, const Pose& T_world_newer = Pose(),
                  bool refutes = true) {
  const DenseView earlier = static_view(kWall);
  NewerViews views;
  for (int i = 0; i < times; ++i) views.add({&newer, T_world_newer}, refutes);
  const RestOfView rest = views.rest_of({&earlier, Pose()});
  EXPECT_EQ(cv::norm(rest.view.color, earlier.color), 0);
  EXPECT_LE(rest.surfaces, static_cast<std::size_t>(cv::countNonZero(rest.view.kind)));
  return static_cast<double>(rest.surfaces) / cv::countNonZero(earlier.kind);
}

TEST(NewerViews, ShowWhatEnoughOfThemShow) {
  EXPECT_EQ(rest_after(static_view(kWall), NewerViews::kEnough - 1), 1);
  EXPECT_EQ(rest_after(static_view(kWall), NewerViews::kEnough), 0);
}

TEST(NewerViews, RefuteWhatTheySeeThrough) {
  EXPECT_EQ(rest_after(static_view(kFurther), NewerViews::kRefuting - 1), 1);
  EXPECT_EQ(rest_after(static_view(kFurther), NewerViews::kRefuting), 0);
  EXPECT_EQ(rest_after(static_view(kFurther), 10, Pose(), false), 1) << "no such views";
}

TEST(NewerViews, DoNotShowWhatIsHiddenFromThem) {
  EXPECT_EQ(rest_after(static_view(kNearer), 10), 1);
}

TEST(NewerViews, DoNotShowAsWellWhatIsMuchFurtherAway) {
  const Pose behind = at_z(-1), far_behind = at_z(-1.5);  // 1.4 and 1.6 times the distance
  EXPECT_EQ(rest_after(static_view(kWall, behind), 10, behind), 0);
  EXPECT_EQ(rest_after(static_view(kWall, far_behind), 10, far_behind), 1);
}

TEST(NewerViews, DoNotShowThePlacesOfMovers) {
  const RgbdFrame frame = view_of(small_camera(), Pose(), kWall);
  const cv::Mat1b movers(frame.depth.size(), std::uint8_t{255});
  EXPECT_EQ(rest_after(make_dense_view(small_camera(), frame, movers).view, 10), 1);
}

TEST(NewerViews, DoNotShowWhatIsBesideThem) {
  const Pose turned(so3_exp({0, 0.5, 0}), {0, 0, 0});  // by nearly half of the field of view
  const double rest = rest_after(static_view(kWall, turned), 10, turned);
  EXPECT_GT(rest, 0.3);
  EXPECT_LT(rest, 0.6);
}

}  // namespace
}  // namespace stillmap
