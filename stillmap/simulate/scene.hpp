// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/simulate/lighting.hpp"
#include "stillmap/simulate/mesh.hpp"
#include "stillmap/simulate/mover.hpp"
#include "stillmap/simulate/texture.hpp"
#include "stillmap/simulate/trolley.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

struct SceneOptions {
  /// Scene: office, flat (four rooms, a path of 60 m), or yard (containers below a crane).
  std::string scene = "office";
  int people = 2;  ///< Number of people, 0 to 6.
  /// Activity: walk (all), sit (two on chairs, the others stand and wave), wave (all), mixed (the
  /// first walks, the second sits, the third waves, the fourth walks, ...), rise (as sit, but
  /// nearly motionless; after four seconds the first gets up and walks away), companion (the first
  /// walks ahead of camera motion "follow" and fills about half of its view; the others wave),
  /// crowd (all walk past the camera in close file, covering nearly the whole view for a second or
  /// two; needs at least four people and camera motion static or xyz).
  std::string activity = "walk";
  /// Number of movers of no known class, 0 to 3: swinging crate, pushed chair, rolling ball; in the
  /// yard the crane's swinging hook and two vehicles.
  int things = 0;
  int seed = 1;  ///< Seed of wallpaper, books and clothes.
  /// Number of AprilTags of family tag36h11 with a side of 0.2 m: on walls, 0 to 12; in the yard on
  /// containers, 0 to 9.
  int tags = 0;
  /// Visit of the office: 1, or 2, when some pieces of furniture have been moved, removed or added.
  int visit = 1;
  /// Light: day, or evening (40 % of the ambient light; every other lamp and the window are dark).
  std::string light = "day";
  /// Whether these objects move in view, within two or three meters of the viewpoint; in the yard
  /// the hook also carries a load that fills a third of the view.
  bool near_things = false;
  /// Factor on the speed of a companion and of the crane's trolley, equal to that of the camera.
  double pace = 1;
  int threads = 2;  ///< Number of threads that compute the light; it does not depend on them.
};

/// Initial camera position and target of the camera motions.
struct CameraAnchor {
  Eigen::Vector3d position, target;  ///< World positions [m].
};

/// A piece of furniture that is elsewhere, or not there, at one of the visits of SceneOptions.
struct Rearrangement {
  std::string name;
  Eigen::AlignedBox3f first, second;  ///< Its boxes at the visits; empty: it is not there [m].
};

/// An AprilTag of a scene.
struct PlacedTag {
  std::uint32_t id = 0;  ///< Number within the family.
  /// Corners of its black border in the order of Tag::corners, world frame [m].
  std::array<Eigen::Vector3d, 4> corners;
};

/// A room with moving objects. World frame: meters, z up, the floor at z = 0.
struct Scene {
  simulate::Mesh statics;       ///< Static mesh with light, in the world frame.
  simulate::Textures textures;  ///< Textures of the static mesh and the movers.
  simulate::Lighting lighting;
  std::vector<Rearrangement> rearranged;  ///< What differs between the visits.
  std::vector<PlacedTag> tags;            ///< By id.
  std::vector<simulate::Mover> movers;    ///< Movers with ids 1, 2, 3, ...
  CameraAnchor viewpoint;
  Eigen::AlignedBox3d room;  ///< Space inside walls, floor and ceiling [m].
  /// Closed path around the room for a hand-held camera at eye height [m].
  std::vector<Eigen::Vector2f> round;
  std::optional<Trolley> trolley;  ///< Trolley of the crane with the camera, in the yard.
};

/// Speed of a hand-held camera on a path, and its distance to a companion.
constexpr double kCarriedSpeed = 0.4;       // m/s
constexpr double kCompanionDistance = 0.7;  // along the way [m]

/// Returns the names for SceneOptions::scene.
const std::vector<std::string>& scene_names();
/// Returns the names for SceneOptions::activity.
const std::vector<std::string>& activity_names();
/// Returns the names for SceneOptions::light.
const std::vector<std::string>& light_names();

/// Builds, furnishes and lights a scene in a few tenths of a second. Equal options give equal
/// scenes. Throws Error for an unknown scene, activity or light, or a number of people, objects or
/// tags out of range.
Scene make_scene(const SceneOptions& options);

}  // namespace stillmap
