// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/open_view.hpp"

#include "stillmap/dense/synthetic_frame.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

constexpr int kRow = 30, kMiddle = 40, kSide = 10;  // pixels of the view at stride 2

/// A wall at 2 m with a person at 1.5 m in the middle third of the image, if there is one.
RgbdFrame room(bool person) {
  return frame_of(small_camera(),
                  [&](int u, int) { return person && u >= 53 && u < 107 ? 1.5 : 2; });
}

cv::Mat1b person_mask() {
  cv::Mat1b mask = cv::Mat1b::zeros(small_camera().height, small_camera().width);
  mask(cv::Rect(53, 0, 54, small_camera().height)).setTo(255);
  return mask;
}

DenseView fused_with(const DenseView& view, int frames, const RgbdFrame& frame,
                     const cv::Mat1b& movers) {
  OpenView open(view, {}, {});
  for (int i = 0; i < frames; ++i) open.fuse(small_camera(), frame, movers, Pose());
  return open.fused();
}

double depth_at(const DenseView& view, int col) {
  return view.depth(kRow, col) * double{DenseView::kDepthUnit};
}

TEST(OpenView, ShowsTheWallBehindAPersonWhoLeft) {
  const DenseView view = make_dense_view(small_camera(), room(true), person_mask()).view;
  ASSERT_EQ(view.kind(kRow, kMiddle), kMoverSurface);
  const DenseView fused = fused_with(view, 2, room(false), {});
  EXPECT_EQ(fused.kind(kRow, kMiddle), kStaticSurface);
  EXPECT_NEAR(depth_at(fused, kMiddle), 2, 1e-3);
}

TEST(OpenView, APersonWhoStaysIsNoSurface) {
  const DenseView view = make_dense_view(small_camera(), room(true), person_mask()).view;
  const DenseView fused = fused_with(view, 6, room(true), person_mask());
  EXPECT_EQ(fused.kind(kRow, kMiddle), kMoverSurface);
  EXPECT_EQ(fused.kind(kRow, kSide), kStaticSurface);
}

TEST(OpenView, APersonWhomTheFirstFrameMissesIsRemoved) {
  const DenseView view = make_dense_view(small_camera(), room(true), {}).view;
  ASSERT_EQ(view.kind(kRow, kMiddle), kStaticSurface);
  EXPECT_EQ(fused_with(view, 6, room(true), person_mask()).kind(kRow, kMiddle), kNoSurface);
}

TEST(OpenView, LeavesOutWhatOneOfManyFramesShows) {
  RgbdFrame hole = room(false);
  hole.depth(cv::Rect(60, 0, 40, small_camera().height)).setTo(0);
  const DenseView view = make_dense_view(small_camera(), hole, {}).view;
  OpenView open(view, {}, {});
  open.fuse(small_camera(), room(true), {}, Pose());
  for (int i = 0; i < 4; ++i) open.fuse(small_camera(), hole, {}, Pose());
  EXPECT_EQ(open.fused().kind(kRow, kMiddle), kNoSurface);
  EXPECT_EQ(open.fused().kind(kRow, kSide), kStaticSurface);
}

TEST(OpenView, ManyUncertainDepthsAreCertain) {
  const auto wall_at = [](double z) {
    return frame_of(small_camera(), [&](int, int) { return z; });
  };
  const RgbdFrame far = wall_at(4.5);  // .026 m is the standard deviation of a Kinect v1 at 4 m
  const DenseView view = make_dense_view(small_camera(), far, {}).view;
  ASSERT_NE(view.kind(kRow, kMiddle), kStaticSurface);
  const DenseView fused = fused_with(view, 4, far, {});
  EXPECT_EQ(fused.kind(kRow, kMiddle), kStaticSurface);
  EXPECT_NEAR(depth_at(fused, kMiddle), 4.5, 1e-3);
}

TEST(OpenView, WithoutFramesTheViewStaysAsItIs) {
  const DenseView view = make_dense_view(small_camera(), room(true), person_mask()).view;
  const DenseView fused = OpenView(view, {}, {}).fused();
  EXPECT_EQ(cv::countNonZero(fused.kind != view.kind), 0);
}

}  // namespace
}  // namespace stillmap
