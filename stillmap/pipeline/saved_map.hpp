// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_view.hpp"
#include "stillmap/map/map.hpp"

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace stillmap {

/// What the dense map keeps of a keyframe, and where it stands: beside a keyframe that is still in
/// the map, so that it moves with it.
struct AnchoredView {
  KeyframeId anchor;
  Pose T_anchor_camera;
  DenseView view;
};

/// All that a saved map holds.
struct SavedMap {
  std::string writer;  ///< the program that wrote it, with its version
  MapContent map;
  std::vector<AnchoredView> views;  ///< of the dense map; empty if it was saved without
};

/// A saved map as the bytes of its file: see docs/map_file.md. The same map gives the same bytes.
std::string saved_map_bytes(const SavedMap& saved);

/// The map in such bytes. Throws Error for all that is no map of this program, cut short, altered,
/// of another version, or not consistent.
/// @param where  the file's name, for messages
SavedMap saved_map_from_bytes(std::string_view bytes, const std::string& where);

/// Complete or not at all. Throws Error (folder missing, not writable, disk full).
void write_saved_map(const std::filesystem::path& file, const SavedMap& saved);
/// Throws Error as saved_map_from_bytes(), and if the file cannot be read.
SavedMap read_saved_map(const std::filesystem::path& file);

/// Throws Error unless frames of this camera and pyramid can be found in the map, and added to it:
/// same image size, same intrinsics, same pyramid. What the camera's images were before they were
/// rectified does not matter.
void require_same_camera(const MapContent& map, const Camera& camera, const PyramidShape& pyramid,
                         const std::string& where);

}  // namespace stillmap
