// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/site_frame.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/number.hpp"
#include "stillmap/base/unicode.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/map/tag_landmarks.hpp"
#include "stillmap/pipeline/saved_views.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <sstream>

#include <Eigen/SVD>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace stillmap {
namespace {

constexpr double kFarthest = 1e4;       // coordinate that is accepted [m]
constexpr double kSmallestWidth = 0.1;  // RMS distance of the points from a line [m]
constexpr double kMostScale = 1.05;     // ratio of the distances at the site and in the map
constexpr double kFarFromMap = 5;       // distance from the nearest landmark [m]

/// Returns the words of a line between separators.
std::vector<std::string> words_of(std::string line) {
  std::replace_if(
      line.begin(), line.end(),
      [](char c) { return c == ',' || c == ';' || c == '\t' || c == '\r'; }, ' ');
  std::istringstream stream(line);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

double finite_number(const std::string& word, const std::string& where) {
  const auto number = number_of(word);
  if (number && std::isfinite(*number)) return *number;
  throw Error("'" + word + "' is no number", where, "write numbers with a decimal point");
}

double coordinate(const std::string& word, const std::string& where) {
  const double number = finite_number(word, where);
  if (std::abs(number) > kFarthest)
    throw Error("has a coordinate beyond 10 km, where point clouds lose their millimeters", where,
                "subtract the same offset from all coordinates at the site");
  return number;
}

using Words = std::span<const std::string>;

std::uint32_t component_of(const MapContent& map, const Landmark& landmark) {
  return map.keyframes[landmark.observations.front().keyframe.slot].component;
}

Eigen::Vector3d coordinates(Words words, const std::string& where) {
  return {coordinate(words[0], where), coordinate(words[1], where), coordinate(words[2], where)};
}

std::string names_of(const TagCenters& tags) {
  if (tags.empty()) return "it has none: run with --set features.tags=FAMILY";
  std::vector<std::string> names;
  for (const auto& [name, center] : tags) names.push_back(name);
  return fmt::format("it has {}", fmt::join(names, ", "));
}

/// Returns the point at the site of the last words of a line.
Eigen::Vector3d site_point(Words words, const std::optional<SitePlan>& plan,
                           const std::string& where) {
  if (!plan) return coordinates(words, where);
  const double column = coordinate(words[0], where), row = coordinate(words[1], where);
  if (column < 0 || column > plan->cols || row < 0 || row > plan->rows)
    throw Error(fmt::format("pixel ({:g}, {:g}) is outside the plan of {} x {} pixels", column, row,
                            plan->cols, plan->rows),
                where, "give the column and the row of the point in the image of the plan");
  return plan->at_site(column, row);
}

Eigen::Vector3d tag_center(const std::string& name, const TagCenters& tags,
                           const std::string& where) {
  const auto tag = tags.find(name);
  if (tag == tags.end()) throw Error("the map has no tag '" + name + "'", where, names_of(tags));
  return tag->second;
}

/// Returns the only keyframe of a time in the main component.
const Keyframe& keyframe_at(double time, const SavedMap& saved, const std::string& where) {
  constexpr double kSameTime = 0.001;  // [s]
  const Keyframe* nearest = nullptr;
  int found = 0;
  const auto distance = [&](const Keyframe& k) { return std::abs(k.timestamp - time); };
  const std::uint32_t component = main_component(saved);
  for (const Keyframe& keyframe : saved.map.keyframes) {
    if (keyframe.component != component) continue;
    found += distance(keyframe) < kSameTime ? 1 : 0;
    if (nearest == nullptr || distance(keyframe) < distance(*nearest)) nearest = &keyframe;
  }
  if (found == 1) return *nearest;
  const std::string problem =
      fmt::format("the map has {} keyframes of the time {:.6f}", found, time);
  if (found > 1) throw Error(problem, where, "give the point by its coordinates in the map");
  throw Error(problem, where,
              nearest == nullptr
                  ? "the map is empty"
                  : fmt::format("the nearest is that of {:.6f}; keyframes.txt has all",
                                nearest->timestamp));
}

/// Returns the median depth of the static surfaces of a view about a pixel of its image [m]; 0 if
/// there is none.
double depth_at(const DenseView& view, const Eigen::Vector2d& pixel) {
  constexpr int kRadius = 2;  // [pixels of the image]
  const int row = static_cast<int>(std::lround(pixel.y() / view.stride));
  const int col = static_cast<int>(std::lround(pixel.x() / view.stride));
  const int radius = std::max(1, kRadius / view.stride);
  std::vector<std::uint16_t> depths;
  for (int r = std::max(0, row - radius); r <= std::min(row + radius, view.depth.rows - 1); ++r) {
    for (int c = std::max(0, col - radius); c <= std::min(col + radius, view.depth.cols - 1); ++c) {
      if (view.is_static(r, c)) depths.push_back(view.depth(r, c));
    }
  }
  if (depths.empty()) return 0;
  const auto median = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), median, depths.end());
  return *median * DenseView::kDepthUnit;
}

