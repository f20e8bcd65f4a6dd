// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/simulate/mesh.hpp"
#include "stillmap/simulate/texture.hpp"

#include <span>

#include <opencv2/core.hpp>

namespace stillmap::simulate {

/// A picture without any noise.
struct Rendering {
  cv::Mat color;  ///< 32FC3, B G R in 0..255 (may exceed 255 where it is too bright); empty if not
                  ///< wanted
  cv::Mat depth;  ///< 32FC1, meters along the optical axis at the pixel's center; 0 where nothing
                  ///< is hit
  cv::Mat instances;  ///< 8UC1, Face::instance at the pixel's center
};

struct RenderOptions {
  bool color = true;  ///< false: depth and instances only, several times faster
  int threads = 1;    ///< the picture does not depend on it
};

/// Draws meshes as an ideal pinhole camera sees them, z-buffered, in two passes: which triangle is
/// seen at every sample, then the shading. Samples lie half a pixel apart, every other one on a
/// pixel's center (its depth is the pixel's depth). Of the nine samples up to half a pixel around
/// its center, a pixel shades each surface once, by its share (multisampling). Textures are
/// filtered trilinearly, anisotropically and perspective-correct. Nothing nearer than 5 cm is
/// drawn.
Rendering render(const Camera& camera, const Pose& T_world_camera,
                 std::span<const Mesh* const> meshes, const Textures& textures,
                 const RenderOptions& options = {});

}  // namespace stillmap::simulate
