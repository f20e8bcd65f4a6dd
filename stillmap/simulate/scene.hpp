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
  std::string scene = "office";  ///< office; flat: four rooms, a way of 60 m
  int people = 2;                ///< 0..6
  /// What they do: walk (all), sit (two on chairs, the others stand and wave), wave (all), mixed
  /// (first walks, second sits, third waves, fourth walks, ...), rise (as sit, but they keep nearly
  /// still, and after four seconds the first gets up and walks away), companion (the first walks
  /// ahead of camera motion "follow", filling about half of its view; the others wave), crowd (all
  /// walk past the camera in close file, so near that next to nothing else is seen for a second or
  /// two; wants four people or more, and camera motion static or xyz)
  std::string activity = "walk";
  int things = 0;  ///< movers of no known class, 0..3: swinging crate, pushed chair, rolling ball
  int seed = 1;    ///< another seed, another wallpaper, other books and clothes
  bool near_things = false;  ///< they move within two or three meters of the viewpoint, in its view
  double pace = 1;           ///< factor on a companion's speed: that on the camera's
  STILLMAP_FIELDS(scene, people, activity, things, seed, near_things, pace)
};

/// Where a camera is held, and what it looks at. The camera motions start from it.
struct Viewpoint {
  Eigen::Vector3d position, target;  ///< meters, world
};

/// A room in which some things move. World frame: meters, z up, the floor at z = 0.
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

/// A camera that is carried around, and a companion ahead of it.
constexpr double kCarriedSpeed = 0.4;       // m/s
constexpr double kCompanionDistance = 0.7;  // along the way [m]

/// Names that SceneOptions::scene may have.
const std::vector<std::string>& scene_names();
/// Names that SceneOptions::activity may have.
const std::vector<std::string>& activity_names();

/// Builds, furnishes and lights a scene; some tenths of a second. The same options give the same
/// scene. Throws Error for an unknown scene or activity, or a number of people or things out of
/// range.
Scene make_scene(const SceneOptions& options);

}  // namespace stillmap