/// Returns the point of the map at a pixel of the keyframe of a time.
Eigen::Vector3d point_at_pixel(double time, const Eigen::Vector2d& pixel, const SavedMap& saved,
                               const std::string& where) {
  const Keyframe& keyframe = keyframe_at(time, saved, where);
  const auto view = std::ranges::find(saved.views, keyframe.id, &AnchoredView::anchor);
  if (view == saved.views.end())
    throw Error(fmt::format("the keyframe of {:.6f} has no depth image in the map", time), where,
                "use another keyframe");
  const double depth = depth_at(view->view, pixel);
  if (depth == 0)
    throw Error(fmt::format("pixel ({:g}, {:g}) shows no surface", pixel.x(), pixel.y()), where,
                "use a pixel with depth, away from edges and moving things");
  const Camera& camera = view->view.camera;
  return keyframe.T_world_camera * view->T_anchor_camera *
         camera.unproject(pixel.x() / view->view.stride, pixel.y() / view->view.stride, depth);
}

/// Returns the point of the map that a line names by a pixel "name@TIME,u,v".
Eigen::Vector3d point_in_image(Words words, const SavedMap& saved, const std::string& where) {
  const double time = finite_number(words[0].substr(words[0].rfind('@') + 1), where);
  return point_at_pixel(time, {coordinate(words[1], where), coordinate(words[2], where)}, saved,
                        where);
}

/// Throws Error for a point of which the map shows nothing.
void require_in_map(const Eigen::Vector3d& p_map, const SavedMap& saved, const std::string& where) {
  const std::uint32_t component = main_component(saved);
  double nearest = std::numeric_limits<double>::infinity();
  for (const Landmark& l : saved.map.landmarks) {
    if (component_of(saved.map, l) == component)
      nearest = std::min(nearest, (l.p_world - p_map).norm());
  }
  if (nearest > kFarFromMap)
    throw Error(
        fmt::format("({:g}, {:g}, {:g}) is not in the map: its nearest landmark is {:.1f} m "
                    "away",
                    p_map.x(), p_map.y(), p_map.z(), nearest),
        where, "write the coordinates of the point in the map, then those at the site");
}

/// Returns the point of the map of the first words of a line.
Eigen::Vector3d map_point(Words words, const SavedMap& saved, const std::string& where) {
  if (words.size() == 1)
    return tag_center(words[0], tag_centers(saved.map, main_component(saved)), where);
  if (words.size() == 3) return point_in_image(words, saved, where);
  const Eigen::Vector3d p_map = coordinates(words.subspan(1), where);
  require_in_map(p_map, saved, where);
  return p_map;
}

KnownPoint point_of(Words words, const SavedMap& saved, const std::optional<SitePlan>& plan,
                    const std::string& where) {
  const std::size_t at_site = plan ? 2 : 3;
  const std::size_t in_map = words.size() - std::min(words.size(), at_site);
  const bool pixel = in_map == 3 && words[0].find('@') != std::string::npos;
  if (in_map != 4 && in_map != 1 && !pixel) {
    const char* site = plan ? "U,V" : "X,Y,Z";
    throw Error(
        fmt::format("has {} values", words.size()), where,
        fmt::format("write lines 'name,x,y,z,{0}': the coordinates in the map [m], and {1}; "
                    "'tag36h11:7,{0}' for the center of a tag; or 'name@TIME,u,v,{0}' for a pixel "
                    "of a keyframe",
                    site, plan ? "the pixel of the plan" : "those at the site [m]"));
  }
  const Eigen::Vector3d p_site = site_point(words.last(at_site), plan, where);
  return {words[0], map_point(words.first(in_map), saved, where), p_site};
}

