// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/scene_export.hpp"

#include "stillmap/base/bytes.hpp"
#include "stillmap/dense/map_mesh.hpp"

#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <string_view>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// From pixel centers at whole numbers to pixel centers at halves [pixels].
constexpr double kHalf = 0.5;

void put_chars(ByteWriter& out, std::string_view text, std::size_t size) {
  std::string padded(text.substr(0, size));
  padded.resize(size, '\0');
  out.put_list(std::span<const char>(padded));
}

}  // namespace

std::string colmap_cameras(const PosedImages& scene, ColmapFormat format) {
  const Camera& c = scene.camera;
  if (format == ColmapFormat::kText) {
    return fmt::format("# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n1 PINHOLE {} {} {} {} {} {}\n",
                       c.width, c.height, c.fx, c.fy, c.cx + kHalf, c.cy + kHalf);
  }
  constexpr std::int32_t kPinhole = 1;
  ByteWriter out;
  out.reserve(128);  // or GCC 12 warns of reading beyond a short string
  out.put(std::uint64_t{1});
  out.put(std::uint32_t{1});
  out.put(kPinhole);
  out.put(static_cast<std::uint64_t>(c.width));
  out.put(static_cast<std::uint64_t>(c.height));
  for (const double x : {c.fx, c.fy, c.cx + kHalf, c.cy + kHalf}) out.put(x);
  return out.take();
}

std::string colmap_images(const PosedImages& scene, ColmapFormat format) {
  std::string text = "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME; no POINTS2D\n";
  ByteWriter out;
  out.put(static_cast<std::uint64_t>(scene.images.size()));
  std::uint32_t id = 0;
  for (const SceneImage& image : scene.images) {
    const Pose T_camera_world = image.T_world_camera.inverse();
    const auto& [q, t] = std::pair(T_camera_world.quaternion(), T_camera_world.translation());
    const std::array pose{q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()};
    const std::string& name = image.name;
    fmt::format_to(std::back_inserter(text), "{} {} 1 {}\n\n", ++id, fmt::join(pose, " "), name);
    out.put(id);
    out.put_list(std::span<const double>(pose));
    out.put(std::uint32_t{1});  // camera
    put_chars(out, name, name.size() + 1);
    out.put(std::uint64_t{0});  // keypoints
  }
  return format == ColmapFormat::kText ? text : out.take();
}

std::string colmap_points(const Cloud& cloud, ColmapFormat format) {
  std::string text = "# POINT3D_ID, X, Y, Z, R, G, B, ERROR; no TRACK[]\n";
  ByteWriter out;
  out.put(static_cast<std::uint64_t>(cloud.size()));
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3f& p = cloud.points[i];
    const Rgb& color = cloud.colors[i];
    if (format == ColmapFormat::kText) {
      fmt::format_to(std::back_inserter(text), "{} {} {} {} {} 0\n", i + 1, p.x(), p.y(), p.z(),
                     fmt::join(color, " "));
      continue;
    }
    out.put(static_cast<std::uint64_t>(i + 1));
    for (const float x : p) out.put(static_cast<double>(x));
    out.put(color);
    out.put(0.0);               // error
    out.put(std::uint64_t{0});  // observations
  }
  return format == ColmapFormat::kText ? text : out.take();
}

nlohmann::json nerfstudio_transforms(const PosedImages& scene) {
  const Camera& c = scene.camera;
  nlohmann::json json = {{"camera_model", "OPENCV"},
                         {"w", c.width},
                         {"h", c.height},
                         {"fl_x", c.fx},
                         {"fl_y", c.fy},
                         {"cx", c.cx + kHalf},
                         {"cy", c.cy + kHalf},
                         {"ply_file_path", "sparse_pc.ply"},
                         {"frames", nlohmann::json::array()}};
  for (const SceneImage& image : scene.images) {
    // Cameras of nerfstudio look along -z, with y upwards.
    const Eigen::Matrix3d R =
        image.T_world_camera.rotation() * Eigen::Vector3d(1, -1, -1).asDiagonal();
    const Eigen::Vector3d& t = image.T_world_camera.translation();
    nlohmann::json rows = nlohmann::json::array();
    for (int row = 0; row < 3; ++row) rows.push_back({R(row, 0), R(row, 1), R(row, 2), t[row]});
    rows.push_back({0, 0, 0, 1});
    json["frames"].push_back({{"file_path", "images/" + image.name},
                              {"mask_path", "masks/" + image.name + ".png"},
                              {"depth_file_path", "depth/" + image.name + ".png"},
                              {"transform_matrix", rows}});
  }
  return json;
}

