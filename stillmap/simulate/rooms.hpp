// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/simulate/palette.hpp"
#include "stillmap/simulate/scene.hpp"

#include <vector>

namespace stillmap::simulate {

/// Positions of moving objects of no known class.
struct ObjectPlan {
  Eigen::Vector3f hook;  ///< Suspension point of the crane's hook [m].
  Eigen::Vector2f chair_from, chair_to, ball_from, ball_to;
};

/// A straight lane of a vehicle that drives to and fro [m].
struct Lane {
  Eigen::Vector2f from, to;
};

/// Positions in a room for moving people and objects.
struct RoomPlan {
  std::vector<Eigen::Vector2f> walk;  ///< Corners of a closed path on the floor [m].
  float walk_start = 0;               ///< Position of the first walker at time 0, arc length [m].
  std::vector<Transform> seats;       ///< Chairs, facing -y.
  std::vector<Transform> spots;       ///< Positions for standing and waving, facing -y.
  std::vector<Eigen::Vector2f> rise;  ///< Closed path that starts next to the last seat [m].
  /// Closed path that passes close in front of the viewpoint [m].
  std::vector<Eigen::Vector2f> crowd;
  /// Height of the viewpoint for `crowd` [m], so that bodies fill the view.
  double crowd_height = 1.2;
  /// Positions of objects; the latter close to the viewpoint, in its view.
  ObjectPlan things, near_things;
  /// Places of tags as for hang_tags(), in the order in which they are used.
  std::vector<Transform> tag_places;
  /// Lanes of vehicles in a scene with a crane, whose objects they are, together with its hook.
  std::vector<Lane> vehicles;
};

/// Builds an office of 6.4 m x 5.6 m x 2.7 m: two desks face to face on a rug, shelves, a sofa, a
/// window, a brick wall, posters. Sets statics (not lit yet), lighting, viewpoint, room and
/// rearranged.
/// @param visit  as SceneOptions::visit
RoomPlan build_office(int visit, Palette& palette, Scene& scene);

/// Builds four rooms of 7.4 m x 6.4 m around a cross of walls, each with passages to the next two:
/// a path of about 60 m through all and back. Every room has its own wallpaper, posters and
/// furniture, but the desks in the center of the first and the third are identical.
RoomPlan build_flat(Palette& palette, Scene& scene);

/// Builds a hall of 10 m x 13 m x 5.5 m below a bridge crane: containers of 2 m x 1 m x 1.1 m,
/// pallets, barrels, marked lanes and shelves. The camera is below the trolley, 2.7 m above the
/// floor, and looks ahead (+y) and 42 degrees down.
RoomPlan build_yard(Palette& palette, Scene& scene);

}  // namespace stillmap::simulate
