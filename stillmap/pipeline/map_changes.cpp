// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/map_changes.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/dense/dense_map.hpp"
#include "stillmap/dense/projected_points.hpp"
#include "stillmap/geometry/depth_visibility.hpp"
#include "stillmap/geometry/voxel_key.hpp"
#include "stillmap/pipeline/saved_views.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

constexpr double kVoxel = 0.02;      // side of the voxels of the compared surfaces [m]
constexpr double kNeighbors = 0.05;  // side of voxels; objects have gaps of two at most [m]
/// Number of views that see through a surface which the other map does not contain, and their least
/// ratio to views that show it: its edges, at errors of poses and depths.
constexpr int kLeastThrough = 2, kThroughPerShown = 4;
/// Least distance of a measured depth behind a surface that it sees through [share of the depth]:
/// depth cameras are wrong by up to a tenth, differently at different distances.
constexpr float kDepthError = 0.08F;
/// Least size of an object: number of points, and the largest and the second largest side of its
/// box [m]. Smaller ones are errors of the depth at edges.
constexpr std::size_t kLeastPoints = 40;
constexpr double kLeastLength = 0.12, kLeastWidth = 0.08;
/// Largest differences of the extents [m, and relative] and of the mean color [0..255] of an object
/// that moved: other sides of it were seen.
constexpr double kExtentMeters = 0.08, kExtentRelative = 0.35, kColor = 40;
/// The same for a part of it, if their root sum of squares is at most 1: the rest is hidden, or its
/// old and its new place overlap. In five pairs of visits of offices, sofas and shelves that moved
/// have at most 0.98, other pairs 1.01 or more.
constexpr double kPartRelative = 0.45, kAlikeColor = 27;

/// The views of one visit, placed in the common world, and their surface.
struct Visited {
  std::vector<PosedView> views;
  Cloud cloud;
};

/// Views of the other visit for and against a point.
struct Votes {
  int through = 0, shown = 0;
  int near = 0;  // views that see a surface closely behind it, which may be the same
  bool absent() const { return through >= kLeastThrough && through > kThroughPerShown * shown; }
  bool compared() const { return through + shown + near > 0; }
};

/// A group of neighboring points, which may be an object.
struct Cluster {
  ChangedSurface surface;
  Eigen::Vector3d extents;  // along the principal axes, in ascending order [m]
  Eigen::Vector3d color;    // mean R G B
};

/// Returns the images of the views of a map.
std::set<std::uint64_t> images_of(const SavedMap& map) {
  std::set<std::uint64_t> images;
  for (const AnchoredView& view : map.views) images.insert(image_hash(view.view));
  return images;
}

/// Fuses the views of a visit, given by their positions in the merged map.
Visited visited(const SavedMap& merged, const ViewPoses& poses, DenseOptions options) {
  options.voxel = kVoxel;
  DenseMap dense(merged.map.camera, options);
  for (const auto& [id, pose] : poses) dense.add(id, merged.views[id].view);
  const PlacedMap placed = dense.place(pose_lookup(poses));
  Visited visit;
  for (const auto& [id, pose] : poses) visit.views.push_back({&merged.views[id].view, pose});
  for (std::size_t i = 0; i < placed.cells.size(); ++i)
    visit.cloud.add(placed.points[i], placed.grid->color(placed.cells[i]));
  return visit;
}

/// Returns the measured depth at a point [m]; 0 if unknown.
float depth_at(const DenseView& view, const ProjectedPoint& p) {
  return view.depth(p.row + (p.down > 0.5F), p.col + (p.right > 0.5F)) * DenseView::kDepthUnit;
}

