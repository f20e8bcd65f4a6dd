// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"
#include "stillmap/map/map.hpp"
#include "stillmap/pipeline/saved_map.hpp"

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// A point with known coordinates in the frame of a site, such as that of a total station.
struct KnownPoint {
  std::string name;
  Eigen::Vector3d p_map;   ///< [m]
  Eigen::Vector3d p_site;  ///< [m]
};

/// Positions of the centers of tags [m] by their names, family and number: "tag36h11:7".
using TagCenters = std::map<std::string, Eigen::Vector3d>;

/// Returns the tags in a component.
TagCenters tag_centers(const MapContent& map, std::uint32_t component);

/// Where the image of a floor plan lies at the site: its lower left corner at the origin, x to the
/// right and y up, the floor at z = 0.
struct SitePlan {
  double scale = 0;        ///< Side of a pixel [m].
  int rows = 0, cols = 0;  ///< Size of the image [pixels].

  Eigen::Vector3d at_site(double column, double row) const {
    return {column * scale, (rows - row) * scale, 0};
  }
  /// Returns the column and the row of a point at the site.
  Eigen::Vector2d in_image(const Eigen::Vector3d& p_site) const {
    return {p_site.x() / scale, rows - p_site.y() / scale};
  }
};

/// Reads points of the main component of a map: see main_component(). Lines are
/// "name,x,y,z,X,Y,Z": coordinates in the map and at the site [m]; or
/// "tag36h11:7,X,Y,Z" for the center of a tag in the map, or "name@TIME,u,v,X,Y,Z" for what the
/// keyframe of that time [s] shows at column u and row v of its undistorted image [pixels]: the
/// median depth of the surfaces of its view within two pixels. With a plan, its column and row
/// [pixels] are in place of X, Y, Z. They are separated by commas, semicolons, tabs or blanks;
/// lines that begin with # are comments. Throws Error for other lines, tags and keyframes, pixels
/// without depth, points more than 5 m from all landmarks or outside the plan, names that are there
/// twice, and for coordinates beyond 10 km, which the single precision of point clouds resolves to
/// 1 mm.
/// @param unseen_tags  gets the tags that the map does not contain, as one survey serves many maps;
///                     null: they are an error
std::vector<KnownPoint> read_known_points(const std::filesystem::path& file, const SavedMap& saved,
                                          const std::optional<SitePlan>& plan = {},
                                          std::vector<std::string>* unseen_tags = nullptr);

}  // namespace stillmap
