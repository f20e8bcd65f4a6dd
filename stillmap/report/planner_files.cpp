// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/planner_files.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/json_text.hpp"
#include "stillmap/dense/floor_plan.hpp"
#include "stillmap/dense/map_server_files.hpp"
#include "stillmap/dense/obstacles.hpp"
#include "stillmap/dense/octomap.hpp"
#include "stillmap/report/obstacle_files.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr const char *kMapFrame = "map", *kFirstCameraFrame = "first camera";

/// Differences between a given and an estimated floor from which one of them is wrong [degrees, m].
/// Estimated directions are seldom more than 2.5 degrees off.
constexpr double kContradictoryTilt = 2.5, kContradictoryHeight = 0.08;
/// The same, in standard deviations of the estimated direction.
constexpr double kContradictorySigmas = 3;
/// Share of the surfaces that lie more than 15 cm below a floor from which it is none.
constexpr double kMostBelow = 0.1, kBelow = 0.15;

nlohmann::json triple(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// @param problem  why the floor is unknown or wrong; empty without a problem
nlohmann::json floor_json(const FloorFinding& finding, const std::string& problem,
                          const Pose& T_map_world) {
  const FloorEvidence& e = finding.evidence;
  nlohmann::json json{{"frame", finding.floor ? kMapFrame : kFirstCameraFrame},
                      {"T_map_world", pose_json(T_map_world)},
                      {"floor", nullptr},
                      {"up", nullptr},
                      {"up_sigma_deg", nullptr},
                      {"confidence", finding.confidence},
                      {"evidence",
                       {{"area_m2", e.area},
                        {"width_m", e.width},
                        {"area_below_m2", e.area_below},
                        {"camera_height_m", e.camera_height}}},
                      {"problem", nullptr}};
  if (finding.up) {
    json["up"] = triple(*finding.up);
    json["up_sigma_deg"] = finding.up_sigma * 180 / std::numbers::pi;
  }
  if (finding.floor)
    json["floor"] = {{"up", triple(finding.floor->up)}, {"height", finding.floor->height}};
  if (!problem.empty()) json["problem"] = problem;
  return json;
}

/// Returns the obstacles between the heights of the options, as boxes along the walls.
std::vector<StaticObstacle> static_obstacles(const PlacedMap& placed,
                                             const std::vector<Surfel>& surfels,
                                             const Pose& T_map_world,
                                             const OccupancyOptions& options) {
  const double yaw = wall_direction(surfels, T_map_world);
  const Pose T_walls_map(so3_exp({0, 0, -yaw}), Eigen::Vector3d::Zero());
  return obstacles_in(occupied_space(placed, T_walls_map * T_map_world, options), yaw, options);
}

/// Returns the sentence for users about an unknown floor.
std::string unknown_floor_text(const std::string& reason) {
  return "the floor is unknown, so the files for planners are in the frame of the first camera, "
         "and there are no grid and no static obstacles: " +
         reason;
}

/// Returns a grid, enlarged for the report, with its caption.
CaptionedImage captioned(const OccupancyGrid& grid, const FloorFinding& finding) {
  constexpr int kWidth = 840;  // [pixels]
  cv::Mat image;
  const int scale = std::max(1, kWidth / std::max(1, grid.image.cols));
  cv::resize(grid.image, image, {}, scale, scale, cv::INTER_NEAREST);
  return {image, fmt::format(
                     "grid.pgm: {} x {} cells of {:g} m, black occupied, white free, gray unknown; "
                     "the floor is {:.2f} m below the first camera, its direction known to {:.1f} "
                     "degrees (standard deviation)",
                     grid.image.cols, grid.image.rows, grid.resolution,
                     finding.evidence.camera_height, finding.up_sigma * 180 / std::numbers::pi)};
}

/// Returns the share of the surfaces that lie below a floor [0..1].
double share_below(const Floor& floor, const std::vector<Surfel>& surfels) {
  if (surfels.empty()) return 0;
  const auto below = std::count_if(surfels.begin(), surfels.end(), [&](const Surfel& s) {
    return floor.up.dot(s.point) < floor.height - kBelow;
  });
  return static_cast<double>(below) / static_cast<double>(surfels.size());
}

/// Returns the sentence for users about a given floor or direction that is not the one that is
/// seen; empty without a contradiction.
std::string contradiction_text(const FloorFinding& given, const FloorFinding& seen,
                               const std::vector<Surfel>& surfels, const Eigen::Vector3d& eye) {
  if (!given.up) return "";
  const double degrees =
      seen.up ? std::acos(std::clamp(given.up->dot(*seen.up), -1.0, 1.0)) * 180 / std::numbers::pi
              : 0;
  const double below = given.floor ? share_below(*given.floor, surfels) : 0;
  const auto camera_height = [&](const Floor& floor) { return floor.up.dot(eye) - floor.height; };
  const double sigma = seen.up_sigma * 180 / std::numbers::pi;
  std::string reason;
  if (degrees > std::max(kContradictoryTilt, kContradictorySigmas * sigma)) {
    reason = fmt::format("its upward direction is {:.1f} degrees from that of the surfaces in view",
                         degrees);
  } else if (given.floor && seen.floor &&
             std::abs(camera_height(*given.floor) - camera_height(*seen.floor)) >
                 kContradictoryHeight) {
    reason = fmt::format(
        "it is {:.2f} m below the first camera of the map, and the one in view {:.2f} m",
        camera_height(*given.floor), camera_height(*seen.floor));
  } else if (below > kMostBelow) {
    reason = fmt::format("{:.0f} % of the surfaces in view lie more than {:.2f} m below it",
                         100 * below, kBelow);
  }
  if (reason.empty()) return "";
  return "the given floor contradicts the recording: " + reason +
         "; check --up (x right, y down, z forward), --camera-height (meters), or that --floor is "
         "of this map";
}

/// Returns why a floor is unknown or contradicts what is seen, with the fix; empty if neither.
std::string problem_of(const FloorFinding& finding, const FloorHints& hints,
                       const std::vector<Surfel>& surfels, const std::vector<Pose>& cameras) {
  std::string problem;
  if (hints.up || hints.camera_height || hints.floor)
    problem = contradiction_text(finding, find_floor(surfels, cameras), surfels,
                                 cameras.front().translation());
  if (problem.empty() && !finding.floor)
    problem = finding.reason + "; give --up X,Y,Z and --camera-height METERS, or --floor FILE";
  return problem;
}

}  // namespace

