// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/trajectory.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <span>

#include <opencv2/core.hpp>

namespace stillmap {

/// Points to be drawn; spans of equal length, `marked` may be empty.
struct CloudSpan {
  std::span<const Eigen::Vector3f> points;  ///< world frame [m]; not finite ones are left out
  std::span<const std::array<std::uint8_t, 3>> colors;  ///< red, green, blue
  std::span<const std::uint8_t> marked;                 ///< not zero: drawn in signal red (ghosts)
};

struct CloudPictureOptions {
  int width = 1600, height = 1000;  ///< of the finished picture [pixels]
  bool dark = true;                 ///< background
  double splat = 0.014;             ///< side of the square that each point covers [m]
  int supersampling = 2;            ///< drawn this many times larger, then averaged
  bool draw_cameras = true;         ///< the camera's path, and its frustum at a few places
};

/// From where a cloud is looked at, and what of it.
struct CloudView {
  Pose T_world_viewer;                            ///< z ahead, y down
  Camera viewer;                                  ///< in pixels of the finished picture
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< the world's up, unit length
  double cut =
      std::numeric_limits<double>::infinity();  ///< points higher than this are left out [m]
};

/// A view from behind and above the cameras along the direction they looked in on average, so that
/// surfaces are seen from the side that was recorded, and cut open above the cameras like a doll's
/// house, so that ceilings do not hide the room. Distance: the middle of the points fills the
/// picture.
CloudView choose_cloud_view(const CloudSpan& cloud, const Trajectory& cameras,
                            const CloudPictureOptions& options = {});

/// Draws the cloud as z-buffered square splats whose size follows from their depth, with eye-dome
/// lighting (Boucheny 2009): pixels behind their neighbors are darkened, which shows shape without
/// normals. 8UC3 BGR; nothing but background for an empty cloud. Throws Error if the spans' lengths
/// differ.
cv::Mat draw_cloud(const CloudSpan& cloud, const Trajectory& cameras, const CloudView& view,
                   const CloudPictureOptions& options = {});

/// The same from choose_cloud_view.
cv::Mat draw_cloud(const CloudSpan& cloud, const Trajectory& cameras,
                   const CloudPictureOptions& options = {});

/// draw_cloud as a PNG. Throws Error if it cannot be written.
void write_cloud_picture(const std::filesystem::path& file, const CloudSpan& cloud,
                         const Trajectory& cameras, const CloudPictureOptions& options = {});

}  // namespace stillmap
