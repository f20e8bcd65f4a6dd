// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/depth_registration.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/sensor/lens.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <fmt/format.h>

namespace stillmap {
namespace {

// Stands for no depth: farther than any reading [m], and small enough that filled() has no denormal
// numbers, which are slow.
constexpr float kNone = 1e6F;
// Relative difference of the depths of neighboring pixels on one surface: as for halved images.
constexpr float kSameSurface = 0.03F;

// Returns the depth at the middle of two neighbors on a plane, if they lie on one surface in front
// of the pixel; otherwise the pixel's own depth.
inline float filled(float own, float before, float after) {
  const float near = std::min(before, after), far = std::max(before, after);
  const bool gap = (far < near * (1 + kSameSurface)) & (own > far * (1 + kSameSurface));
  const float between = 2 * near / (near + far) * far;  // Inverse depth is linear on a plane.
  return gap ? between : own;
}

// Fills gaps of one pixel in the rows of `from`.
void fill_rows(const cv::Mat1f& from, cv::Mat1f& to) {
  for (int y = 0; y < from.rows; ++y) {
    const float* in = from[y];
    float* out = to[y];
    out[0] = in[0];
    for (int x = 1; x < from.cols - 1; ++x) out[x] = filled(in[x], in[x - 1], in[x + 1]);
    out[from.cols - 1] = in[from.cols - 1];
  }
}

// Fills gaps of one pixel in the columns of `from`, and marks pixels without depth by 0.
void fill_columns(const cv::Mat1f& from, cv::Mat1f& to) {
  for (int y = 0; y < from.rows; ++y) {
    const float* own = from[y];
    const float* above = from[std::max(y - 1, 0)];
    const float* below = from[std::min(y + 1, from.rows - 1)];
    float* out = to[y];
    for (int x = 0; x < from.cols; ++x) {
      const float z = filled(own[x], above[x], below[x]);
      out[x] = z < kNone ? z : 0.0F;
    }
  }
}

// Sets each value to the smaller one of both rows.
inline void take_nearer(float* row, const float* other, int count) {
  for (int x = 0; x < count; ++x) row[x] = std::min(row[x], other[x]);
}

// Returns readings of which each covers a square of `size` pixels, whose first corner is its pixel:
// a pixel has the nearest of the readings up to size - 1 pixels above and left of it.
cv::Mat1f with_squares(const cv::Mat1f& readings, int size) {
  if (size == 1) return readings;
  cv::Mat1f covered(readings.size());
  std::vector<float> tall(readings.cols);  // a row of readings that cover `size` rows
  for (int y = 0; y < readings.rows; ++y) {
    std::copy_n(readings[y], readings.cols, tall.data());
    for (int i = 1; i < std::min(size, y + 1); ++i)
      take_nearer(tall.data(), readings[y - i], readings.cols);
    std::copy_n(tall.data(), readings.cols, covered[y]);
    for (int i = 1; i < size; ++i) take_nearer(covered[y] + i, tall.data(), readings.cols - i);
  }
  return covered;
}

}  // namespace

DepthRegistration::DepthRegistration(const RecordedCamera& depth, const Pose& T_color_depth,
                                     const Camera& color)
    : width_(color.width), height_(color.height) {
  Eigen::Matrix3d K;
  K << color.fx, 0, color.cx, 0, color.fy, color.cy, 0, 0, 1;
  const Eigen::Matrix3f KR = (K * T_color_depth.rotation()).cast<float>();
  offset_ = (K * T_color_depth.translation()).cast<float>();
  const double magnification = std::max(color.fx / depth.fx, color.fy / depth.fy);
  constexpr double kLargest = 16;  // [pixels]
  block_ = static_cast<int>(std::clamp(std::round(magnification), 1.0, kLargest));
  const cv::Mat directions = ray_directions(depth);
  for (cv::Mat* rays : {&ray_x_, &ray_y_, &ray_z_}) rays->create(directions.size(), CV_32FC1);
  for (int y = 0; y < directions.rows; ++y) {
    for (int x = 0; x < directions.cols; ++x) {
      const auto& d = directions.at<cv::Vec2f>(y, x);
      const Eigen::Vector3f ray = KR * Eigen::Vector3f(d[0], d[1], 1);
      ray_x_.at<float>(y, x) = ray.x();
      ray_y_.at<float>(y, x) = ray.y();
      ray_z_.at<float>(y, x) = ray.z();
    }
  }
}

cv::Mat DepthRegistration::operator()(const cv::Mat& depth) const {
  const TraceScope scope("register depth");
  if (depth.size() != ray_x_.size() || depth.type() != CV_32FC1) {
    throw Error(fmt::format("a depth image has {} x {} pixels, and its camera {} x {}", depth.cols,
                            depth.rows, ray_x_.cols, ray_x_.rows),
                "DepthRegistration", "give the camera of the depth images");
  }
  // Readings outside the image go to a pixel behind its end.
  std::vector<float> buffer(static_cast<std::size_t>(width_) * height_ + 1, kNone);
  const auto outside = static_cast<std::int32_t>(buffer.size() - 1);
  std::vector<std::int32_t> targets(depth.cols);
  std::vector<float> depths(depth.cols);
  const float margin = 0.5F * static_cast<float>(block_);  // Half of a reading's square [pixels].
  const float right = static_cast<float>(width_) - margin,
              bottom = static_cast<float>(height_) - margin;
  const float shift =
      1 - margin;  // From a reading's position to the corner of its square [pixels].
  for (int y = 0; y < depth.rows; ++y) {
    const float* z = depth.ptr<float>(y);
    const float *rx = ray_x_.ptr<float>(y), *ry = ray_y_.ptr<float>(y), *rz = ray_z_.ptr<float>(y);
    for (int x = 0; x < depth.cols; ++x) {
      const float w = z[x] * rz[x] + offset_.z();
      const float inverse = 1 / w;
      const float u = (z[x] * rx[x] + offset_.x()) * inverse;
      const float v = (z[x] * ry[x] + offset_.y()) * inverse;
      const bool inside =
          (z[x] > 0) & (w > 0) & (u >= margin - 1) & (v >= margin - 1) & (u < right) & (v < bottom);
      const auto column = static_cast<std::int32_t>(inside ? u + shift : 0.0F);
      const auto row = static_cast<std::int32_t>(inside ? v + shift : 0.0F);
      targets[x] = inside ? row * width_ + column : outside;
      depths[x] = w;
    }
    for (int x = 0; x < depth.cols; ++x) {
      float& target = buffer[targets[x]];
      target = std::min(target, depths[x]);
    }
  }
  const cv::Mat1f warped = with_squares(cv::Mat1f(height_, width_, buffer.data()), block_);
  cv::Mat1f rows(height_, width_), registered(height_, width_);
  fill_rows(warped, rows);
  fill_columns(rows, registered);
  return registered;
}

}  // namespace stillmap
