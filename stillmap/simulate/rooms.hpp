// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/simulate/palette.hpp"
#include "stillmap/simulate/scene.hpp"

#include <vector>

namespace stillmap::simulate {

/// Where things of no known class move.
struct ThingPlan {
  Eigen::Vector3f hook;  ///< the crane's hook hangs from here
  Eigen::Vector2f chair_from, chair_to, ball_from, ball_to;
};

/// The places that a room keeps free for those who move.
struct RoomPlan {
  std::vector<Eigen::Vector2f> walk;   ///< corners of a closed way over the floor
  float walk_start = 0;                ///< where the first walker is at time 0, arc length [m]
  std::vector<Transform> seats;        ///< chairs, facing -y
  std::vector<Transform> spots;        ///< where one can stand and wave, facing -y
  std::vector<Eigen::Vector2f> rise;   ///< a closed way that begins beside the last seat
  std::vector<Eigen::Vector2f> crowd;  ///< a closed way that passes close before the viewpoint
  double crowd_height = 1.2;           ///< of the viewpoint there, so that bodies fill the view
  ThingPlan things, near_things;       ///< the latter close to the viewpoint, in its view
};

/// An office of 6.4 m x 5.6 m x 2.7 m: two desks face to face on a rug, shelves, a sofa, a window,
/// a brick wall, pictures. Fills statics (not lit yet), lighting, viewpoint and room.
RoomPlan build_office(Palette& palette, Scene& scene);

/// Four rooms of 7.4 m x 6.4 m around a cross of walls, each with passages to the next two: a way
/// of some 60 m through all and back. Every room has its own wallpapers, pictures and furniture,
/// but the desks in the middle of the first and the third are the same to the last mug.
RoomPlan build_flat(Palette& palette, Scene& scene);

}  // namespace stillmap::simulate
