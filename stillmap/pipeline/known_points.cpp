// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/known_points.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/number.hpp"
#include "stillmap/base/unicode.hpp"
#include "stillmap/map/tag_landmarks.hpp"
#include "stillmap/pipeline/saved_views.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace stillmap {
namespace {

constexpr double kFarthest = 1e4;  // coordinate that is accepted [m]
constexpr double kFarFromMap = 5;  // distance from the nearest landmark [m]

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

/// Returns whether a name is that of a tag: of a known family, with a number.
bool is_tag_name(const std::string& name) {
  const std::size_t colon = name.find(':');
  return colon != std::string::npos && number_of(name.substr(colon + 1)) &&
         std::ranges::count(tag_family_names(), name.substr(0, colon)) > 0;
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
                "use a pixel with depth, away from edges and moving things, or another keyframe");
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
        fmt::format("({:g}, {:g}, {:g}) is not in the map: its nearest landmark is {:.1f} m away",
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

std::vector<KnownPoint> read_known_points(const std::filesystem::path& file, const SavedMap& saved,
                                          const std::optional<SitePlan>& plan,
                                          std::vector<std::string>* unseen_tags) {
  const TagCenters tags = tag_centers(saved.map, main_component(saved));
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
    if (unseen_tags != nullptr && is_tag_name(words.front()) && !tags.contains(words.front())) {
      unseen_tags->push_back(words.front());
      continue;
    }
    points.push_back(point_of(words, saved, plan, where));
    if (std::ranges::count(points, points.back().name, &KnownPoint::name) > 1)
      throw Error("names '" + points.back().name + "' again", where, "name each point once");
  }
  return points;
}

}  // namespace stillmap
