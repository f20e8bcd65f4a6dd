// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/simulate/lighting.hpp"
#include "stillmap/simulate/mesh.hpp"

#include <functional>
#include <string>
#include <vector>

namespace stillmap::simulate {

struct Palette;

/// A piece of a mover that is rigid in itself.
struct RigidPart {
  Mesh mesh;                        ///< in the part's own frame
  std::vector<ShadowBall> shadows;  ///< in the part's own frame
};

/// A thing whose parts follow time: a person, or something of no known class.
struct Mover {
  int id = 0;           ///< 1..255, its value in instance masks
  bool person = false;  ///< else: of no known class
  std::string name;     ///< "person", "crate", "chair", "ball"
  std::vector<RigidPart> parts;
  std::function<std::vector<Transform>(double seconds)> T_world_part;  ///< one per part
};

/// The mover at one time, in the world frame, its faces marked with its id.
struct PosedMover {
  Mesh mesh;
  std::vector<ShadowBall> shadows;
  Eigen::Vector3d centroid;  ///< of the surface: every square meter counts alike
  Eigen::AlignedBox3d box;   ///< around all vertices, along the world's axes
};
PosedMover pose_at(const Mover& mover, double seconds);

/// Velocity of the centroid [m/s], by central difference over 2 ms.
Eigen::Vector3d velocity_at(const Mover& mover, double seconds);

/// Things of no known class: a crate that swings on a crane's hook above `pivot`'s floor point, ...
Mover make_crate(int id, const Eigen::Vector3f& pivot, Palette& palette);
/// ... an office chair pushed back and forth over the floor, and a ball that rolls back and forth.
Mover make_pushed_chair(int id, const Eigen::Vector2f& from, const Eigen::Vector2f& to,
                        Palette& palette);
Mover make_ball(int id, const Eigen::Vector2f& from, const Eigen::Vector2f& to, Palette& palette);

}  // namespace stillmap::simulate
