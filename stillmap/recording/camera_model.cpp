// SPDX-License-Identifier: Apache-2.0
#include "stillmap/recording/camera_model.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace stillmap {
namespace {

using Model = LensDistortion::Model;

// Names of ROS, and of librealsense, whose "modified" model has the same coefficients to first
// order.
std::optional<Model> model_named(const std::string& name) {
  for (const char* brown : {"", "plumb_bob", "rational_polynomial", "thin_prism", "Brown Conrady",
                            "Modified Brown Conrady"}) {
    if (name == brown) return Model::kBrown;
  }
  if (name == "Inverse Brown Conrady") return Model::kInverseBrown;
  for (const char* fisheye : {"equidistant", "fisheye", "Kannala Brandt4"}) {
    if (name == fisheye) return Model::kFisheye;
  }
  return std::nullopt;
}

LensDistortion lens_of(const CameraInfoMessage& info) {
  std::vector<double> coefficients = info.distortion;
  while (!coefficients.empty() && coefficients.back() == 0) coefficients.pop_back();
  if (coefficients.empty()) return {};
  const auto model = model_named(info.distortion_model);
  if (!model) {
    throw Error(fmt::format("the distortion model '{}' is not known", info.distortion_model), "",
                "give the camera of rectified images with --camera, or rectify the images");
  }
  // OpenCV takes 4, 5, 8, 12 or 14 coefficients of Brown's model, and 4 of the fisheye model.
  for (const std::size_t size : {4, 5, 8, 12, 14}) {
    if (coefficients.size() > size) continue;
    coefficients.resize(size);
    break;
  }
  if (coefficients.size() > 14 || (model == Model::kFisheye && coefficients.size() > 4) ||
      (model == Model::kInverseBrown && coefficients.size() > 5)) {
    throw Error(fmt::format("the camera has {} distortion coefficients", coefficients.size()), "",
                "give the camera of rectified images with --camera, or rectify the images");
  }
  return {*model, std::move(coefficients)};
}

}  // namespace

std::optional<RecordedCamera> camera_of(const CameraInfoMessage& info, bool rectified) {
  constexpr std::uint32_t kLargest = 16384;
  if (info.width > kLargest || info.height > kLargest)
    throw Error(fmt::format("the camera has {} x {} pixels", info.width, info.height), "", "");
  const auto finite = [](double value) { return std::isfinite(value); };
  if (!std::all_of(info.intrinsics.begin(), info.intrinsics.end(), finite) ||
      !std::all_of(info.projection.begin(), info.projection.end(), finite) ||
      !std::all_of(info.distortion.begin(), info.distortion.end(), finite))
    throw Error("the camera has numbers that are not finite", "", "");
  RecordedCamera camera;
  camera.width = static_cast<int>(info.width);
  camera.height = static_cast<int>(info.height);
  const bool by_projection = rectified && info.projection[0] > 0;
  if (by_projection) {
    const auto& p = info.projection;
    camera.fx = p[0], camera.cx = p[2], camera.fy = p[5], camera.cy = p[6];
  } else {
    const auto& k = info.intrinsics;
    camera.fx = k[0], camera.cx = k[2], camera.fy = k[4], camera.cy = k[5];
    if (!rectified) camera.lens = lens_of(info);
  }
  if (!(camera.fx > 0) || !(camera.fy > 0)) return std::nullopt;
  return camera;
}

std::optional<Pose> pose_in_pair(const CameraInfoMessage& info, bool rectified) {
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const Eigen::Matrix3d R_pair_camera =
      rectified ? Eigen::Matrix3d::Identity()
                : Eigen::Matrix3d(Eigen::Map<const RowMajor>(info.rectification.data()));
  constexpr double kTolerance = 1e-3;  // of the product of R and its transpose: R has few decimals
  const bool is_rotation = (R_pair_camera * R_pair_camera.transpose()).isIdentity(kTolerance) &&
                           R_pair_camera.determinant() > 0;
  const double focal = info.projection[0], shift = info.projection[3];  // pixels, pixels * m
  if (!is_rotation || !(focal > 0) || !std::isfinite(shift / focal)) return std::nullopt;
  return Pose(R_pair_camera, {-shift / focal, 0, 0});
}

}  // namespace stillmap
