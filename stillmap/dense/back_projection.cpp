// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/back_projection.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

void require_size(const cv::Mat& image, int type, const Camera& camera, const char* name) {
  if (image.rows == camera.height && image.cols == camera.width && image.type() == type) return;
  throw Error(
      fmt::format("the {} image is {} x {} of OpenCV type {}, expected {} x {} of type {}", name,
                  image.cols, image.rows, image.type(), camera.width, camera.height, type),
      "dense back-projection", "give images of the camera's size and of the expected type");
}

/// Returns the depth behind a pixel of depth z, on the plane through it and its neighbor on the
/// other side: inverse depths of a plane are linear in the image. Returns z without a neighbor.
float continued(float z, float opposite) {
  const float inverse = opposite > 0 ? 2 / z - 1 / opposite : 1 / z;
  return inverse > 0 ? 1 / inverse : z;
}

}  // namespace

cv::Mat1b dilated(const cv::Mat1b& mask, int radius) {
  if (mask.empty() || radius == 0) return mask;
  cv::Mat1b grown;
  const cv::Size window(2 * radius + 1, 2 * radius + 1);
  cv::dilate(mask, grown, cv::getStructuringElement(cv::MORPH_RECT, window));
  return grown;
}

bool at_jump(const cv::Mat1f& depth, int u, int v, float limit) {
  const float z = depth(v, u);
  const auto at = [&](int row, int col) {
    const bool inside = row >= 0 && col >= 0 && row < depth.rows && col < depth.cols;
    return inside ? depth(row, col) : 0.0F;
  };
  for (const auto& [down, right] : {std::pair(0, 1), {1, 0}, {1, 1}, {1, -1}}) {
    const float a = at(v + down, u + right), b = at(v - down, u - right);
    const auto jumps = [&](float from, float to) {
      return to > 0 && std::abs(to - z) > limit && std::abs(to - continued(z, from)) > limit;
    };
    if (jumps(a, b) || jumps(b, a)) return true;
  }
  return false;
}

PointGrid back_project(const Camera& camera, const RgbdFrame& frame, const cv::Mat1b& excluded,
                       const BackProjectionOptions& options) {
  require_size(frame.depth, CV_32FC1, camera, "depth");
  if (!excluded.empty()) require_size(excluded, CV_8UC1, camera, "mask");

  const cv::Mat1f depth = frame.depth;
  const cv::Mat1b moving = dilated(excluded, options.mask_dilation);
  const auto min_depth = static_cast<float>(camera.depth_sensor.min_depth);
  const float max_depth = options.max_depth > 0
                              ? static_cast<float>(options.max_depth)
                              : camera.depth_sensor.depth_at_sigma(options.max_sigma);
  const auto max_jump = static_cast<float>(options.max_jump);
  const auto noise = camera.depth_sensor.tolerance<float>(kJumpNoise, 0);
  const int stride = options.stride;

  PointGrid grid{.points = cv::Mat3f((depth.rows + stride - 1) / stride,
                                     (depth.cols + stride - 1) / stride, cv::Vec3f(0, 0, 0)),
                 .stride = stride};
  for (int v = 0; v < depth.rows; v += stride) {
    for (int u = 0; u < depth.cols; u += stride) {
      const float z = depth(v, u);
      const bool in_range = z >= min_depth && z <= max_depth;  // false for NaN
      if (!in_range || (!moving.empty() && moving(v, u) != 0)) continue;
      if (at_jump(depth, u, v, std::max(max_jump * z, noise.at(z)))) continue;
      const Eigen::Vector3f p = camera.unproject(u, v, z).cast<float>();
      grid.points(v / stride, u / stride) = {p.x(), p.y(), p.z()};
    }
  }
  return grid;
}

}  // namespace stillmap
