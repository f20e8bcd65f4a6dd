// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/simulate/simulated_sequence.hpp"

#include <cstddef>
#include <filesystem>
#include <functional>

namespace stillmap {

/// Writes a sequence in TUM RGB-D layout with its truth:
/// - rgb/, depth/ (16-bit PNG, Camera::depth_factor units per meter), listed in rgb.txt, depth.txt
///   and associations.txt;
/// - groundtruth.txt: T_world_camera of every frame, TUM format;
/// - camera.yaml: read by read_camera();
/// - mask/: 8-bit PNG, 255 person, 128 mover of no known class, 0 static; named like the color
///   images;
/// - instance/: 8-bit PNG, the id of the visible mover, 0 static;
/// - speed/: 8-bit PNG, speed of the visible surface in the world frame, separate for each limb, in
///   5 mm/s (255: 1.275 m/s and more);
/// - surface.ply: the observed static surface, one point per centimeter (world frame [m]);
/// - truth_movers.csv: position of every mover in every frame (centroid of its surface, velocity,
///   box; world frame [m, m/s]), the number of pixels that show it, its share inside the image
///   borders, and its share that is also not occluded;
/// - things.csv: static objects of COCO classes (boxes, world frame [m]);
/// - rearranged.csv: furniture that is elsewhere, or not there, at one of the two visits (its boxes
///   at each, world frame [m]); none for other scenes;
/// - tags.csv: the corners of every AprilTag in the order of Tag::corners (world frame [m]); none
///   for scenes without tags.
/// @param done  called after each frame with the number of frames written so far; if it returns
/// false, the sequence ends there; may be empty
/// @returns the number of frames written
/// Throws Error for a folder with files that are not those of a simulated sequence, which it would
/// replace, and with the file name if a file cannot be written (folder not writable, disk full);
/// lists are written last, so an incomplete sequence has none.
std::size_t write_tum_layout(const SimulatedSequence& sequence, const std::filesystem::path& folder,
                             const std::function<bool(std::size_t)>& done = {});

}  // namespace stillmap
