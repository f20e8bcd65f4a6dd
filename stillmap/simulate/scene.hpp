// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/simulate/lighting.hpp"
#include "stillmap/simulate/mesh.hpp"
#include "stillmap/simulate/mover.hpp"
#include "stillmap/simulate/texture.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace stillmap {

struct SceneOptions {
  std::string scene = "office";  ///< which room: see scene_names()
  int people = 2;                ///< 0..6
  /// What they do: walk (all), sit (two on chairs, the others stand and wave), wave (all), mixed
  /// (first walks, second sits, third waves, fourth walks, ...)
  std::string activity = "walk";
  int things = 0;  ///< movers of no known class, 0..3: swinging crate, pushed chair, rolling ball
  int seed = 1;    ///< another seed, another wallpaper, other books and clothes
  STILLMAP_FIELDS(scene, people, activity, things, seed)
};

/// Where a camera is held, and what it looks at. The camera motions start from it.
struct Viewpoint {
  Eigen::Vector3d position, target;  ///< metres, world
};

/// A room in which some things move. World frame: metres, z up, the floor at z = 0.
struct Scene {
  simulate::Mesh statics;       ///< lit, in the world frame
  simulate::Textures textures;  ///< of the statics and of the movers
  simulate::Lighting lighting;
  std::vector<simulate::Mover> movers;  ///< ids 1, 2, 3 ...
  Viewpoint viewpoint;
  Eigen::AlignedBox3d room;  ///< inside of walls, floor and ceiling
  /// A closed way around the room on which a camera can be carried, at eye height.
  std::vector<Eigen::Vector2f> round;
};

/// Names that SceneOptions::scene may have.
const std::vector<std::string>& scene_names();

/// Builds, furnishes and lights a scene; some tenths of a second. The same options give the same
/// scene. Throws Error for an unknown scene or activity, or a number of people or things out of
/// range.
Scene make_scene(const SceneOptions& options);

}  // namespace stillmap
