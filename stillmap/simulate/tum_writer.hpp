// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/simulate/simulated_sequence.hpp"

#include <cstddef>
#include <filesystem>
#include <functional>

namespace stillmap {

/// Writes a sequence in TUM RGB-D layout, with the truth beside it:
/// - rgb/, depth/ (16-bit PNG, Camera::depth_factor units per meter), listed in rgb.txt, depth.txt
/// and
///   associations.txt;
/// - groundtruth.txt: T_world_camera of every frame, TUM format;
/// - camera.yaml: what load_camera() reads;
/// - mask/: 8-bit PNG, 255 person, 128 mover of no known class, 0 static; named like the color
/// images;
/// - instance/: 8-bit PNG, the id of the mover seen, 0 static;
/// - speed/: 8-bit PNG, how fast what is seen moves through the world, in 5 mm/s (255: 1.275 m/s
///   and more), each limb for itself;
/// - surface.ply: the static surface that was seen, a point per centimeter (world frame, meters);
/// - truth_movers.csv: where every mover is in every frame (centroid of its surface, velocity, box;
///   world frame, meters, meters per second), how many pixels show it, what share of it lies
///   between the picture's borders, and what share of it is not covered there either;
/// - things.csv: which static things of COCO's classes stand where (boxes, world frame, meters).
/// @param done called after each frame with the number of frames written so far; may be empty
/// Throws Error that names the file if one cannot be written (folder not writable, disk full); the
/// lists are written last, so that a sequence cut short has none.
void write_tum_layout(const SimulatedSequence& sequence, const std::filesystem::path& folder,
                      const std::function<void(std::size_t)>& done = {});

}  // namespace stillmap
