// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/rectifier.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <set>

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

// Returns the true pixel of a direction (x, y, 1), by OpenCV's forward model.
cv::Point2d record(const Camera& camera, const Eigen::Vector2d& direction) {
  const cv::Matx33d K(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  const auto& d = camera.distortion;
  std::vector<cv::Point2d> pixels;
  cv::projectPoints(std::vector<cv::Point3d>{{direction.x(), direction.y(), 1}}, cv::Vec3d(),
                    cv::Vec3d(), K, cv::Vec<double, 5>(d(0), d(1), d(2), d(3), d(4)), pixels);
  return pixels[0];
}

// A soft dot with its center at a fractional pixel.
void draw_dot(cv::Mat& image, const cv::Point2d& center) {
  constexpr double kSigma = 2.0;  // pixels
  for (int y = static_cast<int>(center.y) - 8; y <= center.y + 9; ++y) {
    for (int x = static_cast<int>(center.x) - 8; x <= center.x + 9; ++x) {
      if (!cv::Rect({}, image.size()).contains({x, y})) continue;
      const double r2 = std::pow(x - center.x, 2) + std::pow(y - center.y, 2);
      image.at<uchar>(y, x) = cv::saturate_cast<uchar>(250 * std::exp(-r2 / (2 * kSigma * kSigma)));
    }
  }
}

cv::Point2d center_of_dot(const cv::Mat& image, const Eigen::Vector2d& expected) {
  const cv::Rect around(static_cast<int>(expected.x()) - 8, static_cast<int>(expected.y()) - 8, 18,
                        18);
  const cv::Moments m = cv::moments(image(around));
  return cv::Point2d(around.tl()) + cv::Point2d(m.m10 / m.m00, m.m01 / m.m00);
}

class DistortedCamera : public ::testing::TestWithParam<std::string> {};

TEST_P(DistortedCamera, DotsAreMovedToThePinholePosition) {
  const Camera camera = read_camera(GetParam());
  ASSERT_TRUE(camera.distorted());
  Camera pinhole = camera;
  pinhole.distortion.setZero();
  std::vector<Eigen::Vector2d> expected;
  cv::Mat recorded(camera.height, camera.width, CV_8UC1, cv::Scalar(0));
  double largest_shift = 0;
  for (double u = 40.3; u < 600; u += 43.7) {
    for (double v = 40.6; v < 440; v += 41.3) {
      const Eigen::Vector3d direction = pinhole.unproject(u, v, 1);
      const cv::Point2d pixel = record(camera, direction.head<2>());
      if (pixel.x < 12 || pixel.y < 12 || pixel.x > 627 || pixel.y > 467) continue;
      draw_dot(recorded, pixel);
      expected.emplace_back(u, v);
      largest_shift = std::max(largest_shift, cv::norm(pixel - cv::Point2d(u, v)));
    }
  }
  ASSERT_GT(expected.size(), 80u);
  ASSERT_GT(largest_shift, 3);  // Otherwise the test could not fail.

  const Rectifier rectifier(camera);
  const cv::Mat rectified = rectifier.image(recorded);
  for (const auto& truth : expected) {
    const cv::Point2d found = center_of_dot(rectified, truth);
    EXPECT_NEAR(found.x, truth.x(), 0.1) << truth.transpose();
    EXPECT_NEAR(found.y, truth.y(), 0.1) << truth.transpose();
  }
}

TEST_P(DistortedCamera, IgnoredPixelsAreMovedWithTheImages) {
  Camera camera = read_camera(GetParam());
  camera.ignore = test::own_path("ignored.png").string();
  cv::Mat recorded(camera.height, camera.width, CV_8UC1, cv::Scalar(0));
  recorded({20, 30, 150, 400}).setTo(255);
  write_png(camera.ignore, recorded);
  const Rectifier rectifier(camera);
  std::filesystem::remove(camera.ignore);
  const cv::Mat seen = rectifier.image(recorded), &ignored = rectifier.ignored();
  EXPECT_EQ(cv::countNonZero((seen == 255) & (ignored == 0)), 0);
  EXPECT_EQ(cv::countNonZero((seen == 0) & ignored), 0);
  EXPECT_GT(cv::countNonZero(recorded ^ ignored), 500) << "the distortion moves the outline";
}

TEST_P(DistortedCamera, DepthIsMovedWithoutInterpolation) {
  const Camera camera = read_camera(GetParam());
  const Rectifier rectifier(camera);
  cv::Mat recorded(camera.height, camera.width, CV_16UC1);
  for (int y = 0; y < recorded.rows;
       ++y) {  // Stripes of 1 m, 4 m and unknown depth, with an edge at every border.
    recorded.row(y).setTo(y % 3 == 0 ? 5000 : y % 3 == 1 ? 20000 : 0);
  }
  const cv::Mat rectified = rectifier.nearest(recorded);
  std::set<int> values;
  for (const std::uint16_t value : cv::Mat_<std::uint16_t>(rectified)) values.insert(value);
  EXPECT_EQ(values, (std::set<int>{0, 5000, 20000}));

  // Each pixel must have the value of the recorded pixel of its direction.
  Camera pinhole = camera;
  pinhole.distortion.setZero();
  int checked = 0;
  for (int v = 100; v < 380; v += 7) {
    for (int u = 100; u < 540; u += 7) {
      const cv::Point2d source = record(camera, pinhole.unproject(u, v, 1).head<2>());
      const double fraction = source.y - std::floor(source.y);
      if (std::abs(fraction - 0.5) < 0.1) continue;  // The rounding is ambiguous.
      const int row = static_cast<int>(std::lround(source.y));
      EXPECT_EQ(rectified.at<std::uint16_t>(v, u), recorded.at<std::uint16_t>(row, 0))
          << u << " " << v;
      ++checked;
    }
  }
  EXPECT_GT(checked, 1000);
}

INSTANTIATE_TEST_SUITE_P(Presets, DistortedCamera, ::testing::Values("tum_fr1", "tum_fr2"));

TEST(Rectifier, DoesNotCopyImagesOfAnIdealCamera) {
  const Rectifier rectifier(read_camera("tum_fr3"));
  EXPECT_FALSE(rectifier.active());
  const cv::Mat image(480, 640, CV_8UC3);
  EXPECT_EQ(rectifier.image(image).data, image.data);
  EXPECT_EQ(rectifier.nearest(image).data, image.data);
}

TEST(Rectifier, RefusesAnotherSize) {
  const Rectifier rectifier(read_camera("tum_fr1"));
  EXPECT_THROW(rectifier.image(cv::Mat(240, 320, CV_8UC1)), Error);
}

TEST(Rectifier, PixelsOutsideTheRecordingHaveNoDepthAndNoEdge) {
  Camera camera = read_camera("tum_fr3");
  camera.distortion(0) = 0.3;  // The ideal view is wider than the recorded one.
  const Rectifier rectifier(camera);
  EXPECT_EQ(rectifier.nearest(cv::Mat(480, 640, CV_16UC1, cv::Scalar(7))).at<std::uint16_t>(0, 0),
            0);
  EXPECT_EQ(rectifier.image(cv::Mat(480, 640, CV_8UC1, cv::Scalar(90))).at<uchar>(0, 0), 90);
}

}  // namespace
}  // namespace stillmap
