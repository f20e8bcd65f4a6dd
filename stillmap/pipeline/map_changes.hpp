// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/cloud.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/pipeline/merge_maps.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/slam.hpp"

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// The surface of an object in one of two maps, which the other one does not contain although it
/// shows the place.
struct ChangedSurface {
  std::vector<Eigen::Vector3f> points;  ///< One per voxel of the map [m].
  Eigen::AlignedBox3d box;              ///< Along the axes of the world [m].
  std::string class_name;  ///< Most frequent class by the network; empty: none was detected.
};

/// An object that appeared, went away, or moved between two visits of a place.
struct MapChange {
  std::optional<ChangedSurface> before;  ///< None: it appeared.
  std::optional<ChangedSurface> after;   ///< None: it went away. Both: it moved.
};

/// A map that was compared with another one.
struct ComparedMap {
  std::string name;
  double begin = 0, end = 0;  ///< Times of its keyframes [s].
  /// Part of its surface that the views of the other map show, or see through [0..1]; the rest was
  /// not seen, and is no change.
  double compared = 0;
  Cloud cloud;         ///< Its surface [m].
  Trajectory cameras;  ///< Poses of its views, numbered in place of timestamps.
};

/// Changes from one map to another.
struct MapChanges {
  std::vector<MapChange> changes;  ///< By the number of their points, the largest first.
  ComparedMap before, after;
  std::string world;  ///< Name of the map whose world frame is that of the changes: the older one.
};

/// Finds what changed between two visits, of seconds or months: the maps are merged (merge_maps()),
/// and a surface of one counts as absent from the other if at least two views of the other see
/// through it, by more than the errors of depth cameras (8 % of the depth), and hardly any view
/// shows it, while two views of its own map do. Neighboring points of absent surfaces are an
/// object; one that went and one that appeared with about the same extent and color are one that
/// moved. Objects smaller than about 15 cm, and people, who are in no map, are not found. If
/// `after` extends `before`, only the visits that `before` does not have are compared with it.
///
/// Throws Error if the maps have no dense views, show no common place, or are of the same
/// recordings, and as merge_maps().
MapChanges find_changes(NamedMap before, NamedMap after, const SlamParameters& options);

/// Finds in the same way what changed from the earlier visits of a map to the newest one: during a
/// run that extends a loaded map, of which SlamSystem::saved_map() has both. (At its end, what went
/// is removed from the views of the earlier visits.) None if the map has one visit, or the newest
/// one shows no place of the others.
std::vector<MapChange> newest_changes(const SavedMap& saved, const DenseOptions& options);

/// Returns "appeared", "went" or "moved".
const char* kind_of(const MapChange& change);
/// Returns the class of the object; "unknown" if none was detected.
std::string class_of(const MapChange& change);
/// Returns the changes without their points.
std::vector<ObjectChange> object_changes(const std::vector<MapChange>& changes);
/// Returns a change as a line of text, without a line end.
std::string change_text(const MapChange& change);
/// Returns a change as JSON, without its points.
nlohmann::json change_json(const MapChange& change);

/// Returns the changes as text, one line each.
std::string changes_text(const MapChanges& changes);
/// Returns the changes as JSON, without their points.
nlohmann::json changes_json(const MapChanges& changes);
/// Colors of what went, of what appeared, and of what moved, at its former and its present place.
struct ChangeColors {
  static constexpr Rgb kWent{214, 39, 40}, kAppeared{44, 160, 44};
  static constexpr Rgb kFrom{148, 103, 189}, kTo{31, 119, 180};
};
/// Returns the points of all changes, in these colors.
Cloud changes_cloud(const MapChanges& changes);

}  // namespace stillmap
