// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/cloud.hpp"
#include "stillmap/dense/semantic_map.hpp"
#include "stillmap/geometry/voxel_key.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace stillmap {

/// A cloud with the classes of its points.
struct LabeledCloud {
  std::shared_ptr<const Cloud> cloud = std::make_shared<const Cloud>();  ///< Never null.
  std::vector<Voxel> voxels;          ///< Voxel of each point, each another one; or empty.
  std::vector<std::uint16_t> labels;  ///< Class of each point, 0 for none; or empty.
  std::vector<std::string> classes;   ///< Names of the classes 1, 2, 3 ...
};

/// Returns the connected parts of each class, with boxes and without confidences: the static
/// objects as far as they can be told during the run. Points are connected if their voxels of 10 cm
/// touch. Two objects of one class that touch are one here; make_semantic_map() tells them apart.
std::vector<StaticObject> connected_objects(const LabeledCloud& labeled);

}  // namespace stillmap
