// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/cloud.hpp"
#include "stillmap/dense/dense_map.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>
#include <opencv2/core.hpp>

namespace stillmap {

/// An image for programs that reconstruct scenes from posed images: images/NAME with the mask
/// masks/NAME.png (0: not the static world) and the depth depth/NAME.png (16 bits, millimeters).
struct SceneImage {
  std::string name;  ///< With extension, without folder.
  Pose T_world_camera;
};

/// Posed images of one camera, whose pixel centers are at whole numbers as everywhere in Stillmap;
/// the written files have them at halves, as other programs expect.
struct PosedImages {
  Camera camera;
  std::vector<SceneImage> images;
};

/// Returns the files of a COLMAP model, binary or text
/// (https://colmap.github.io/format.html): cameras, images without keypoints, and points without
/// tracks.
enum class ColmapFormat { kBinary, kText };
std::string colmap_cameras(const PosedImages& scene, ColmapFormat format);
std::string colmap_images(const PosedImages& scene, ColmapFormat format);
std::string colmap_points(const Cloud& cloud, ColmapFormat format);

/// Returns transforms.json of nerfstudio; the points of the scene are in sparse_pc.ply.
nlohmann::json nerfstudio_transforms(const PosedImages& scene);

/// Returns a cloud as a LAS 1.2 file (ASPRS) with colors, in units of 0.1 mm.
/// @param T_map_world  to the frame of the file, whose z axis is up
std::string las_bytes(const Cloud& cloud, const Pose& T_map_world);

/// Returns 0 for the pixels whose photo shows movers, or surfaces that the votes of other views
/// removed; 255 for all others.
cv::Mat1b static_mask(const PosedView& view, const StaticGrid& grid);

/// Returns the static depths of a view in millimeters; 0 for none.
cv::Mat1w static_millimeters(const DenseView& view);

}  // namespace stillmap
