// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/surfels.hpp"
#include "stillmap/geometry/pose.hpp"

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// The plane of the floor.
struct Floor {
  Eigen::Vector3d up = {0, -1, 0};  ///< Unit normal, world frame.
  double height = 0;                ///< Value of up . p for its points p [m].
};

/// Measurements that support a floor.
struct FloorEvidence {
  double area = 0;           ///< Observed area of the floor [m^2].
  double width = 0;          ///< Extent of that area in its narrow direction [m].
  double area_below = 0;     ///< Area of surfaces more than 0.1 m below the floor [m^2].
  double camera_height = 0;  ///< Height of the first camera above the floor [m].
};

/// A floor, or the reason why it is unknown.
struct FloorFinding {
  std::optional<Floor> floor = std::nullopt;
  /// Upward direction, world frame; may be known without the floor.
  std::optional<Eigen::Vector3d> up = std::nullopt;
  /// Standard deviation of `up` in its least certain direction [rad]; 0 if it was given.
  double up_sigma = 0;
  double confidence = 0;  ///< That the level is the floor [0..1]; 1 if its height was given.
  FloorEvidence evidence = {};
  std::string reason = {};  ///< Why the floor is unknown; empty if it is known.
};

/// Known values of the floor, which replace the estimated ones.
struct FloorHints {
  /// Upward direction in the frame of the first camera.
  std::optional<Eigen::Vector3d> up = std::nullopt;
  /// Upward direction by an accelerometer, world frame, within about half a degree: surfaces near
  /// horizontal and vertical make it more precise.
  std::optional<Eigen::Vector3d> gravity = std::nullopt;
  /// Height of the first camera above the floor [m].
  std::optional<double> camera_height = std::nullopt;
  /// The floor itself, world frame.
  std::optional<Floor> floor = std::nullopt;
};

/// Finds the floor: the lowest large horizontal surface with nothing below it.
///
/// The upward direction is the one to which most surfaces are parallel or perpendicular, within 50
/// degrees of the mean upward direction of the images, such that the cameras do not look up, and
/// perpendicular to the rows of the images (cameras are seldom rolled); with an accelerometer it is
/// the one within 2 degrees of that of gravity, or gravity's. Without, it is unknown if another
/// one is nearly as probable, or if the opposite one has a certain floor and it has none. A floor
/// of low confidence is unknown: one of which little was observed, that is as narrow as a table and
/// near the camera, or that has other surfaces below. So is one whose upward direction has a
/// standard deviation of more than 1 degree: cubes of 1 m of one surface count as independent
/// measurements, as far off as they deviate from the direction of all, and by 2 degrees more.
/// Errors that all surfaces share, such as a wrong calibration, are not part of it. If the images
/// seem to be turned by 90 or 180 degrees, FloorFinding::reason names the rotation.
/// @param surfels of the static world, with sides of kFloorSurfel
/// @param cameras T_world_camera of the views, the first camera first
FloorFinding find_floor(const std::vector<Surfel>& surfels, const std::vector<Pose>& cameras,
                        const FloorHints& hints = {});

/// Returns R_upright_world. Its rows are two horizontal axes, along and across most walls, and the
/// upward direction of the finding, or the mean upward direction of the images if it is unknown.
/// @param finding  result of find_floor() for these surfels and cameras
Eigen::Matrix3d upright_axes(const FloorFinding& finding, const std::vector<Surfel>& surfels,
                             const std::vector<Pose>& cameras);

/// Side of the cubes of the surfels that the floor is searched in [m].
inline constexpr double kFloorSurfel = 0.05;

/// Returns whether z points up in the world, as at a site (SiteAlignment): within 2 degrees, the
/// error of a found floor. The world of a run without a site has z along its first view.
bool is_upright(const Eigen::Vector3d& up);

/// Returns T_map_world of frame `map`, in which planners get their maps: z up from the floor, the
/// camera above the origin, x along its horizontal viewing direction. In an upright world x and y
/// are those of the world.
Pose map_frame(const Floor& floor, const Pose& T_world_camera);

/// Returns the angle from the x axis of frame `map` to the direction along or across which most
/// walls run, in [-45, 45) degrees [rad]; 0 without walls.
double wall_direction(const std::vector<Surfel>& surfels, const Pose& T_map_world);

}  // namespace stillmap