/// Returns the votes of the views of the other visit on each point.
std::vector<Votes> votes_on(const std::vector<Eigen::Vector3f>& points,
                            const std::vector<PosedView>& views) {
  std::vector<Votes> votes(points.size());
  const PointGroups groups(points);
  for (const PosedView& posed : views) {
    const PlacedView placed(*posed.view, posed.T_world_camera);
    groups.for_each_in(
        ViewProjection(posed), all_threads(), [&](std::size_t i, const ProjectedPoint& projected) {
          Votes& of_point = votes[groups.place(i)];
          const Eigen::Vector3f p_camera = placed.in_camera(groups.point(i));
          if (placed.shows(p_camera)) {
            ++of_point.shown;
          } else if (placed.at(p_camera) == VoxelVote::kSeenThrough) {
            const bool is_far = (1 - kDepthError) * depth_at(*posed.view, projected) > projected.z;
            ++(is_far ? of_point.through : of_point.near);
          }
        });
    posed.view->drop_pages();
  }
  return votes;
}

double compared_share(const std::vector<Votes>& votes) {
  const auto compared = std::ranges::count_if(votes, &Votes::compared);
  return votes.empty() ? 0 : static_cast<double>(compared) / static_cast<double>(votes.size());
}

/// Returns the lists of neighboring absent points. Voxels count in which most points are absent.
std::vector<std::vector<std::size_t>> groups_of_absent(const std::vector<Eigen::Vector3f>& points,
                                                       const std::vector<Votes>& votes) {
  struct Place {
    std::vector<std::size_t> absent;
    std::size_t points = 0;
  };
  std::map<Voxel, Place> places;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto voxel = voxel_at(points[i].cast<double>(), kNeighbors);
    if (!voxel) continue;
    Place& place = places[*voxel];
    ++place.points;
    if (votes[i].absent()) place.absent.push_back(i);
  }
  std::erase_if(places, [](const auto& p) { return 2 * p.second.absent.size() < p.second.points; });
  std::vector<std::vector<std::size_t>> groups;
  while (!places.empty()) {
    std::vector<std::size_t> group;
    std::vector<Voxel> open{places.begin()->first};
    while (!open.empty()) {
      const Voxel voxel = open.back();
      open.pop_back();
      const auto place = places.find(voxel);
      if (place == places.end()) continue;
      group.insert(group.end(), place->second.absent.begin(), place->second.absent.end());
      places.erase(place);
      for (int n = 0; n < 125; ++n)
        open.push_back(voxel_of(lattice_of(voxel) + Lattice(n / 25 - 2, n / 5 % 5 - 2, n % 5 - 2)));
    }
    groups.push_back(std::move(group));
  }
  return groups;
}

/// Returns the extents of points along their principal axes without the outermost 5 %, ascending.
Eigen::Vector3d extents_of(const std::vector<Eigen::Vector3f>& points) {
  Eigen::Matrix3Xd at(3, std::ssize(points));
  for (std::size_t i = 0; i < points.size(); ++i)
    at.col(static_cast<Eigen::Index>(i)) = points[i].cast<double>();
  const Eigen::Matrix3Xd centered = at.colwise() - at.rowwise().mean();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(centered * centered.transpose());
  const Eigen::Matrix3Xd along = axes.eigenvectors().transpose() * centered;
  Eigen::Vector3d extents;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values(along.row(axis).begin(), along.row(axis).end());
    std::ranges::sort(values);
    const std::size_t skipped = values.size() / 20;
    extents[axis] = values[values.size() - 1 - skipped] - values[skipped];
  }
  std::ranges::sort(extents);
  return extents;
}

/// Returns the most frequent class that the network detected at the points; empty without one.
std::string class_at(const std::vector<Eigen::Vector3f>& points,
                     const std::vector<PosedView>& views) {
  std::map<std::string, int> counts;
  for (const PosedView& posed : views) {
    if (posed.view->instances.empty()) continue;
    const ViewProjection projection(posed);
    const PlacedView placed(*posed.view, posed.T_world_camera);
    for (const Eigen::Vector3f& point : points) {
      const auto projected = projection(point);
      if (!projected || !placed.shows(placed.in_camera(point))) continue;
      const int instance = posed.view->instance_at(projected->row, projected->col);
      ++counts[instance < 0 ? "" : posed.view->instances[instance].class_name];
    }
    posed.view->drop_pages();
  }
  const auto most = std::ranges::max_element(counts, {}, [](const auto& c) { return c.second; });
  return most == counts.end() ? "" : most->first;
}

