// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/cloud.hpp"
#include "stillmap/dense/floor.hpp"
#include "stillmap/geometry/trajectory.hpp"

#include <cstdint>
#include <optional>

#include <Eigen/Core>

namespace stillmap {

/// Where the upward direction of the page comes from.
enum class UpSource : std::uint8_t {
  kRules,   ///< `up` of the file of rules.
  kRun,     ///< --up or --floor of the run, or the floor.json that its --planner wrote.
  kFloor,   ///< The floor that was found in the map.
  kImages,  ///< A guess from the surfaces in the map, or else from the images.
};

/// The upward direction of the world, and the height of the floor.
struct Ground {
  Eigen::Vector3d up = {0, -1, 0};  ///< Unit vector, world frame.
  double height = 0;                ///< Value of up . p for points p on the floor [m].
  UpSource source = UpSource::kImages;
};

/// What is known of the ground before the map is.
struct GroundHints {
  std::optional<Eigen::Vector3d> rules_up;  ///< `up` of the rules, world frame; before `floor`.
  FloorHints floor;                         ///< Of the run.
};

/// Returns the ground for the display. Up is that of the hints; without them that of the floor if
/// find_floor() is certain of one in the cloud, or else that of walls and horizontal surfaces, if
/// they show one direction, or the mean of the images' upward directions.
/// If no floor is certain, one in fifty points of the cloud is below it; without a cloud it is
/// 1.5 m below the first camera.
/// @param trajectory  of the frames or keyframes, the first camera first
Ground displayed_ground(const Trajectory& trajectory, const Cloud& cloud,
                        const GroundHints& hints = {});

/// Returns whether two grounds are the same for the eye: within a degree and 5 cm, and of one
/// source.
bool look_alike(const Ground& a, const Ground& b);

}  // namespace stillmap