/// The points in both frames, as columns.
struct Columns {
  Eigen::Matrix3Xd map, site;
};

/// Returns the points without one of them; with all for an index beyond the last.
Columns columns_of(const std::vector<KnownPoint>& points, std::size_t left_out) {
  const auto count = static_cast<Eigen::Index>(points.size() - (left_out < points.size() ? 1 : 0));
  Columns columns{Eigen::Matrix3Xd(3, count), Eigen::Matrix3Xd(3, count)};
  Eigen::Index column = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i == left_out) continue;
    columns.map.col(column) = points[i].p_map;
    columns.site.col(column++) = points[i].p_site;
  }
  return columns;
}

Eigen::Matrix3Xd centered(const Eigen::Matrix3Xd& points) {
  return points.colwise() - points.rowwise().mean();
}

/// Returns the RMS distance of points from the line that fits them best.
double width_of(const Eigen::Matrix3Xd& points) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(centered(points));
  return svd.singularValues().tail<2>().norm() / std::sqrt(static_cast<double>(points.cols()));
}

double scale_of(const Columns& columns) {
  return centered(columns.site).norm() / centered(columns.map).norm();
}

/// Returns the distances of points from their places at the site.
std::vector<double> errors_of(const Columns& columns, const Pose& T_site_map) {
  std::vector<double> errors;
  for (Eigen::Index i = 0; i < columns.map.cols(); ++i)
    errors.push_back((columns.site.col(i) - T_site_map * columns.map.col(i)).norm());
  return errors;
}

/// Returns the error from which points contradict each other.
double largest_error(const Columns& columns) {
  constexpr double kMeters = 0.1, kShare = 0.05;
  const double extent = centered(columns.site).norm() / std::sqrt(columns.site.cols());
  return std::max(kMeters, kShare * extent);
}

/// Returns the point without which the others fit each other; none if there is no such point.
const KnownPoint* outlier_of(const std::vector<KnownPoint>& points) {
  constexpr std::size_t kFewest = 4;
  if (points.size() < kFewest) return nullptr;
  const KnownPoint* outlier = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Columns others = columns_of(points, i);
    if (std::min(width_of(others.map), width_of(others.site)) < kSmallestWidth) continue;
    const double error = std::ranges::max(errors_of(others, align_points(others.site, others.map)));
    if (error >= least) continue;
    least = error;
    outlier = error <= largest_error(others) ? &points[i] : nullptr;
  }
  return outlier;
}

void require_alignable(const std::vector<KnownPoint>& points) {
  constexpr const char* kWhere = "known points";
  const Columns all = columns_of(points, points.size());
  if (all.map.cols() < 3)
    throw Error(fmt::format("there are {} points, too few for an alignment", all.map.cols()),
                kWhere, "give three or more points that are not on a line");
  if (std::min(width_of(all.map), width_of(all.site)) < kSmallestWidth)
    throw Error("lie on a line, so that the rotation about it is unknown", kWhere,
                "add a point at least a meter beside it");
  const double scale = scale_of(all);
  if (scale <= kMostScale && scale >= 1 / kMostScale) return;
  if (const KnownPoint* outlier = outlier_of(points))
    throw Error(
        fmt::format("{} does not fit the other points, which fit each other", outlier->name),
        kWhere, "check its coordinates in the map and at the site");
  throw Error(
      fmt::format("the distances between the points at the site are {:.3g} times those in the map",
                  scale),
      kWhere, "give both in meters, and check which point is which");
}

}  // namespace

TagCenters tag_centers(const MapContent& map, std::uint32_t component) {
  std::vector<const Landmark*> landmarks;
  for (const Landmark& l : map.landmarks) {
    if (component_of(map, l) == component) landmarks.push_back(&l);
  }
  TagCenters centers;
  for (const auto& [name, corners] : tags_among(landmarks)) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Landmark* corner : corners) sum += corner->p_world;
    centers[fmt::format("{}:{}", tag_family_names().at(name.family), name.id)] = sum / 4;
  }
  return centers;
}