/// Returns whether two views of its own visit or more show most of an object. What one view shows
/// may be the edge of somebody who moved.
bool is_confirmed(const ChangedSurface& object, const std::vector<PosedView>& views) {
  const std::vector<Votes> votes = votes_on(object.points, views);
  return 2 * std::ranges::count_if(votes, [](const Votes& v) { return v.shown >= 2; }) >
         std::ssize(votes);
}

/// Returns the objects of a visit that the other one does not contain.
std::vector<Cluster> absent_objects(const Visited& visit, const std::vector<Votes>& votes) {
  std::vector<Cluster> objects;
  const Cloud& cloud = visit.cloud;
  for (const auto& group : groups_of_absent(cloud.points, votes)) {
    if (group.size() < kLeastPoints) continue;
    Cluster object;
    object.color.setZero();
    for (const std::size_t i : group) {
      object.surface.points.push_back(cloud.points[i]);
      object.surface.box.extend(cloud.points[i].cast<double>());
      for (int channel = 0; channel < 3; ++channel)
        object.color[channel] += cloud.colors[i][static_cast<std::size_t>(channel)];
    }
    object.color /= static_cast<double>(group.size());
    Eigen::Vector3d sides = object.surface.box.sizes();
    std::ranges::sort(sides);
    if (sides[2] < kLeastLength || sides[1] < kLeastWidth) continue;
    if (!is_confirmed(object.surface, visit.views)) continue;
    object.extents = extents_of(object.surface.points);
    object.surface.class_name = class_at(object.surface.points, visit.views);
    objects.push_back(std::move(object));
  }
  return objects;
}

/// Returns the largest difference of the extents, relative to that which is allowed.
double extent_difference(const Cluster& a, const Cluster& b, double relative) {
  double largest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double allowed =
        std::max(kExtentMeters, relative * std::max(a.extents[axis], b.extents[axis]));
    largest = std::max(largest, std::abs(a.extents[axis] - b.extents[axis]) / allowed);
  }
  return largest;
}

/// Returns how different two surfaces are: at most 1 for the same object, at most 2 if only a part
/// of it was seen, or infinity.
double difference(const Cluster& a, const Cluster& b) {
  constexpr double kOther = std::numeric_limits<double>::infinity();
  const std::string &of_a = a.surface.class_name, &of_b = b.surface.class_name;
  if (!of_a.empty() && !of_b.empty() && of_a != of_b) return kOther;
  const double color = (a.color - b.color).cwiseAbs().maxCoeff();
  const double whole = std::max(color / kColor, extent_difference(a, b, kExtentRelative));
  if (whole <= 1) return whole;
  const double part = std::hypot(color / kAlikeColor, extent_difference(a, b, kPartRelative));
  return part <= 1 ? 1 + part : kOther;
}

/// Joins what went and what appeared to changes, the most similar pairs first.
std::vector<MapChange> joined(std::vector<Cluster> gone, std::vector<Cluster> appeared) {
  using Pair = std::tuple<double, std::size_t, std::size_t>;  // difference, gone, appeared
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < gone.size(); ++i) {
    for (std::size_t k = 0; k < appeared.size(); ++k) {
      const double d = difference(gone[i], appeared[k]);
      if (std::isfinite(d)) pairs.emplace_back(d, i, k);
    }
  }
  std::ranges::sort(pairs);
  std::vector<MapChange> changes;
  std::vector<bool> moved_from(gone.size()), moved_to(appeared.size());
  for (const auto& [d, i, k] : pairs) {
    if (moved_from[i] || moved_to[k]) continue;
    moved_from[i] = moved_to[k] = true;
    changes.push_back({std::move(gone[i].surface), std::move(appeared[k].surface)});
  }
  for (std::size_t i = 0; i < gone.size(); ++i)
    if (!moved_from[i]) changes.push_back({std::move(gone[i].surface), std::nullopt});
  for (std::size_t k = 0; k < appeared.size(); ++k)
    if (!moved_to[k]) changes.push_back({std::nullopt, std::move(appeared[k].surface)});
  return changes;
}

