// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/global_shutter.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/track/motion_compensation.hpp"

#include <cmath>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Smallest depth of a surface that decides whether the camera moves [m].
constexpr double kNearest = 0.5;
/// Motion in the image that is corrected [pixels].
constexpr double kLeastMotion = 0.5;
/// Side of the blocks that have one motion each, interpolated between them [pixels].
constexpr int kBlock = 4;

/// Returns the largest motion in the image between the timestamp and the exposure of a row
/// [pixels].
double largest_motion(const Camera& camera, const ExposureMotion& motion) {
  const double time = motion.timing.readout / 2 + std::abs(motion.timing.depth_delay);
  return camera.fx * time * (double{motion.w.norm()} + double{motion.v.norm()} / kNearest);
}

/// Returns the time of a row's exposure after that of the middle row [s].
float row_time(float v, int height, double readout) {
  return (v / static_cast<float>(height) - 0.5F) * static_cast<float>(readout);
}

Eigen::Vector3f unprojected(const Camera& camera, float u, float v, float z) {
  return camera.unproject(u, v, z).cast<float>();
}

cv::Mat nearest_of(const cv::Mat& image, const cv::Mat2f& sources, int border) {
  cv::Mat result;
  cv::remap(image, result, sources, cv::noArray(), cv::INTER_NEAREST, border);
  return result;
}

}  // namespace

GlobalShutter::GlobalShutter(const RgbdFrame& recorded, const Camera& camera,
                             const ExposureMotion& motion)
    : recorded_(recorded), camera_(camera), motion_(motion) {
  if (largest_motion(camera, motion) < kLeastMotion) return;
  const TraceScope scope("global shutter");
  depth_source_ = sources(motion.timing.depth_delay);
  color_source_ = motion.timing.depth_delay == 0 ? depth_source_ : sources(0);
}

/// Returns for every pixel the one that shows its point in an image whose middle row is exposed
/// `delay` [s] after the timestamp.
cv::Mat2f GlobalShutter::sources(double delay) const {
  const cv::Mat1f depth = recorded_.depth;
  const auto time_at = [&](float v) {
    return row_time(v, depth.rows, motion_.timing.readout) + static_cast<float>(delay);
  };
  cv::Mat2f motion(depth.rows / kBlock, depth.cols / kBlock);
  for (int r = 0; r < motion.rows; ++r) {
    for (int c = 0; c < motion.cols; ++c) {
      const cv::Point2f pixel(static_cast<float>(c * kBlock) + (kBlock - 1) / 2.0F,
                              static_cast<float>(r * kBlock) + (kBlock - 1) / 2.0F);
      cv::Point2f source = pixel;
      float z = static_cast<float>(kTypicalDepth);
      for (int i = 0; i < 3; ++i) {
        const cv::Point nearest(cvRound(source.x), cvRound(source.y));
        const bool inside = cv::Rect({}, depth.size()).contains(nearest);
        if (inside && depth(nearest) > 0) z = depth(nearest);
        const Eigen::Vector3f p = moved_point(unprojected(camera_, pixel.x, pixel.y, z),
                                              -time_at(source.y), motion_.v, motion_.w);
        if (p.z() <= 0) break;
        const Eigen::Vector2d uv = camera_.project(p.cast<double>());
        source = {static_cast<float>(uv.x()), static_cast<float>(uv.y())};
      }
      motion(r, c) = {source.x - pixel.x, source.y - pixel.y};
    }
  }
  cv::Mat2f result;
  cv::resize(motion, result, depth.size(), 0, 0, cv::INTER_LINEAR);
  for (int v = 0; v < result.rows; ++v) {
    for (int u = 0; u < result.cols; ++u)
      result(v, u) += cv::Vec2f(static_cast<float>(u), static_cast<float>(v));
  }
  return result;
}

cv::Mat1f GlobalShutter::depth() const {
  cv::Mat1f result = nearest_of(recorded_.depth, depth_source_, cv::BORDER_CONSTANT);
  for (int v = 0; v < result.rows; ++v) {
    for (int u = 0; u < result.cols; ++u) {
      float& z = result(v, u);
      if (!(z > 0)) continue;
      const cv::Vec2f& source = depth_source_(v, u);
      const float dt = row_time(source[1], result.rows, motion_.timing.readout) +
                       static_cast<float>(motion_.timing.depth_delay);
      z = std::max(
          0.0F,
          moved_point(unprojected(camera_, source[0], source[1], z), dt, motion_.v, motion_.w).z());
    }
  }
  return result;
}

RgbdFrame GlobalShutter::frame() const {
  RgbdFrame result = recorded_;
  result.gray = cv::Mat();
  result.ignored = cv::Mat();
  if (!has_effect()) return result;
  const TraceScope scope("global shutter");
  result.depth_delay = 0;
  result.color = nearest_of(recorded_.color, color_source_, cv::BORDER_REPLICATE);
  result.depth = depth();
  return result;
}

cv::Mat1b GlobalShutter::mask(const cv::Mat1b& recorded) const {
  if (recorded.empty() || !has_effect()) return recorded;
  return nearest_of(recorded, color_source_, cv::BORDER_CONSTANT);
}

}  // namespace stillmap
