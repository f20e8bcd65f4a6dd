// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/rotated.hpp"

#include "stillmap/base/error.hpp"

#include <numbers>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

namespace stillmap {
namespace {

Camera turned_by_90(Camera camera) {
  std::swap(camera.width, camera.height);
  std::swap(camera.fx, camera.fy);
  const double cy = camera.cy;
  camera.cy = camera.cx;
  camera.cx = camera.width - 1 - cy;
  const Pose T_turned_camera(so3_exp({0, 0, std::numbers::pi / 2}), Eigen::Vector3d::Zero());
  if (camera.imu) camera.imu->T_camera_imu = T_turned_camera * camera.imu->T_camera_imu;
  return camera;
}

cv::Mat turned(const cv::Mat& image, int degrees) {
  cv::Mat turned;
  if (image.empty()) return turned;
  cv::rotate(image, turned,
             degrees == 90    ? cv::ROTATE_90_CLOCKWISE
             : degrees == 180 ? cv::ROTATE_180
                              : cv::ROTATE_90_COUNTERCLOCKWISE);
  return turned;
}

}  // namespace

Camera rotated(const Camera& camera, int degrees) {
  if (degrees % 90 != 0 || degrees < 0 || degrees > 270) {
    throw Error(fmt::format("images cannot be turned by {} degrees", degrees), "rotate",
                "give 0, 90, 180 or 270, the angle by which images are turned clockwise");
  }
  if (degrees != 0 && camera.shutter && camera.shutter->readout != 0) {
    throw Error("the images are turned, and the camera has a readout time, which is that of rows",
                "camera '" + camera.name + "'", "leave 'readout' out of the camera file");
  }
  Camera turned = camera;
  for (int angle = 0; angle < degrees; angle += 90) turned = turned_by_90(turned);
  return turned;
}

Pose turned_camera(int degrees) {
  const double angle = -degrees * EIGEN_PI / 180;
  return {Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
          Eigen::Vector3d::Zero()};
}

RgbdFrame rotated(const RgbdFrame& frame, int degrees) {
  if (degrees == 0) return frame;
  RgbdFrame rotated = frame;
  for (cv::Mat RgbdFrame::*image :
       {&RgbdFrame::color, &RgbdFrame::gray, &RgbdFrame::depth, &RgbdFrame::ignored})
    rotated.*image = turned(frame.*image, degrees);
  return rotated;
}

}  // namespace stillmap