std::size_t points_of(const MapChange& change) {
  return (change.before ? change.before->points.size() : 0) +
         (change.after ? change.after->points.size() : 0);
}

ComparedMap described(const NamedMap& map) {
  const auto [first, last] =
      std::ranges::minmax_element(map.saved.map.keyframes, {}, &Keyframe::timestamp);
  return {.name = map.name,
          .begin = first->timestamp,
          .end = last->timestamp,
          .cloud = {},
          .cameras = {}};
}

void complete(const std::vector<Votes>& votes, Visited visit, ComparedMap& map) {
  map.compared = compared_share(votes);
  for (const PosedView& view : visit.views)
    map.cameras.push_back({static_cast<double>(map.cameras.size()), view.T_world_camera});
  map.cloud = std::move(visit.cloud);
}

nlohmann::json vector_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

nlohmann::json surface_json(const ChangedSurface& surface) {
  return {{"center", vector_json(surface.box.center())},
          {"min", vector_json(surface.box.min())},
          {"max", vector_json(surface.box.max())},
          {"points", surface.points.size()}};
}

nlohmann::json map_json(const ComparedMap& map) {
  return {{"name", map.name}, {"begin", map.begin}, {"end", map.end}, {"compared", map.compared}};
}

std::string surface_text(const ChangedSurface& surface) {
  const Eigen::Vector3d at = surface.box.center(), size = surface.box.sizes();
  return fmt::format("at ({:.2f}, {:.2f}, {:.2f}), {:.2f} x {:.2f} x {:.2f} m", at.x(), at.y(),
                     at.z(), size.x(), size.y(), size.z());
}

/// What two visits show, and the objects of either that the other one does not contain.
struct Comparison {
  Visited before, after;
  std::vector<Votes> on_before, on_after;  // on each point of the visit, by the other one
  std::vector<MapChange> changes;
};

/// Compares views of a map, given by their positions in its list.
Comparison compared(const SavedMap& saved, const ViewPoses& before, const ViewPoses& after,
                    const DenseOptions& options) {
  Comparison both{visited(saved, before, options), visited(saved, after, options), {}, {}, {}};
  both.on_before = votes_on(both.before.cloud.points, both.after.views);
  both.on_after = votes_on(both.after.cloud.points, both.before.views);
  both.changes = joined(absent_objects(both.before, both.on_before),
                        absent_objects(both.after, both.on_after));
  std::ranges::stable_sort(both.changes, std::greater(), points_of);
  return both;
}

/// Leaves in the later map the views of those visits that the earlier one does not contain.
/// @param of_before  the images of the earlier map
void erase_common_visits(const NamedMap& before, const std::set<std::uint64_t>& of_before,
                         NamedMap& after) {
  const auto is_common = [&](const AnchoredView& view) {
    return of_before.contains(image_hash(view.view));
  };
  std::vector<AnchoredView>& views = after.saved.views;
  if (std::ranges::none_of(views, is_common)) return;
  std::erase_if(views, [first = end_of_visits(before.saved.views)](const AnchoredView& view) {
    return view.view.visit < first;
  });
  if (views.empty()) {
    throw Error("has no visit that " + before.name + " does not have", after.name,
                "name maps of different visits, the earlier one first");
  }
  if (std::ranges::any_of(views, is_common)) {
    throw Error("was made of a recording that " + before.name + " was made of, too", after.name,
                "compare maps of two visits");
  }
}

}  // namespace

