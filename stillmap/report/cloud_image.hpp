// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/trajectory.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include <opencv2/core.hpp>

namespace stillmap {

/// Points to be drawn; the spans have equal length, `marked` may be empty.
struct CloudSpan {
  std::span<const Eigen::Vector3f> points;  ///< World frame [m]; non-finite points are skipped.
  std::span<const std::array<std::uint8_t, 3>> colors;  ///< Red, green and blue of each point.
  std::span<const std::uint8_t> marked;  ///< Not zero for points drawn in red (ghosts).
};

struct CloudImageOptions {
  int width = 1600, height = 1000;  ///< Size of the image [pixels].
  bool dark = true;                 ///< Whether the background is dark.
  double splat = 0.014;             ///< Side of the square that each point covers [m].
  int supersampling = 2;     ///< Factor by which the image is drawn larger before it is averaged.
  bool draw_cameras = true;  ///< Whether to draw the camera's path and some frusta.
};

/// The viewer of a cloud, and the part of the cloud that is drawn.
struct CloudView {
  Pose T_world_viewer;                            ///< Pose of the viewer: z ahead, y down.
  Camera viewer;                                  ///< Intrinsics [pixels of the image].
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< Up in the world, unit length.
  double cut =
      std::numeric_limits<double>::infinity();  ///< Points above this height are skipped [m].
};

/// Returns a view from behind and above the cameras along their mean viewing direction, so that
/// surfaces are shown from the recorded side. Points well above the cameras are cut off, so that
/// ceilings do not hide the room. The distance is such that nearly all points fill the image.
CloudView choose_cloud_view(const CloudSpan& cloud, const Trajectory& cameras,
                            const CloudImageOptions& options = {});

/// Draws the cloud as z-buffered square splats whose size follows from their depth, with eye-dome
/// lighting (Boucheny 2009): pixels behind their neighbors are darkened, which shows shape without
/// normals. Returns 8UC3 BGR, only background for an empty cloud. Throws Error if the lengths of
/// the spans differ.
cv::Mat draw_cloud(const CloudSpan& cloud, const Trajectory& cameras, const CloudView& view,
                   const CloudImageOptions& options = {});

/// Draws the cloud with the view of choose_cloud_view().
cv::Mat draw_cloud(const CloudSpan& cloud, const Trajectory& cameras,
                   const CloudImageOptions& options = {});

}  // namespace stillmap
