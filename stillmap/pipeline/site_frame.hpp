// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"
#include "stillmap/map/map.hpp"
#include "stillmap/pipeline/known_points.hpp"

#include <string>
#include <vector>

namespace stillmap {

/// Returns whether a component was moved into the frame of a site: otherwise its first camera is at
/// the origin of its world.
bool is_at_site(const MapContent& map, std::uint32_t component);

/// How a map lies at its site.
struct SiteAlignment {
  Pose T_site_map;
  std::vector<double> errors = {};  ///< Distance of each point from its place at the site [m].
  /// The same by an alignment without the point itself, NaN if the others lie on a line; empty for
  /// fewer than four points.
  std::vector<double> errors_of_others = {};
  /// Why it is probably wrong: a point is farther than 0.1 m, and than 5 % of the extent of the
  /// points, from its place (the geometric mean of both errors; of three points the first one);
  /// with the name of the point without which the others fit. Empty if it is not.
  std::string contradiction = {};
};

/// Aligns points by least squares: see align_points(). Throws Error for fewer than three points,
/// for points on a line, and if the distances between them differ by more than 5 % at the site;
/// with the name of the point that is the cause, if the others fit each other.
SiteAlignment align_to_site(const std::vector<KnownPoint>& points);

/// Aligns points with those of a floor plan in the horizontal plane; the floor comes to z = 0. As
/// align_to_site(), also throws Error for a mirrored plan.
/// @param T_level_map  motion of the map's floor to the plane z = 0
SiteAlignment align_to_plan(std::vector<KnownPoint> points, const Pose& T_level_map);

/// Returns why an aligned component is probably turned over: its cameras are upside down if Z
/// points up. Empty if they are not.
std::string reason_against_up(const MapContent& map, std::uint32_t component);

/// Moves a component: p becomes T * p.
void move_world(MapContent& map, std::uint32_t component, const Pose& T);

}  // namespace stillmap
