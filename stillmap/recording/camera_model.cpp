// SPDX-License-Identifier: Apache-2.0
#include "stillmap/recording/camera_model.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace stillmap {
namespace {

using Model = LensDistortion::Model;

// Scales the intrinsics to pixels of `columns` x `rows` former pixels. Pixel (0, 0) is the center
// of the first pixel, before and after.
RecordedCamera with_pixels_of(RecordedCamera camera, double columns, double rows) {
  camera.fx /= columns;
  camera.fy /= rows;
  camera.cx = (camera.cx + 0.5) / columns - 0.5;
  camera.cy = (camera.cy + 0.5) / rows - 0.5;
  return camera;
}

// Applies the region of interest and the binning of a message (REP 104).
SizedCamera with_settings(const RecordedCamera& full, const CameraInfoMessage& info) {
  RecordedCamera part = full;
  std::vector<std::string> settings;
  const bool whole = info.roi_width == 0 || info.roi_height == 0 || info.roi_width > info.width ||
                     info.roi_height > info.height ||
                     (info.roi_width == info.width && info.roi_height == info.height);
  if (!whole) {
    part.width = static_cast<int>(info.roi_width);
    part.height = static_cast<int>(info.roi_height);
    part.cx -= info.roi_x;
    part.cy -= info.roi_y;
    settings.push_back(fmt::format("region of interest at ({}, {})", info.roi_x, info.roi_y));
  }
  constexpr std::uint32_t kLargest = 64;
  const auto columns = std::clamp(info.binning_x, 1U, kLargest);
  const auto rows = std::clamp(info.binning_y, 1U, kLargest);
  if (columns == 1 && rows == 1) return {part, fmt::format("{}", fmt::join(settings, ", "))};
  settings.push_back(fmt::format("binned by {} x {}", columns, rows));
  RecordedCamera binned = with_pixels_of(part, columns, rows);
  binned.width = part.width / static_cast<int>(columns);
  binned.height = part.height / static_cast<int>(rows);
  return {binned, fmt::format("{}", fmt::join(settings, ", "))};
}

}  // namespace

// The "modified" model of librealsense has the same coefficients as Brown's to first order.
std::optional<Model> lens_model(const std::string& name) {
  std::string key;
  const std::string_view prefix = "distortion.";
  for (const char c : std::string_view(name).substr(name.starts_with(prefix) ? prefix.size() : 0)) {
    if (c != ' ' && c != '_' && c != '-') key += static_cast<char>(std::tolower(c));
  }
  for (const char* brown :
       {"", "none", "plumbbob", "rationalpolynomial", "thinprism", "brownconrady",
        "modifiedbrownconrady", "radtan", "radialtangential", "pinhole", "rectified", "perspective",
        "opencv", "simplepinhole", "simpleradial", "radial"}) {
    if (key == brown) return Model::kBrown;
  }
  if (key == "inversebrownconrady") return Model::kInverseBrown;
  for (const char* fisheye :
       {"equidistant", "fisheye", "kannalabrandt4", "kannalabrandt8", "opencvfisheye"}) {
    if (key == fisheye) return Model::kFisheye;
  }
  return std::nullopt;
}

LensDistortion lens_of(const std::string& model, std::vector<double> coefficients,
                       const std::string& where) {
  const char* rectify = "rectify the images, and give the camera of the rectified ones";
  while (!coefficients.empty() && coefficients.back() == 0) coefficients.pop_back();
  if (coefficients.empty()) return {};
  const auto known = lens_model(model);
  if (!known)
    throw Error(fmt::format("the distortion model '{}' is not known", model), where, rectify);
  const std::size_t most = *known == Model::kFisheye ? 4 : *known == Model::kInverseBrown ? 5 : 14;
  if (coefficients.size() > most) {
    throw Error(
        fmt::format("the lens has {} distortion coefficients, and its model '{}' at most {}",
                    coefficients.size(), model, most),
        where, rectify);
  }
  // OpenCV takes 4, 5, 8, 12 or 14 coefficients of Brown's model, and 4 of the fisheye model.
  for (const std::size_t size : {4, 5, 8, 12, 14}) {
    if (coefficients.size() > size) continue;
    coefficients.resize(size);
    break;
  }
  return {*known, std::move(coefficients)};
}

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
  const bool by_projection = info.projection[0] > 0 && (rectified || info.intrinsics[0] == 0);
  if (by_projection) {
    const auto& p = info.projection;
    camera.fx = p[0], camera.cx = p[2], camera.fy = p[5], camera.cy = p[6];
  } else {
    const auto& k = info.intrinsics;
    camera.fx = k[0], camera.cx = k[2], camera.fy = k[4], camera.cy = k[5];
    if (!rectified) camera.lens = lens_of(info.distortion_model, info.distortion);
  }
  if (!(camera.fx > 0) || !(camera.fy > 0)) return std::nullopt;
  return camera;
}

SizedCamera sized(const RecordedCamera& full, const CameraInfoMessage& info, int width,
                  int height) {
  const auto fits = [&](const RecordedCamera& c) { return c.width == width && c.height == height; };
  if (fits(full)) return {full, ""};
  SizedCamera part = with_settings(full, info);
  const bool unknown = width <= 0 || height <= 0;
  if (unknown || fits(part.camera)) return part;
  const bool same_ratio = full.width > 0 && full.height > 0 &&
                          std::int64_t{full.width} * height == std::int64_t{full.height} * width;
  if (!same_ratio) return {full, ""};
  const double ratio = static_cast<double>(full.width) / width;
  RecordedCamera scaled = with_pixels_of(full, ratio, ratio);
  scaled.width = width;
  scaled.height = height;
  return {scaled, fmt::format("scaled from {} x {}", full.width, full.height)};
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
