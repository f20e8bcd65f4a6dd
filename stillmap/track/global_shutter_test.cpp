// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/global_shutter.hpp"

#include "stillmap/track/rolling_camera_test.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr double kTime = 0.37;  // [s]

/// Returns a frame with depth image, and a color image that shows the points as white squares.
RgbdFrame recorded_by(const RollingCamera& rolling) {
  RgbdFrame frame = *rolling.frame(0, kTime)->image;
  frame.color = cv::Mat(frame.depth.size(), CV_8UC3, cv::Scalar::all(0));
  for (const Eigen::Vector3d& point : rolling.points) {
    const Keypoint k = rolling.recorded(point, kTime);
    const cv::Rect square(cvRound(k.u) - 1, cvRound(k.v) - 1, 3, 3);
    frame.color(square & cv::Rect({}, frame.depth.size())) = cv::Scalar::all(255);
  }
  return frame;
}

/// Returns the depth of the plane n . p = 2 m at pixels of a camera with the pose T_world_camera
/// [m].
double true_depth(const RollingCamera& rolling, const Pose& T_world_camera, double u, double v) {
  return (T_world_camera.inverse() * rolling.on_plane(T_world_camera, u, v)).z();
}

TEST(GlobalShutter, GivesTheDepthsOfTheTimestamp) {
  const RollingCamera rolling(Camera{}, {.readout = 0.027, .depth_delay = -0.015});
  Eigen::Matrix<double, 6, 1> twist;
  twist << 0.3, -0.2, 0.1, 0.8, 0.5, -1;
  RgbdFrame recorded = *rolling.frame(0, kTime)->image;
  cv::Mat1f depth(recorded.depth.size());
  for (int v = 0; v < depth.rows; ++v) {
    const double time = rolling.row_time(v) + rolling.timing.depth_delay;
    for (int u = 0; u < depth.cols; ++u)
      depth(v, u) = static_cast<float>(true_depth(rolling, Pose::exp(time * twist), u, v));
  }
  recorded.depth = depth;
  recorded.color = cv::Mat(depth.size(), CV_8UC3, cv::Scalar::all(0));
  const cv::Mat1f corrected =
      GlobalShutter(recorded, rolling.camera, {twist, rolling.timing}).frame().depth;
  double before = 0, after = 0;
  for (int v = 40; v < depth.rows - 40; v += 4) {
    for (int u = 40; u < depth.cols - 40; u += 4) {
      const double z = true_depth(rolling, Pose(), u, v);
      before = std::max(before, std::abs(depth(v, u) - z));
      after = std::max(after, std::abs(corrected(v, u) - z));
    }
  }
  EXPECT_GT(before, 0.03);
  EXPECT_LT(after, 0.005) << "half a pixel";
}

TEST(GlobalShutter, ShowsPointsWhereTheyAreAtTheTimestamp) {
  const RollingCamera rolling(Camera{}, {.readout = 0.027, .depth_delay = -0.015});
  const RgbdFrame recorded = recorded_by(rolling);
  const Pose T_camera_world = RollingCamera::pose(kTime).inverse();
  const auto missed = [&](const cv::Mat3b& color) {
    int count = 0;
    for (const Eigen::Vector3d& point : rolling.points) {
      const Eigen::Vector2d uv = rolling.camera.project(T_camera_world * point);
      if (rolling.camera.contains(uv.x(), uv.y(), 40))
        count += color(cvRound(uv.y()), cvRound(uv.x()))[0] == 0;
    }
    return count;
  };
  EXPECT_GT(missed(recorded.color), 100);
  const GlobalShutter shutter(recorded, rolling.camera,
                              {RollingCamera::twist(kTime), rolling.timing});
  EXPECT_EQ(missed(shutter.frame().color), 0);
}

TEST(GlobalShutter, MovesMasksWithTheColorImage) {
  const RollingCamera rolling(Camera{}, {.readout = 0.027, .depth_delay = -0.015});
  const RgbdFrame recorded = recorded_by(rolling);
  const GlobalShutter shutter(recorded, rolling.camera,
                              {RollingCamera::twist(kTime), rolling.timing});
  const cv::Mat1b white =
      recorded.color.reshape(1, static_cast<int>(recorded.color.total())) == 255;
  const cv::Mat1b mask = cv::Mat(white.col(0).clone()).reshape(1, recorded.color.rows);
  const cv::Mat color = shutter.frame().color;
  cv::Mat1b expected(mask.size());
  for (int v = 0; v < mask.rows; ++v) {
    for (int u = 0; u < mask.cols; ++u) expected(v, u) = color.at<cv::Vec3b>(v, u)[0];
  }
  EXPECT_EQ(cv::countNonZero(shutter.mask(mask) != expected), 0);
}

TEST(GlobalShutter, KeepsTheImagesOfACameraAtRest) {
  const RollingCamera rolling(Camera{}, {.readout = 0.027, .depth_delay = -0.015});
  const RgbdFrame recorded = recorded_by(rolling);
  const GlobalShutter shutter(
      recorded, rolling.camera,
      {1e-3 * Eigen::Matrix<double, 6, 1>(RollingCamera::twist(kTime)), rolling.timing});
  EXPECT_EQ(shutter.frame().depth.data, recorded.depth.data);
  EXPECT_EQ(shutter.frame().color.data, recorded.color.data);
  const cv::Mat1b mask(recorded.depth.size(), 7);
  EXPECT_EQ(shutter.mask(mask).data, mask.data);
}

}  // namespace
}  // namespace stillmap
