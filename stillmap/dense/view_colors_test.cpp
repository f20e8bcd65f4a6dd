// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/view_colors.hpp"

#include "stillmap/dense/dense_view.hpp"
#include "stillmap/dense/synthetic_frame.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using testing_support::small_camera;

/// Views of a wall 2 m ahead, whose green falls from the left to the right, with an exposure each.
class ViewsOfAWall : public ::testing::Test {
 protected:
  static float green(double x) { return static_cast<float>(120 - 20 * x); }

  void add(const Eigen::Vector3d& eye, float exposure, const cv::Rect& glare = {}) {
    const Camera camera = small_camera();
    const Pose pose(Eigen::Quaterniond::Identity(), eye);
    RgbdFrame frame = testing_support::view_of(camera, pose, {{0, 0, 1}, 2});
    for (int v = 0; v < camera.height; ++v) {
      for (int u = 0; u < camera.width; ++u) {
        const double x = (pose * camera.unproject(u, v, frame.depth.at<float>(v, u))).x();
        const auto channel = [&](float value) {
          return cv::saturate_cast<uchar>(exposure * value);
        };
        frame.color.at<cv::Vec3b>(v, u) = {channel(80), channel(green(x)), channel(100)};
      }
    }
    if (!glare.empty()) frame.color(glare).setTo(cv::Scalar(230, 230, 230));
    BackProjectionOptions options;
    options.stride = 1;
    held_.push_back(std::make_shared<DenseView>(make_dense_view(camera, frame, {}, options).view));
    views_.push_back({held_.back().get(), pose});
  }
  static std::vector<Eigen::Vector3f> points_on_the_wall() {
    std::vector<Eigen::Vector3f> points;
    for (float x = -0.9F; x < 0.9F; x += 0.02F) {
      for (float y = -0.5F; y < 0.5F; y += 0.02F) points.emplace_back(x, y, 2);
    }
    return points;
  }

  std::vector<std::shared_ptr<DenseView>> held_;
  std::vector<PosedView> views_;
};

TEST_F(ViewsOfAWall, GiveTheGainsThatUndoTheirExposure) {
  for (const float exposure : {0.7F, 1.0F, 1.4F})
    add({exposure - 1, 0, 0}, exposure, exposure > 1 ? cv::Rect(0, 0, 40, 60) : cv::Rect());
  const auto gains = color_gains(points_on_the_wall(), views_);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(gains[0][c] / gains[1][c], 1 / 0.7, 0.01);  // the error of 8-bit colors
    EXPECT_NEAR(gains[2][c] / gains[1][c], 1 / 1.4, 0.01);
    EXPECT_NEAR(gains[0][c] * gains[1][c] * gains[2][c], 1, 0.001);
  }
}

TEST_F(ViewsOfAWall, KeepTheirColorsWithoutOverlap) {
  add({-5, 0, 0}, 0.7F);
  add({5, 0, 0}, 1.4F);
  auto points = points_on_the_wall();
  for (std::size_t i = 0; i < points.size(); ++i) points[i].x() += i % 2 == 0 ? 5 : -5;
  for (const auto& gain : color_gains(points, views_))
    EXPECT_LT((gain - Eigen::Vector3f::Ones()).norm(), 1e-4);  // far below a step of 8 bits
}

TEST_F(ViewsOfAWall, GivePointsOneColorWhateverTheExposure) {
  add({-0.3, 0, 0}, 0.7F);
  add({0.3, 0, 0}, 1.4F);
  const auto points = points_on_the_wall();
  const auto gains = color_gains(points, views_);
  const auto colors = surface_colors(points, views_, gains);
  const float common = static_cast<float>(std::sqrt(0.7 * 1.4));
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_NEAR(colors[i][1], common * green(points[i].x()), 1.5) << points[i].transpose();
}

/// Stripes as wide as a pixel of the photo, of which a view on every second pixel sees one kind.
TEST_F(ViewsOfAWall, ShowFinerDetailsInTheirPhotos) {
  const Camera camera = small_camera();
  RgbdFrame frame = testing_support::view_of(camera, {}, {{0, 0, 1}, 2});
  for (int u = 0; u < camera.width; ++u)
    frame.color.col(u).setTo(cv::Scalar::all(u % 4 < 2 ? 40 : 200));
  DenseView view = make_dense_view(camera, frame, {}, {.stride = 4}).view;
  view.photo = photo_of(frame.color);
  const std::vector<PosedView> views{{&view, Pose()}};
  std::vector<Eigen::Vector3f> points;
  for (const double u : {40.5, 42.5}) points.emplace_back(camera.unproject(u, 60, 2).cast<float>());
  const std::vector<Eigen::Vector3f> gains(1, Eigen::Vector3f::Ones());
  const auto coarse = surface_colors(points, views, gains);
  EXPECT_NEAR(coarse[0][1], coarse[1][1], 1);
  const auto fine = surface_colors(points, views, gains, ColorSource::kPhoto);
  EXPECT_NEAR(fine[0][1], 40, 12);
  EXPECT_NEAR(fine[1][1], 200, 12);
}

/// A pixel that another frame gave the view, where the photo shows a person.
TEST_F(ViewsOfAWall, HaveNoColorsOfPeopleInTheirPhotos) {
  add({0, 0, 0}, 1);
  cv::Mat3b image(held_[0]->color.size());
  held_[0]->color.copyTo(image);
  const std::vector<Eigen::Vector3f> points{{0, 0, 2}};
  image(cv::Rect(image.cols / 2 - 20, image.rows / 2 - 20, 40, 40)).setTo(cv::Scalar::all(250));
  held_[0]->photo = photo_of(image);
  const std::vector<Eigen::Vector3f> gains(1, Eigen::Vector3f::Ones());
  EXPECT_NEAR(surface_colors(points, views_, gains, ColorSource::kPhoto)[0][1], green(0), 2);
}

TEST_F(ViewsOfAWall, DoNotColorWhatIsBehindIt) {
  add({0, 0, 0}, 1);
  add({0, 0, 2.5}, 0.5F);  // behind the wall, nothing in view
  const std::vector<Eigen::Vector3f> points{{0.1F, 0, 2}, {0.1F, 0, 3.5F}};
  const auto gains = std::vector<Eigen::Vector3f>(2, Eigen::Vector3f::Ones());
  held_[1]->depth.setTo(packed_depth(1));  // a wall of another color at 3.5 m
  held_[1]->kind.setTo(kStaticSurface);
  held_[1]->color.setTo(cv::Scalar(10, 20, 30));
  const auto colors = surface_colors(points, views_, gains);
  EXPECT_NEAR(colors[0][0], 100, 1);
  EXPECT_EQ(colors[1], (Rgb{30, 20, 10}));
}

}  // namespace
}  // namespace stillmap
