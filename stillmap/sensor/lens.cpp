// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/lens.hpp"

#include <cmath>

#include <Eigen/Cholesky>
#include <opencv2/calib3d.hpp>

namespace stillmap {
namespace {

using Model = LensDistortion::Model;

cv::Matx33d intrinsics(double fx, double fy, double cx, double cy) {
  return {fx, 0, cx, 0, fy, cy, 0, 0, 1};
}

// Returns the pixels (x, y) of an image, 64FC2, row by row.
cv::Mat all_pixels(int width, int height) {
  cv::Mat pixels(height, width, CV_64FC2);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) pixels.at<cv::Vec2d>(y, x) = cv::Vec2d(x, y);
  }
  return pixels.reshape(2, width * height);
}

// Returns normalized pixels of a pinhole camera without distortion.
cv::Mat normalized(const cv::Mat& pixels, const cv::Matx33d& K) {
  cv::Mat result;
  cv::undistortPoints(pixels, result, K, cv::noArray());
  return result;
}

// Applies Brown's polynomial to normalized coordinates, without a change of the pixel's unit.
cv::Mat distorted(const cv::Mat& points, const std::vector<double>& coefficients) {
  cv::Mat homogeneous, result;
  cv::convertPointsToHomogeneous(points, homogeneous);
  cv::projectPoints(homogeneous, cv::Vec3d(), cv::Vec3d(), cv::Matx33d::eye(), coefficients,
                    result);
  return result;
}

// Inverts Brown's polynomial.
cv::Mat undistorted(const cv::Mat& pixels, const cv::Matx33d& K,
                    const std::vector<double>& coefficients) {
  const cv::TermCriteria until(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 1e-9);
  cv::Mat result;
  cv::undistortPoints(pixels, result, K, coefficients, cv::noArray(), cv::noArray(), until);
  return result;
}

}  // namespace

std::pair<cv::Mat, cv::Mat> rectification_maps(const Camera& pinhole, const LensDistortion& lens) {
  const cv::Matx33d K = intrinsics(pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy);
  const cv::Size size(pinhole.width, pinhole.height);
  cv::Mat x, y;
  switch (lens.model) {
    case Model::kBrown:
      cv::initUndistortRectifyMap(K, lens.coefficients, cv::noArray(), K, size, CV_32FC1, x, y);
      break;
    case Model::kFisheye:
      cv::fisheye::initUndistortRectifyMap(K, lens.coefficients, cv::noArray(), K, size, CV_32FC1,
                                           x, y);
      break;
    case Model::kInverseBrown: {
      const cv::Mat recorded =
          undistorted(all_pixels(size.width, size.height), K, lens.coefficients);
      cv::Mat channels[2];
      cv::split(recorded.reshape(2, size.height), channels);
      channels[0].convertTo(x, CV_32FC1, pinhole.fx, pinhole.cx);
      channels[1].convertTo(y, CV_32FC1, pinhole.fy, pinhole.cy);
      break;
    }
  }
  return {x, y};
}

BrownFit fit_brown(const Camera& pinhole, const LensDistortion& lens) {
  using Row = Eigen::Matrix<double, 1, 5>;
  const auto [x, y] = rectification_maps(pinhole, lens);
  // The distorted coordinates are linear functions of the coefficients.
  const auto for_each_row = [&, &x = x, &y = y](auto&& visit) {
    for (int v = 0; v < pinhole.height; ++v) {
      for (int u = 0; u < pinhole.width; ++u) {
        const double a = (u - pinhole.cx) / pinhole.fx, b = (v - pinhole.cy) / pinhole.fy;
        const double r2 = a * a + b * b, r4 = r2 * r2, r6 = r2 * r4;
        const double da = (x.at<float>(v, u) - u) / pinhole.fx,
                     db = (y.at<float>(v, u) - v) / pinhole.fy;
        visit(Row(a * r2, a * r4, 2 * a * b, r2 + 2 * a * a, a * r6), da, pinhole.fx);
        visit(Row(b * r2, b * r4, r2 + 2 * b * b, 2 * a * b, b * r6), db, pinhole.fy);
      }
    }
  };
  Eigen::Matrix<double, 5, 5> H = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 1> g = Eigen::Matrix<double, 5, 1>::Zero();
  for_each_row([&](const Row& row, double difference, double) {
    H.noalias() += row.transpose() * row;
    g += row.transpose() * difference;
  });
  BrownFit fit{H.ldlt().solve(g)};
  for_each_row([&](const Row& row, double difference, double focal) {
    const double error = focal * std::abs(row * fit.coefficients - difference);
    if (!(error <= fit.error)) fit.error = error;  // also if it is not a number
  });
  return fit;
}

Camera pinhole_of(const RecordedCamera& recorded) {
  Camera camera;
  camera.width = recorded.width, camera.height = recorded.height;
  camera.fx = recorded.fx, camera.fy = recorded.fy;
  camera.cx = recorded.cx, camera.cy = recorded.cy;
  return camera;
}

cv::Mat ray_directions(const RecordedCamera& camera) {
  const cv::Matx33d K = intrinsics(camera.fx, camera.fy, camera.cx, camera.cy);
  const cv::Mat pixels = all_pixels(camera.width, camera.height);
  const auto& coefficients = camera.lens.coefficients;
  cv::Mat directions;
  if (coefficients.empty()) {
    directions = normalized(pixels, K);
  } else if (camera.lens.model == Model::kBrown) {
    directions = undistorted(pixels, K, coefficients);
  } else if (camera.lens.model == Model::kInverseBrown) {
    directions = distorted(normalized(pixels, K), coefficients);
  } else {
    cv::fisheye::undistortPoints(pixels, directions, K, coefficients);
  }
  cv::Mat result;
  directions.reshape(2, camera.height).convertTo(result, CV_32FC2);
  return result;
}

}  // namespace stillmap