MapChanges find_changes(NamedMap before, NamedMap after, const SlamParameters& options) {
  require_views(before.saved, before.name);
  require_views(after.saved, after.name);
  MapChanges found{{}, described(before), described(after), {}};
  const std::set<std::uint64_t> of_before = images_of(before.saved);
  erase_common_visits(before, of_before, after);
  std::vector<NamedMap> maps;
  maps.push_back(std::move(before));
  maps.push_back(std::move(after));
  const MergedMap merged = merge_maps(std::move(maps), options, "changes");
  if (!merged.pairs.front().connected) {
    throw Error("shows no place of " + merged.names[0] + ": " + merged.pairs.front().reason,
                merged.names[1], "name maps of the same place that share views of it, or tags");
  }
  found.world = merged.names.front();
  ViewPoses poses_before, poses_after;
  for (const auto& [id, pose] : view_poses(merged.saved)) {
    const bool is_before = of_before.contains(image_hash(merged.saved.views[id].view));
    (is_before ? poses_before : poses_after)[id] = pose;
  }
  Comparison both = compared(merged.saved, poses_before, poses_after, options.dense);
  found.changes = std::move(both.changes);
  complete(both.on_before, std::move(both.before), found.before);
  complete(both.on_after, std::move(both.after), found.after);
  if (found.before.compared == 0) {
    throw Error("shows no surface that " + found.before.name + " shows, too", found.after.name,
                "name maps of the same place whose cameras saw common surfaces");
  }
  return found;
}

std::vector<MapChange> newest_changes(const SavedMap& saved, const DenseOptions& options) {
  const int visits = end_of_visits(saved.views);
  ViewPoses earlier, newest;
  for (const auto& [id, pose] : view_poses(saved))
    (saved.views[id].view.visit + 1 < visits ? earlier : newest)[id] = pose;
  if (earlier.empty() || newest.empty()) return {};
  return compared(saved, earlier, newest, options).changes;
}

const char* kind_of(const MapChange& change) {
  if (!change.before) return "appeared";
  return change.after ? "moved" : "went";
}

std::string class_of(const MapChange& change) {
  for (const auto& surface : {change.before, change.after})
    if (surface && !surface->class_name.empty()) return surface->class_name;
  return "unknown";
}

std::vector<ObjectChange> object_changes(const std::vector<MapChange>& changes) {
  std::vector<ObjectChange> objects;
  for (const MapChange& change : changes) {
    ObjectChange& object = objects.emplace_back(ObjectChange{class_of(change), {}, {}});
    if (change.before) object.before = change.before->box;
    if (change.after) object.after = change.after->box;
  }
  return objects;
}

std::string change_text(const MapChange& change) {
  std::string text = fmt::format("{:<9}{:<14}", kind_of(change), class_of(change));
  if (change.before) text += surface_text(*change.before);
  if (change.before && change.after) text += ", now ";
  if (change.after) text += surface_text(*change.after);
  return text;
}

nlohmann::json change_json(const MapChange& change) {
  nlohmann::json json{{"kind", kind_of(change)}, {"class", class_of(change)}};
  if (change.before) json["before"] = surface_json(*change.before);
  if (change.after) json["after"] = surface_json(*change.after);
  return json;
}

std::string changes_text(const MapChanges& changes) {
  std::string text;
  for (const MapChange& change : changes.changes) text += change_text(change) + "\n";
  return text +
         fmt::format(
             "{} changes; compared: {:.0f} % of the surface before, {:.0f} % of that after\n",
             changes.changes.size(), 100 * changes.before.compared, 100 * changes.after.compared);
}

nlohmann::json changes_json(const MapChanges& changes) {
  nlohmann::json list = nlohmann::json::array();
  for (const MapChange& change : changes.changes) list.push_back(change_json(change));
  return {{"changes", std::move(list)},
          {"world", changes.world},
          {"before", map_json(changes.before)},
          {"after", map_json(changes.after)}};
}

Cloud changes_cloud(const MapChanges& changes) {
  using Color = ChangeColors;
  Cloud cloud;
  for (const auto& [before, after] : changes.changes) {
    if (before)
      for (const auto& p : before->points) cloud.add(p, after ? Color::kFrom : Color::kWent);
    if (after)
      for (const auto& p : after->points) cloud.add(p, before ? Color::kTo : Color::kAppeared);
  }
  return cloud;
}

}  // namespace stillmap
