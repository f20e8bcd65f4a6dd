// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/depth_registration.hpp"

#include "stillmap/base/statistics.hpp"
#include "stillmap/sensor/lens.hpp"
#include "stillmap/sensor/rectifier.hpp"

#include <numeric>

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

namespace stillmap {
namespace {

// A room with a ball in front of a slanted wall, in the frame of the color camera [m].
struct Room {
  Eigen::Vector3d center{0.15, -0.05, 1.4};
  double radius = 0.35;
  Eigen::Vector3d normal = Eigen::Vector3d(0.35, 0.2, -1).normalized();
  double distance = -2.2;

  /// Returns the length along a ray from a point to the first surface.
  double hit(const Eigen::Vector3d& from, const Eigen::Vector3d& ray) const {
    const double wall = (distance - normal.dot(from)) / normal.dot(ray);
    const Eigen::Vector3d to = center - from;
    const double a = ray.squaredNorm(), b = to.dot(ray), c = to.squaredNorm() - radius * radius;
    const double root = b * b - a * c;
    const double ball = root > 0 ? (b - std::sqrt(root)) / a : -1;
    return ball > 0 ? std::min(ball, wall) : wall;
  }
};

Camera color_camera(int width, int height, double f) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = f;
  camera.fy = f * 1.01;
  camera.cx = width / 2.0 + 3;
  camera.cy = height / 2.0 - 5;
  return camera;
}

RecordedCamera depth_camera(LensDistortion lens) {
  return {.width = 640,
          .height = 480,
          .fx = 480,
          .fy = 482,
          .cx = 318,
          .cy = 244,
          .lens = std::move(lens)};
}

RecordedCamera wide_depth_camera(LensDistortion lens) {
  return {.width = 1280,
          .height = 720,
          .fx = 900,
          .fy = 903,
          .cx = 643,
          .cy = 356,
          .lens = std::move(lens)};
}

// Renders the depth along the axis of a camera at T_room_camera whose pixels have the directions.
cv::Mat1f rendered(const Room& room, const cv::Mat& directions, const Pose& T_room_camera) {
  cv::Mat1f depth(directions.size());
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      const auto& d = directions.at<cv::Vec2f>(y, x);
      const Eigen::Vector3d ray = T_room_camera.rotation() * Eigen::Vector3d(d[0], d[1], 1);
      depth(y, x) = static_cast<float>(room.hit(T_room_camera.translation(), ray));
    }
  }
  return depth;
}

cv::Mat directions_of(const Camera& camera) {
  return ray_directions({.width = camera.width,
                         .height = camera.height,
                         .fx = camera.fx,
                         .fy = camera.fy,
                         .cx = camera.cx,
                         .cy = camera.cy,
                         .lens = {}});
}

const Pose kPose(Eigen::Quaterniond(Eigen::AngleAxisd(0.03,
                                                      Eigen::Vector3d(0.5, 1, 0.3).normalized())),
                 Eigen::Vector3d(-0.05, 0.01, 0.004));

struct Agreement {
  double median = 0;  // absolute error of the depth [m]
  double known = 0;   // share of the pixels with depth, of those that the depth camera sees
};

Agreement agreement(const cv::Mat1f& registered, const cv::Mat1f& truth) {
  std::vector<double> errors;
  int inside = 0;
  for (int y = truth.rows / 6; y < truth.rows * 5 / 6; ++y) {
    for (int x = truth.cols / 6; x < truth.cols * 5 / 6; ++x) {
      ++inside;
      if (registered(y, x) > 0) errors.push_back(std::abs(registered(y, x) - truth(y, x)));
    }
  }
  const double known = static_cast<double>(errors.size()) / inside;
  return {upper_median(errors), known};
}

class Registration : public ::testing::TestWithParam<LensDistortion> {};

