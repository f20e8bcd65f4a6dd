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
  const Camera camera = camera_of_width(640);
  RgbdFrame frame = frame_of(camera, [](int u, int) { return u < 160 ? 9.0 : 2.0; });
  frame.depth.at<float>(60, 400) = std::numeric_limits<float>::quiet_NaN();
  cv::Mat1b movers = cv::Mat1b::zeros(frame.depth.size());
  movers(cv::Rect(480, 0, 160, 480)).setTo(1);
  const DenseView view = make_dense_view(camera, frame, movers, {.stride = 2}, {}).view;
  EXPECT_EQ(view.kind(30, 40), kNoSurface);                          // too far for a surface
  EXPECT_NEAR(view.depth(30, 40) * DenseView::kDepthUnit, 9, 2e-4);  // with its depth
  EXPECT_EQ(view.kind(30, 160), kStaticSurface);
  EXPECT_EQ(view.kind(30, 200), kNoSurface);  // no depth
  EXPECT_EQ(view.depth(30, 200), 0);
  EXPECT_EQ(view.kind(30, 238), kNoSurface);        // near the mask's outline
  EXPECT_EQ(view.kind(30, 229), kDoubtfulSurface);  // near the mover and at its depth
  EXPECT_EQ(view.kind(30, 227), kStaticSurface);
  EXPECT_EQ(view.kind(30, 280), kMoverSurface);
}

TEST(DenseView, ReachOfAMoverGrowsWithTheImage) {
  // Distance of the farthest doubtful pixel from a mover in the right half of the image.
  const auto reach = [](const Camera& camera) {
    const RgbdFrame frame = frame_of(camera, [](int, int) { return 2.0; });
    cv::Mat1b movers = cv::Mat1b::zeros(frame.depth.size());
    movers.colRange(camera.width / 2, camera.width).setTo(1);
    const DenseView view = make_dense_view(camera, frame, movers, {.stride = 1}, {}).view;
    int col = 0;
    while (col < camera.width && view.kind(10, col) != kDoubtfulSurface) ++col;
    return camera.width / 2 - col;
  };
  EXPECT_EQ(reach(camera_of_width(640)), 24);
  EXPECT_EQ(reach(camera_of_width(320)), 12);
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

TEST(DenseView, UsesNoPhotoOfAnotherSize) {
  RgbdFrame frame = frame_of(small_camera(), [](int, int) { return 2.0; });
  const DenseView view = make_dense_view(small_camera(), frame, {}).view;
  EXPECT_EQ(cv::countNonZero(pixels_of_others(view, frame.color)), 0);
  const cv::Mat1b others = pixels_of_others(view, cv::Mat3b(5, 7, cv::Vec3b(0, 0, 0)));
  EXPECT_EQ(cv::countNonZero(others == 255), static_cast<int>(view.color.total()));
}

}  // namespace
}  // namespace stillmap
