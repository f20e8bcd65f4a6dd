// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/cloud.hpp"

#include <filesystem>

namespace stillmap {

/// Writes a cloud as PLY: binary little endian, per vertex float x y z [m] and uchar red green
/// blue. The same cloud gives the same bytes. Complete or not at all. Throws Error (points and
/// colors differ in number, folder missing, not writable, disk full).
void write_ply(const std::filesystem::path& file, const Cloud& cloud);

/// Reads the vertices of a binary little endian PLY whose first element is `vertex` with x, y, z
/// and, optionally, red, green, blue (or diffuse_red ...) of type uchar; points without color
/// become white. Other properties and elements are ignored; vertices that are not finite are
/// left out. Throws Error, naming the file and the fix, if it is anything else or cut short.
Cloud read_ply(const std::filesystem::path& file);

}  // namespace stillmap
