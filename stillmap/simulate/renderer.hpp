// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/simulate/mesh.hpp"
#include "stillmap/simulate/texture.hpp"

#include <span>

#include <opencv2/core.hpp>

namespace stillmap::simulate {

/// A rendered image without noise.
struct Rendering {
  /// 32FC3, B G R in 0..255 (may exceed 255 in overexposed areas); empty if not requested.
  cv::Mat color;
  /// 32FC1, depth along the optical axis at the pixel center [m]; 0 without a surface.
  cv::Mat depth;
  cv::Mat instances;  ///< Instance mask, 8UC1, Face::instance at the pixel center.
};

struct RenderOptions {
  /// Whether color is rendered; depth and instances alone are several times faster.
  bool color = true;
  int threads = 1;  ///< Number of threads; the result does not depend on it.
  /// Rolling shutter: twist (translation [m], rotation [rad]; see Pose::exp) of the camera from the
  /// first to the last row, in the frame of the camera at the middle row, to which the pose
  /// belongs. Applied at the vertices: edges of large faces remain straight. Zero: global shutter.
  Eigen::Matrix<double, 6, 1> motion = Eigen::Matrix<double, 6, 1>::Zero();
};

/// Renders meshes for an ideal pinhole camera with a z-buffer, in two passes: visible triangles at
/// every sample, then shading. Samples are half a pixel apart, every other one at a pixel center
/// (which gives the depth of the pixel). Each pixel shades each surface once, weighted by its share
/// of the nine samples within half a pixel (multisampling). Textures are filtered trilinearly,
/// anisotropically and perspective-correct. Surfaces nearer than 5 cm are not rendered.
Rendering render(const Camera& camera, const Pose& T_world_camera,
                 std::span<const Mesh* const> meshes, const Textures& textures,
                 const RenderOptions& options = {});

}  // namespace stillmap::simulate
