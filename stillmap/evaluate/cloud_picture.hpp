// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/trajectory.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
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
  int width = 1600, height = 1000;  ///< pixels
  bool dark = true;                 ///< background
  double splat = 0.012;             ///< side of the square that each point covers [m]
  int supersampling = 2;            ///< drawn this many times larger, then averaged
  bool draw_cameras = true;         ///< the camera's path and a few of its frusta
};

/// From where the cloud is looked at.
struct CloudView {
  Pose T_world_viewer;  ///< z ahead, y down
  Camera viewer;        ///< pixels of the finished picture
  double near = 0.1;    ///< nothing nearer is drawn: walls between the viewer and the scene [m]
};

/// A view from behind and above the cameras, into the direction they looked in on average: so
/// surfaces are seen from the side that was recorded. The middle 96 per cent of the points fill the
/// picture.
CloudView choose_cloud_view(const CloudSpan& cloud, const Trajectory& cameras,
                            const CloudPictureOptions& options = {});

/// Draws the cloud as z-buffered square splats whose size follows from their depth, shaded by
/// eye-dome lighting (Boucheny 2009): pixels behind their neighbours are darkened, which shows
/// shape without normals. 8UC3 BGR; only the background where there is no point.
cv::Mat draw_cloud(const CloudSpan& cloud, const Trajectory& cameras,
                   const CloudPictureOptions& options = {});
cv::Mat draw_cloud(const CloudSpan& cloud, const Trajectory& cameras, const CloudView& view,
                   const CloudPictureOptions& options = {});

/// draw_cloud as a PNG. Throws Error if it cannot be written.
void write_cloud_picture(const std::filesystem::path& file, const CloudSpan& cloud,
                         const Trajectory& cameras, const CloudPictureOptions& options = {});

}  // namespace stillmap