TEST_P(Registration, OfRenderedImagesAgreesWithTheColorCamera) {
  const Room room;
  const RecordedCamera depth = depth_camera(GetParam());
  const cv::Mat1f recorded = rendered(room, ray_directions(depth), kPose);
  // Color images of half, equal, 1.5 and 2.6 times the size of the depth images.
  for (const auto& [width, height, f] :
       {std::tuple(320, 240, 250.0), std::tuple(640, 480, 500.0), std::tuple(960, 720, 760.0),
        std::tuple(1664, 1248, 1300.0)}) {
    const Camera color = color_camera(width, height, f);
    const DepthRegistration registration(depth, kPose, color);
    const cv::Mat1f truth = rendered(room, directions_of(color), Pose());
    const Agreement result = agreement(registration(recorded), truth);
    RecordProperty(fmt::format("median_mm_{}", width), fmt::format("{}", 1000 * result.median));
    EXPECT_LT(result.median, 0.002) << width;
    EXPECT_GT(result.known, 0.93) << width;
  }
}

TEST_P(Registration, OfWideDepthImagesAgreesWithTheColorCamera) {
  const Room room;
  const RecordedCamera depth = wide_depth_camera(GetParam());
  const cv::Mat1f recorded = rendered(room, ray_directions(depth), kPose);
  for (const auto& [width, height, f] : {std::tuple(640, 480, 500.0), std::tuple(1280, 720, 920.0),
                                         std::tuple(1920, 1080, 1380.0)}) {
    const Camera color = color_camera(width, height, f);
    const cv::Mat1f truth = rendered(room, directions_of(color), Pose());
    const Agreement result = agreement(DepthRegistration(depth, kPose, color)(recorded), truth);
    RecordProperty(fmt::format("median_mm_{}", width), fmt::format("{}", 1000 * result.median));
    EXPECT_LT(result.median, 0.002) << width;
    EXPECT_GT(result.known, 0.93) << width;
  }
}

// Returns by how much the left edge of the ball is off along the rows, on average [pixels]. The
// depth camera is to the left, so this edge hides nothing behind it.
double mean_edge_offset(const RecordedCamera& depth, const Camera& color) {
  const Room room;
  const cv::Mat1f registered =
      DepthRegistration(depth, kPose, color)(rendered(room, ray_directions(depth), kPose));
  const cv::Mat1f truth = rendered(room, directions_of(color), Pose());
  const auto left_edge = [](const cv::Mat1f& image, int y) {
    for (int x = 1; x < image.cols; ++x)
      if (image(y, x) > 0 && image(y, x) < 1.45F && image(y, x - 1) != image(y, x)) return x;
    return -1;
  };
  std::vector<double> offsets;
  for (int y = color.height * 5 / 16; y < color.height * 7 / 12; ++y) {
    const int found = left_edge(registered, y), expected = left_edge(truth, y);
    if (found >= 0 && expected >= 0) offsets.push_back(std::abs(found - expected));
  }
  EXPECT_GT(offsets.size(), 60U);
  return std::accumulate(offsets.begin(), offsets.end(), 0.0) / static_cast<double>(offsets.size());
}

TEST_P(Registration, PutsEdgesWhereTheColorCameraSeesThem) {
  for (const bool wide : {false, true}) {
    const double offset =
        wide ? mean_edge_offset(wide_depth_camera(GetParam()), color_camera(1280, 720, 920))
             : mean_edge_offset(depth_camera(GetParam()), color_camera(640, 480, 500));
    RecordProperty(wide ? "edge_px_1280" : "edge_px_640", fmt::format("{}", offset));
    EXPECT_LE(offset, 0.5) << wide;
  }
}

using Model = LensDistortion::Model;
INSTANTIATE_TEST_SUITE_P(
    Lenses, Registration,
    ::testing::Values(LensDistortion{},
                      LensDistortion{Model::kBrown, {0.12, -0.2, 0.001, -0.002, 0.08}},
                      LensDistortion{Model::kBrown, {0.4, -0.1, 0.0005, 0, 0.01, 0.3, -0.1, 0.01}},
                      LensDistortion{Model::kInverseBrown, {-0.05, 0.06, 0.0004, 0.0003, -0.02}},
                      LensDistortion{Model::kFisheye, {-0.02, 0.003, 0, 0}}));