std::string las_bytes(const Cloud& cloud, const Pose& T_map_world) {
  constexpr double kUnit = 1e-4;  // m
  constexpr std::uint16_t kHeaderSize = 227, kRecordSize = 26;
  Eigen::AlignedBox3d extent(Eigen::Vector3d::Zero());
  ByteWriter points;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d p = T_map_world * cloud.points[i].cast<double>();
    if (i == 0) extent = Eigen::AlignedBox3d(p);
    extent.extend(p);
    for (const double x : p) points.put(static_cast<std::int32_t>(std::lround(x / kUnit)));
    points.put(std::uint16_t{0});  // intensity
    points.put(std::uint8_t{9});   // the first of one return
    points.put_list(std::span<const std::uint8_t>(std::array<std::uint8_t, 3>{}));
    points.put(std::uint16_t{0});  // source
    for (const std::uint8_t c : cloud.colors[i]) points.put(static_cast<std::uint16_t>(257 * c));
  }
  const auto count = static_cast<std::uint32_t>(cloud.size());
  ByteWriter out;
  put_chars(out, "LASF", 24);  // with source, encoding and GUID of zeros
  out.put(std::array<std::uint8_t, 2>{1, 2});
  put_chars(out, "EXTRACTION", 32);
  put_chars(out, "Stillmap", 32);
  out.put(std::array<std::uint16_t, 3>{0, 0, kHeaderSize});  // no date
  out.put(std::array<std::uint32_t, 2>{kHeaderSize, 0});
  out.put(std::uint8_t{2});  // format of points: position and color
  out.put(kRecordSize);
  out.put(std::array<std::uint32_t, 6>{count, count, 0, 0, 0, 0});
  for (const double x : {kUnit, kUnit, kUnit, 0.0, 0.0, 0.0}) out.put(x);
  for (int axis = 0; axis < 3; ++axis) {
    out.put(extent.max()[axis]);
    out.put(extent.min()[axis]);
  }
  return out.take() + points.take();
}

cv::Mat1b static_mask(const PosedView& view, const StaticGrid& grid) {
  const cv::Mat1b& kind = view.view->kind;
  const cv::Mat kept = static_pixels(view, grid);
  const cv::Mat square = cv::getStructuringElement(cv::MORPH_RECT, {3, 3});
  cv::Mat1b movers = kind == std::uint8_t{kMoverSurface};
  if (const cv::Mat3b image = image_of(view.view->photo); !image.empty()) {
    cv::Mat1b others = pixels_of_others(*view.view, image);
    cv::morphologyEx(others, others, cv::MORPH_OPEN, square);  // without single pixels
    movers |= others;
  }
  cv::Mat1b removed = cv::Mat1b::zeros(kind.size());
  for (int row = 0; row < kind.rows; ++row) {
    for (int col = 0; col < kind.cols; ++col) {
      if (view.view->is_static(row, col) && kept.at<std::uint8_t>(row, col) == 0)
        removed(row, col) = 255;
    }
  }
  cv::dilate(movers, movers, square);                          // a mask ends between two pixels
  cv::morphologyEx(removed, removed, cv::MORPH_OPEN, square);  // without single pixels
  return ~(movers | removed);
}

cv::Mat1w static_millimeters(const DenseView& view) {
  cv::Mat1w millimeters = cv::Mat1w::zeros(view.depth.size());
  for (int row = 0; row < view.depth.rows; ++row) {
    for (int col = 0; col < view.depth.cols; ++col) {
      if (!view.is_static(row, col)) continue;
      const float z = view.depth(row, col) * DenseView::kDepthUnit;
      millimeters(row, col) = static_cast<std::uint16_t>(std::lround(1000 * z));
    }
  }
  return millimeters;
}

}  // namespace stillmap