bool is_at_site(const MapContent& map, std::uint32_t component) {
  // A merge may replace the first keyframe by one that shows the same.
  constexpr double kSamePlace = 0.3, kSameDirection = 0.2;  // [m], [rad]
  const auto first = map.first.find(component);
  if (first == map.first.end()) return false;
  const Pose& T_world_first = map.keyframes[first->second.slot].T_world_camera;
  return T_world_first.translation().norm() > kSamePlace || T_world_first.angle() > kSameDirection;
}

std::vector<KnownPoint> read_known_points(const std::filesystem::path& file, const SavedMap& saved,
                                          const std::optional<SitePlan>& plan) {
  std::istringstream lines(as_utf8(read_file(file)));
  std::vector<KnownPoint> points;
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const auto words = words_of(line);
    if (words.empty() || words.front().starts_with('#')) continue;
    const std::string where = fmt::format("{}:{}", file.string(), number);
    if (points.empty() && std::ranges::none_of(words, [](const std::string& word) {
          return number_of(word).has_value();
        }))
      throw Error("is a heading", where, "remove it, or begin it with #");
    points.push_back(point_of(words, saved, plan, where));
    if (std::ranges::count(points, points.back().name, &KnownPoint::name) > 1)
      throw Error("names '" + points.back().name + "' again", where, "name each point once");
  }
  return points;
}

SiteAlignment align_to_site(const std::vector<KnownPoint>& points) {
  require_alignable(points);
  const Columns all = columns_of(points, points.size());
  SiteAlignment alignment{align_points(all.site, all.map), {}, {}};
  alignment.errors = errors_of(all, alignment.T_site_map);
  if (points.size() < 4) return alignment;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Columns others = columns_of(points, i);
    const Pose T_site_map = align_points(others.site, others.map);
    alignment.errors_of_others.push_back((points[i].p_site - T_site_map * points[i].p_map).norm());
  }
  return alignment;
}

SiteAlignment align_to_plan(std::vector<KnownPoint> points, const Pose& T_level_map) {
  for (KnownPoint& point : points) {
    point.p_map = T_level_map * point.p_map;
    point.p_map.z() = 0;
  }
  SiteAlignment alignment = align_to_site(points);
  if (alignment.T_site_map.rotation()(2, 2) < 0)
    throw Error("are mirrored on the plan", "known points",
                "check which point is which, and that columns count to the right and rows down");
  alignment.T_site_map = alignment.T_site_map * T_level_map;
  return alignment;
}

std::string contradiction(const std::vector<KnownPoint>& points, const SiteAlignment& alignment) {
  const std::vector<double>& errors =
      alignment.errors_of_others.empty() ? alignment.errors : alignment.errors_of_others;
  const double worst = std::ranges::max(errors);
  if (worst <= largest_error(columns_of(points, points.size()))) return {};
  if (const KnownPoint* outlier = outlier_of(points))
    return fmt::format("{} is {:.0f} mm from where the other points have it: check its coordinates",
                       outlier->name,
                       1000 * errors[static_cast<std::size_t>(outlier - points.data())]);
  return fmt::format(
      "the points contradict each other by up to {:.0f} mm: check which point is which, and that "
      "X, "
      "Y, Z are right-handed",
      1000 * worst);
}

std::string reason_against_up(const MapContent& map, std::uint32_t component) {
  constexpr double kTurnedOver = -0.5;
  double up = 0, count = 0;
  for (const Keyframe& k : map.keyframes) {
    if (k.component != component) continue;
    up -= (k.T_world_camera.quaternion() * Eigen::Vector3d::UnitY()).z();
    ++count;
  }
  if (count == 0 || up > kTurnedOver * count) return {};
  return "the cameras are upside down at the site: Z must point up, and X, Y, Z be right-handed";
}

void move_world(MapContent& map, std::uint32_t component, const Pose& T) {
  for (Landmark& l : map.landmarks) {
    if (component_of(map, l) != component) continue;
    l.p_world = T * l.p_world;
    l.normal = T.quaternion() * l.normal;
  }
  for (Keyframe& k : map.keyframes) {
    if (k.component == component) k.T_world_camera = T * k.T_world_camera;
  }
}

}  // namespace stillmap