TEST(DepthRegistration, TheNearestOfSeveralReadingsRemains) {
  const Camera color = color_camera(640, 480, 500);
  RecordedCamera depth = depth_camera({});
  cv::Mat1f image(480, 640, 0.0F);
  image(240, 300) = 2;
  image(240, 312) = 1;
  // At 2 m the pixel moves by 480 b / 2, at 1 m by 480 b / 1: both arrive at one column.
  depth = {.width = 640,
           .height = 480,
           .fx = color.fx,
           .fy = color.fy,
           .cx = color.cx,
           .cy = color.cy,
           .lens = {}};
  const Pose T_color_depth(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-0.048, 0, 0));
  const cv::Mat1f registered = DepthRegistration(depth, T_color_depth, color)(image);
  EXPECT_EQ(cv::countNonZero(registered), 1);
  EXPECT_FLOAT_EQ(registered(240, 288), 1);
}

TEST(DepthRegistration, SurfacesHaveNoGaps) {
  const Room wall{.center = {0, 0, -5}, .radius = 0.1};
  const RecordedCamera depth = depth_camera({});
  const cv::Mat1f recorded = rendered(wall, ray_directions(depth), kPose);
  for (const double f : {500, 600, 680, 760, 900}) {  // Readings are 1 to 1.9 pixels apart.
    const DepthRegistration registration(depth, kPose, color_camera(960, 720, f));
    const cv::Mat1f registered = registration(recorded);
    const cv::Mat1f inner = registered(cv::Rect(230, 180, 500, 360));
    EXPECT_GT(cv::countNonZero(inner), 0.995 * 500 * 360) << f;
  }
}

TEST(DepthRegistration, AnImageWithoutReadingsStaysEmpty) {
  const DepthRegistration registration(depth_camera({}), kPose, color_camera(640, 480, 500));
  EXPECT_EQ(cv::countNonZero(registration(cv::Mat1f::zeros(480, 640))), 0);
  EXPECT_THROW(registration(cv::Mat1f::zeros(48, 64)), Error);
}

// A camera with the inverse model is rectified so that its pixels show what a pinhole camera sees.
TEST(Lens, RectificationInvertsTheDirectionsOfTheRecordedPixels) {
  Camera pinhole = color_camera(640, 480, 500);
  for (const LensDistortion& lens :
       {LensDistortion{Model::kBrown, {0.12, -0.2, 0.001, -0.002, 0.08}},
        LensDistortion{Model::kInverseBrown, {-0.05, 0.06, 0.0004, 0.0003, -0.02}},
        LensDistortion{Model::kFisheye, {-0.02, 0.003, 0, 0}}}) {
    const auto [map_x, map_y] = rectification_maps(pinhole, lens);
    const cv::Mat directions = ray_directions({.width = 640,
                                               .height = 480,
                                               .fx = pinhole.fx,
                                               .fy = pinhole.fy,
                                               .cx = pinhole.cx,
                                               .cy = pinhole.cy,
                                               .lens = lens});
    for (int y = 40; y < 440; y += 50) {
      for (int x = 40; x < 600; x += 50) {
        const float u = map_x.at<float>(y, x), v = map_y.at<float>(y, x);
        if (u < 1 || v < 1 || u > 637 || v > 477) continue;
        // Directions of the four recorded pixels around (u, v), interpolated.
        const int i = static_cast<int>(v), j = static_cast<int>(u);
        const float s = u - j, t = v - i;
        const cv::Vec2f d =
            (directions.at<cv::Vec2f>(i, j) * (1 - s) + directions.at<cv::Vec2f>(i, j + 1) * s) *
                (1 - t) +
            (directions.at<cv::Vec2f>(i + 1, j) * (1 - s) +
             directions.at<cv::Vec2f>(i + 1, j + 1) * s) *
                t;
        EXPECT_NEAR(pinhole.fx * d[0] + pinhole.cx, x, 0.02);
        EXPECT_NEAR(pinhole.fy * d[1] + pinhole.cy, y, 0.02);
      }
    }
  }
}

}  // namespace
}  // namespace stillmap