std::vector<std::string> planner_file_names() {
  return {"floor.json", "octomap.bt", "grid.pgm", "grid.yaml", "obstacles.json", "obstacles.jsonl"};
}

SearchedFloor search_floor(const PlacedMap& placed, const FloorHints& hints) {
  SearchedFloor floor;
  floor.surfels = surfels_of(placed, kFloorSurfel);
  for (const PosedView& view : placed.views) floor.cameras.push_back(view.T_world_camera);
  floor.finding = find_floor(floor.surfels, floor.cameras, hints);
  return floor;
}

PlannerFiles write_planner_files(const PlannerData& data, const OccupancyOptions& options,
                                 const FloorHints& hints, ResultFolder& folder) {
  const PlacedMap& placed = data.placed;
  if (placed.views.empty()) return {unknown_floor_text("there is no view"), {}};
  PlannerFiles files;
  const auto& [surfels, cameras, finding] = data.floor;
  const std::string problem = problem_of(finding, hints, surfels, cameras);
  const Pose T_map_world =
      finding.floor ? map_frame(*finding.floor, cameras.front()) : cameras.front().inverse();
  const OccupiedSpace space = occupied_space(placed, T_map_world, options);
  std::vector<StaticObstacle> obstacles;
  folder.remove_own(planner_file_names());  // a call that is cut off leaves no files of two floors
  folder.write_text("floor.json", json_text(floor_json(finding, problem, T_map_world), 2) + "\n");
  folder.write_text("octomap.bt", octomap_bytes(space));
  if (finding.floor) {
    const OccupancyGrid grid = floor_plan(space, options);
    folder.write_text("grid.pgm", grid_pgm(grid));
    folder.write_text("grid.yaml", grid_yaml(grid, "grid.pgm", T_map_world));
    files.grid = captioned(grid, finding);
    obstacles = static_obstacles(placed, surfels, T_map_world, options);
  }
  const PlannerFrame frame{finding.floor ? kMapFrame : kFirstCameraFrame, T_map_world};
  folder.write_text("obstacles.json", json_text(obstacles_json(obstacles, frame), 2) + "\n");
  folder.write_text("obstacles.jsonl",
                    obstacles_by_frame(obstacles, frame, data.trajectory, data.movers));
  files.problem = finding.floor ? problem : unknown_floor_text(problem);
  return files;
}

Floor read_floor(const std::filesystem::path& file) {
  const char* fix = "give floor.json of a run with --planner that found the floor";
  const auto json = nlohmann::json::parse(read_file(file), nullptr, false);
  try {
    const auto& floor = json.at("floor");
    const auto up = floor.at("up").get<std::vector<double>>();
    if (up.size() != 3) throw Error("'up' must have 3 numbers", file.string(), fix);
    Floor read{{up[0], up[1], up[2]}, floor.at("height").get<double>()};
    const double excess = std::abs(read.up.norm() - 1);
    if (!std::isfinite(read.height) || excess > 1e-3)
      throw Error("'up' is no unit vector, or 'height' is not finite", file.string(), fix);
    // The direction in floor.json stays bit-identical, so that the same files are written again.
    if (excess > 1e-12) read.up.normalize();
    return read;
  } catch (const nlohmann::json::exception&) {
    throw Error(R"(contains no floor: {"floor": {"up": [x, y, z], "height": m}})", file.string(),
                fix);
  }
}

}  // namespace stillmap
