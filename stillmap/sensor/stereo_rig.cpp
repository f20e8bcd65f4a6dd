// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/stereo_rig.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/lens.hpp"

#include <cmath>

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

cv::Matx33d intrinsics(double fx, double fy, double cx, double cy) {
  return {fx, 0, cx, 0, fy, cy, 0, 0, 1};
}

cv::Matx33d as_cv(const Eigen::Matrix3d& m) {
  return {m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2)};
}

// Returns the rotation R_rig_rectified: x along the baseline, z near both optical axes.
Eigen::Matrix3d rectified_axes(const StereoCamera& left, const StereoCamera& right) {
  const Eigen::Vector3d x =
      (right.T_rig_camera.translation() - left.T_rig_camera.translation()).normalized();
  const Eigen::Vector3d ahead = left.T_rig_camera.rotation() * Eigen::Vector3d::UnitZ() +
                                right.T_rig_camera.rotation() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d y = ahead.cross(x).normalized();
  Eigen::Matrix3d axes;
  axes << x, y, x.cross(y);
  return axes;
}

// Returns the coordinates (x / z, y / z) that the middle of the recorded image has after
// rectification.
Eigen::Vector2d middle_of(const StereoCamera& camera, const Eigen::Matrix3d& R_rig_rectified) {
  const RecordedCamera& c = camera.recorded;
  const Eigen::Vector3d ray(((c.width - 1) / 2.0 - c.cx) / c.fx,
                            ((c.height - 1) / 2.0 - c.cy) / c.fy, 1);
  const Eigen::Vector3d turned =
      R_rig_rectified.transpose() * (camera.T_rig_camera.rotation() * ray);
  return turned.head<2>() / turned.z();
}

StereoRig::Map map_of(const StereoCamera& camera, const Eigen::Matrix3d& R_rig_rectified,
                      const Camera& pinhole, cv::Mat* outside) {
  const RecordedCamera& c = camera.recorded;
  const cv::Matx33d K = intrinsics(c.fx, c.fy, c.cx, c.cy);
  const cv::Matx33d P = intrinsics(pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy);
  const cv::Matx33d R = as_cv(R_rig_rectified.transpose() * camera.T_rig_camera.rotation());
  const cv::Size size(pinhole.width, pinhole.height);
  cv::Mat x, y;
  if (c.lens.model == LensDistortion::Model::kFisheye) {
    cv::fisheye::initUndistortRectifyMap(K, c.lens.coefficients, R, P, size, CV_32FC1, x, y);
  } else {
    cv::initUndistortRectifyMap(K, c.lens.coefficients, R, P, size, CV_32FC1, x, y);
  }
  if (outside != nullptr) *outside = (x < 0) | (x > c.width - 1) | (y < 0) | (y > c.height - 1);
  StereoRig::Map map;
  cv::convertMaps(x, y, map.whole, map.fraction, CV_16SC2, /*nninterpolation=*/false);
  return map;
}

// Returns whether the images of two cameras are rectified.
bool are_rectified(const StereoCamera& left, const StereoCamera& right) {
  // Both are below a tenth of a pixel at focal lengths up to 1000 pixels.
  constexpr double kLargestAngle = 1e-4, kLargestSlope = 1e-4;  // [rad], off the rows / along them
  const Pose T_left_right = left.T_rig_camera.inverse() * right.T_rig_camera;
  const Eigen::Vector3d& offset = T_left_right.translation();
  return left.recorded == right.recorded && left.recorded.lens.coefficients.empty() &&
         T_left_right.angle() < kLargestAngle &&
         offset.tail<2>().norm() < kLargestSlope * offset.x();
}

void check_pair(const StereoCamera& left, const StereoCamera& right, const std::string& where) {
  const auto& [a, b] = std::tie(left.recorded, right.recorded);
  if (a.width != b.width || a.height != b.height) {
    throw Error(fmt::format("the left images have {} x {} pixels, the right ones {} x {}", a.width,
                            a.height, b.width, b.height),
                where, "give images of one size");
  }
  if (a.lens.model == LensDistortion::Model::kInverseBrown ||
      b.lens.model == LensDistortion::Model::kInverseBrown) {
    throw Error("the inverse distortion of RealSense cannot be rectified", where,
                "give the rectified infrared images");
  }
  const Eigen::Vector3d offset =
      left.T_rig_camera.inverse() * right.T_rig_camera.translation();  // in the left camera [m]
  if (offset.x() > 0.5 * offset.norm()) return;
  throw Error(fmt::format("the second camera is at ({:.3f}, {:.3f}, {:.3f}) m in the frame of the "
                          "first, not to its right",
                          offset.x(), offset.y(), offset.z()),
              where, "name the left camera first");
}

}  // namespace

StereoRig rectified_rig(const Camera& left, double baseline, const std::string& where) {
  if (!(baseline > 0 && std::isfinite(baseline))) {
    throw Error(fmt::format("the baseline is {} m", baseline), where,
                "name the left camera first; its projection lies right of the other's");
  }
  StereoRig rig;
  rig.camera = left;
  rig.camera.distortion.setZero();
  rig.camera.baseline = baseline;
  rig.camera.depth_sensor = stereo_sensor(left.fx, baseline);
  rig.camera.shutter = ShutterTiming{};
  rig.camera.disparity_bias = {};
  check_camera(rig.camera, where);
  return rig;
}

StereoRig calibrated_rig(const StereoCamera& left, const StereoCamera& right, double fps,
                         const std::string& where) {
  check_pair(left, right, where);
  const auto& [a, b] = std::tie(left.recorded, right.recorded);
  const double baseline =
      (right.T_rig_camera.translation() - left.T_rig_camera.translation()).norm();
  Camera pinhole = pinhole_of(a);
  pinhole.name = "stereo";
  pinhole.fps = fps;
  if (are_rectified(left, right)) return rectified_rig(pinhole, baseline, where);
  const Eigen::Matrix3d R_rig_rectified = rectified_axes(left, right);
  pinhole.fx = pinhole.fy = (a.fx + a.fy + b.fx + b.fy) / 4;
  const Eigen::Vector2d middle =
      (middle_of(left, R_rig_rectified) + middle_of(right, R_rig_rectified)) / 2;
  pinhole.cx = (a.width - 1) / 2.0 - pinhole.fx * middle.x();
  pinhole.cy = (a.height - 1) / 2.0 - pinhole.fy * middle.y();
  StereoRig rig = rectified_rig(pinhole, baseline, where);
  rig.maps[0] = map_of(left, R_rig_rectified, rig.camera, &rig.outside);
  rig.maps[1] = map_of(right, R_rig_rectified, rig.camera, nullptr);
  return rig;
}

std::string description(const StereoRig& rig) {
  const Camera& c = rig.camera;
  return fmt::format("{} x {}, f {:.1f}, baseline {:.3f} m, {}, depth from {:.2f} m", c.width,
                     c.height, c.fx, c.baseline,
                     rig.rectifies() ? "will be rectified" : "rectified", c.depth_sensor.min_depth);
}

cv::Mat rectified(const StereoRig& rig, std::size_t side, const cv::Mat& recorded) {
  if (!rig.rectifies()) return recorded;
  cv::Mat image;
  cv::remap(recorded, image, rig.maps.at(side).whole, rig.maps.at(side).fraction, cv::INTER_LINEAR,
            cv::BORDER_REPLICATE);
  return image;
}

}  // namespace stillmap
