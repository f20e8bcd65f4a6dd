// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/simulate/lighting.hpp"
#include "stillmap/simulate/mesh.hpp"
#include "stillmap/simulate/trolley.hpp"

#include <functional>
#include <string>
#include <vector>

namespace stillmap::simulate {

struct Palette;

/// A rigid part of a mover.
struct RigidPart {
  Mesh mesh;                        ///< In the part's own frame
  std::vector<ShadowBall> shadows;  ///< In the part's own frame
};

/// A moving object with time-dependent parts: a person, or an object of no known class.
struct Mover {
  int id = 0;           ///< Value in instance masks, 1 to 255.
  bool person = false;  ///< Whether it is a person; otherwise it has no known class.
  std::string name;     ///< "person", "crate", "chair", "ball", "hook", "vehicle"
  std::vector<RigidPart> parts;
  std::function<std::vector<Transform>(double seconds)> T_world_part;  ///< One per part.
};

/// The mover at one time in the world frame, its faces marked with its id.
struct PosedMover {
  Mesh mesh;
  std::vector<ShadowBall> shadows;
  Eigen::Vector3d centroid;  ///< Area-weighted centroid of the surface.
  Eigen::AlignedBox3d box;   ///< Axis-aligned bounding box in the world frame [m].
};
PosedMover pose_at(const Mover& mover, double seconds);

/// Returns the velocity of the centroid [m/s], by central difference over 2 ms.
Eigen::Vector3d velocity_at(const Mover& mover, double seconds);

/// An object of no known class: a crate that swings on a crane's hook above the floor point of
/// `pivot`.
Mover make_crate(int id, const Eigen::Vector3f& pivot, Palette& palette);
/// Objects of no known class: an office chair pushed back and forth, and a ball rolling back and
/// forth.
Mover make_pushed_chair(int id, const Eigen::Vector2f& from, const Eigen::Vector2f& to,
                        Palette& palette);
Mover make_ball(int id, const Eigen::Vector2f& from, const Eigen::Vector2f& to, Palette& palette);
/// Objects of no known class in the yard: the hook block of a crane, which swings below its trolley
/// (`pace`: factor on the speed of the trolley), and a vehicle that drives to and fro. A loaded
/// hook has a shorter rope and carries a box; together they fill a third of the camera's view.
Mover make_hook(int id, const Trolley& trolley, double pace, bool loaded, Palette& palette);
Mover make_vehicle(int id, const Eigen::Vector2f& from, const Eigen::Vector2f& to,
                   Palette& palette);

}  // namespace stillmap::simulate
