// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/view_fusion.hpp"

#include "stillmap/dense/synthetic_frame.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

DenseView view_of_wall(double depth) {
  const RgbdFrame frame = frame_of(small_camera(), [&](int, int) { return depth; });
  return make_dense_view(small_camera(), frame, {}).view;
}

float depth_of(const std::shared_ptr<const DenseView>& view) {
  return view->depth(30, 40) * DenseView::kDepthUnit;
}

TEST(FusedViews, NearViewsAgreeOnASurface) {
  const DenseView a = view_of_wall(2), b = view_of_wall(2.02);
  const auto fused = fused_views({{&a, Pose()}, {&b, Pose()}}, {});
  EXPECT_NEAR(depth_of(fused[0]), 2.01, 5e-4);
  EXPECT_NEAR(depth_of(fused[1]), 2.01, 5e-4);
  EXPECT_NEAR(a.depth(30, 40) * DenseView::kDepthUnit, 2, 2e-4);  // the views are not changed
}

TEST(FusedViews, DifferentSurfacesAndFarViewsStayAsTheyAre) {
  const DenseView a = view_of_wall(2), other = view_of_wall(2.5), far = view_of_wall(2.02);
  const Pose turned(Eigen::Quaterniond(Eigen::AngleAxisd(2, Eigen::Vector3d::UnitY())),
                    Eigen::Vector3d::Zero());
  const auto fused = fused_views({{&a, Pose()}, {&other, Pose()}, {&far, turned}}, {});
  EXPECT_NEAR(depth_of(fused[0]), 2, 2e-4);
  EXPECT_NEAR(depth_of(fused[1]), 2.5, 2e-4);
  EXPECT_NEAR(depth_of(fused[2]), 2.02, 2e-4);
}

TEST(FusedViews, AreTheSameFromAFile) {
  const DenseView a = view_of_wall(2), b = view_of_wall(2.02);
  const std::vector<PosedView> views{{&a, Pose()}, {&b, Pose()}};
  MemoryLimit nothing;
  nothing.limit = 0;
  const auto in_memory = fused_views(views, {}), on_disk = fused_views(views, nothing);
  EXPECT_NE(on_disk[0]->pages, nullptr);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const DenseView &one = *in_memory[i], &other = *on_disk[i];
    EXPECT_EQ(cv::countNonZero(one.depth != other.depth), 0);
    EXPECT_EQ(cv::countNonZero(one.kind != other.kind), 0);
  }
}

}  // namespace
}  // namespace stillmap
