// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// The static surface observed in a sequence, from its exact depth: the reference for a map.
class SeenSurface {
 public:
  /// @param edge  side of the voxels, each of which holds one point [m]
  explicit SeenSurface(const Camera& camera, double edge = 0.01) : camera_(camera), edge_(edge) {}

  /// Adds the static pixels of a frame up to kFarthest, every second one in both directions.
  void add(const TruthFrame& truth);

  /// Returns the mean of each voxel's pixels, ordered by voxel; world frame [m].
  std::vector<Eigen::Vector3f> points() const;

  static constexpr float kFarthest = 5;  ///< Maximum depth [m].

 private:
  struct Sum {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::uint32_t count = 0;
  };
  Camera camera_;
  double edge_;
  std::unordered_map<std::uint64_t, Sum> voxels_;
};

/// Returns points as a binary little-endian PLY file with float x y z.
std::string points_ply(const std::vector<Eigen::Vector3f>& points);

}  // namespace stillmap
