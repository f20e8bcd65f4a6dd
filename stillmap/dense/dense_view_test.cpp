// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/dense_view.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/dense/synthetic_frame.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

DenseView view_of_frame(const RgbdFrame& frame, const cv::Mat1b& movers = {}, int stride = 2) {
  return make_dense_view(small_camera(), frame, movers, {.stride = stride}, {}).view;
}

TEST(DenseView, KeepsEveryNthPixelAsItWas) {
  const Camera camera = small_camera();
  const RgbdFrame frame = frame_of(camera, [](int u, int v) { return 1 + 0.001 * u + 0.002 * v; });
  const DenseView view = view_of_frame(frame, {}, 3);
  ASSERT_EQ(view.depth.size(), cv::Size(54, 40));
  for (int row = 0; row < view.depth.rows; ++row) {
    for (int col = 0; col < view.depth.cols; ++col) {
      const float z = view.depth(row, col) * DenseView::kDepthUnit;
      EXPECT_NEAR(z, frame.depth.at<float>(3 * row, 3 * col), 1.01e-4);
      EXPECT_EQ(view.color(row, col), frame.color.at<cv::Vec3b>(3 * row, 3 * col));
      // The cameras of the lattice and of the image have the same rays.
      EXPECT_LT((view.camera.unproject(col, row, 2) - camera.unproject(3 * col, 3 * row, 2)).norm(),
                1e-12);
    }
  }
}

TEST(DenseView, DistinguishesSurfacesMoversAndMissingDepth) {
  RgbdFrame frame = frame_of(small_camera(), [](int u, int) { return u < 40 ? 9.0 : 2.0; });
  frame.depth.at<float>(60, 100) = std::numeric_limits<float>::quiet_NaN();
  cv::Mat1b movers = cv::Mat1b::zeros(frame.depth.size());
  movers(cv::Rect(120, 0, 40, 120)).setTo(1);
  const DenseView view = view_of_frame(frame, movers);
  EXPECT_EQ(view.kind(30, 10), kNoSurface);                          // too far for a surface
  EXPECT_NEAR(view.depth(30, 10) * DenseView::kDepthUnit, 9, 2e-4);  // with its depth
  EXPECT_EQ(view.kind(30, 40), kStaticSurface);
  EXPECT_EQ(view.kind(30, 50), kNoSurface);  // no depth
  EXPECT_EQ(view.depth(30, 50), 0);
  EXPECT_EQ(view.kind(30, 58), kNoSurface);        // near the mask's outline
  EXPECT_EQ(view.kind(30, 52), kDoubtfulSurface);  // near the mover and at its depth
  EXPECT_EQ(view.kind(30, 70), kMoverSurface);
}

TEST(DenseView, BecomesCoarserOnTheSameRays) {
  const RgbdFrame frame = frame_of(small_camera(), [](int u, int) { return 1.5 + 0.002 * u; });
  const DenseView fine = view_of_frame(frame), coarse = coarser(fine);
  EXPECT_EQ(coarse.stride, 4);
  EXPECT_LT(coarse.bytes(), fine.bytes() / 3);
  for (int i = 0; i < coarse.depth.rows; ++i) {
    EXPECT_EQ(coarse.depth(i, i), fine.depth(2 * i, 2 * i));
    EXPECT_EQ(coarse.kind(i, i), fine.kind(2 * i, 2 * i));
    EXPECT_LT((coarse.camera.unproject(i, i, 1) - fine.camera.unproject(2 * i, 2 * i, 1)).norm(),
              1e-12);
  }
}

TEST(DenseView, RefusesImagesOfOtherSizes) {
  RgbdFrame frame = frame_of(small_camera(), [](int, int) { return 2.0; });
  EXPECT_THROW(view_of_frame(frame, cv::Mat1b(3, 3)), Error);
  frame.color = cv::Mat();
  EXPECT_THROW(view_of_frame(frame), Error);
}

}  // namespace
}  // namespace stillmap
