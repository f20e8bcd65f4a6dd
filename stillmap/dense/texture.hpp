// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/mesh.hpp"

#include <functional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace stillmap {

/// A mesh with an image on its triangles.
struct TexturedMesh {
  /// A vertex in several charts of the image is there several times.
  TriangleMesh mesh;
  /// The places of the vertices in the image, from its upper left corner to the right and downwards
  /// [0..1].
  std::vector<Eigen::Vector2f> places;
  cv::Mat3b image;  ///< B G R.
};

/// Returns the colors of points on a mesh, world frame [m].
using PointColors = std::function<std::vector<Rgb>(const std::vector<Eigen::Vector3f>&)>;

/// Returns a mesh with a texture: its charts are put side by side into an image, and each texel on
/// a triangle gets the color of its point.
/// @param texel  side of a texel [m]; larger if the image would have more than 8192 x 8192, which
///   graphics cards may refuse
TexturedMesh textured(const TriangleMesh& mesh, double texel, const PointColors& colors);

}  // namespace stillmap
