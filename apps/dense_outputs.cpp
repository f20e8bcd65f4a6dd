// SPDX-License-Identifier: Apache-2.0
#include "dense_outputs.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/dense/cloud_io.hpp"
#include "stillmap/dense/floor.hpp"
#include "stillmap/dense/floor_plan.hpp"
#include "stillmap/dense/map_mesh.hpp"
#include "stillmap/dense/map_server_files.hpp"
#include "stillmap/dense/mesh.hpp"
#include "stillmap/dense/octomap.hpp"
#include "stillmap/dense/semantic_files.hpp"
#include "stillmap/evaluate/cloud_picture.hpp"
#include "stillmap/pipeline/obstacle_files.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {
namespace fs = std::filesystem;

const std::vector<std::string> kMeshFormats = {"ply", "obj", "glb"};

cv::Mat picture_of(const Cloud& cloud, const Trajectory& trajectory, const CloudView& view) {
  return draw_cloud({cloud.points, cloud.colors, {}}, trajectory, view);
}

/// All that was seen, and what is left of it, side by side.
cv::Mat before_and_after(const PlacedMap& placed, const Trajectory& trajectory,
                         const CloudView& view, const cv::Mat& after) {
  cv::Mat both, half;
  cv::hconcat(picture_of(raw_cloud(placed), trajectory, view), after, both);
  cv::resize(both, half, {}, 0.5, 0.5, cv::INTER_AREA);
  return half;
}

/// Writes the things in the cloud; their picture, with the legend in a corner.
ReportImage write_semantics(const fs::path& out, const ComposedCloud& cloud,
                            const Trajectory& trajectory, const CloudView& view,
                            ResultFiles& files) {
  const SemanticMap& things = cloud.semantics;
  const Cloud classes = colored_by_class(cloud.cloud, things);
  const cv::Mat legend = legend_picture(class_colors(things));
  files.write(out / "semantic.ply",
              [&](const fs::path& file) { write_file(file, semantic_ply(cloud.cloud, things)); });
  files.write(out / "semantic_classes.ply",
              [&](const fs::path& file) { write_ply(file, classes); });
  files.write(out / "semantic_legend.png", [&](const fs::path& file) { write_png(file, legend); });
  files.write(out / "objects.json",
              [&](const fs::path& file) { write_file(file, objects_json(things).dump(2) + "\n"); });
  cv::Mat picture = picture_of(classes, trajectory, view);
  const cv::Rect corner(0, 0, std::min(legend.cols, picture.cols),
                        std::min(legend.rows, picture.rows));
  legend(corner).copyTo(picture(corner));
  files.write(out / "semantic.png", [&](const fs::path& file) { write_png(file, picture); });
  return {picture, fmt::format("{} static things of {} classes", things.objects.size(),
                               class_colors(things).size())};
}

ReportImage write_meshes(const fs::path& out, const PlacedMap& placed, const Trajectory& trajectory,
                         const CloudView& view, const MeshOptions& options,
                         const DenseOutputs& outputs, ResultFiles& files) {
  const TriangleMesh mesh = make_mesh(placed, options);
  for (const std::string& format : outputs.mesh) {
    files.write(out / ("mesh." + format), [&](const fs::path& file) { write_mesh(file, mesh); });
  }
  const cv::Mat picture = picture_of(sampled(mesh, 0.25 * options.voxel), trajectory, view);
  files.write(out / "mesh.png", [&](const fs::path& file) { write_png(file, picture); });
  return {picture, fmt::format("mesh of {} triangles, voxels of {} m", mesh.triangles.size(),
                               options.voxel)};
}

Eigen::Vector3d upwards(const Trajectory& trajectory) {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const auto& [stamp, T] : trajectory) up -= T.rotation().col(1);
  return up.norm() > 0 ? up : Eigen::Vector3d(0, -1, 0);
}

void write_planner(const fs::path& out, const ComposedCloud& cloud, const PlacedMap& placed,
                   const DenseContext& context, const OccupancyOptions& options,
                   ResultFiles& files) {
  if (placed.views.empty()) return;
  const auto floor = find_floor(cloud.cloud.points, upwards(context.trajectory));
  if (!floor) {
    fmt::print("no floor was seen, so there is no map for planners\n");
    return;
  }
  const Pose T_map_world = map_frame(*floor, placed.views.front().T_world_camera);
  const OccupiedSpace space = occupied_space(placed, T_map_world, options);
  const FloorPlan plan = floor_plan(space, options);
  files.write(out / "octomap.bt",
              [&](const fs::path& file) { write_file(file, octomap_bytes(space)); });
  files.write(out / "grid.pgm",
              [&](const fs::path& file) { write_file(file, grid_pgm(plan.grid)); });
  files.write(out / "grid.yaml", [&](const fs::path& file) {
    write_file(file, grid_yaml(plan.grid, "grid.pgm", T_map_world));
  });
  files.write(out / "obstacles.json", [&](const fs::path& file) {
    write_file(file, obstacles_json(plan, T_map_world).dump(2) + "\n");
  });
  files.write(out / "obstacles.jsonl", [&](const fs::path& file) {
    write_file(file,
               obstacles_by_second(plan, T_map_world, context.trajectory, context.movers_jsonl));
  });
}

}  // namespace

void write_png(const std::filesystem::path& file, const cv::Mat& picture) {
  std::vector<std::uint8_t> png;
  cv::imencode(".png", picture, png);
  write_file(file, std::string_view(reinterpret_cast<const char*>(png.data()), png.size()));
}

void add_dense_options(CLI::App& command, DenseOutputs& outputs) {
  command
      .add_option("--mesh", outputs.mesh,
                  "also make a colored triangle mesh: ply (default), obj, glb; several with commas")
      ->expected(0, -1)
      ->delimiter(',')
      ->default_str("ply");
  command.add_flag("--planner", outputs.planner,
                   "also make maps for planners: octomap.bt, grid.pgm and grid.yaml, obstacles");
}

std::string dense_files_help() {
  return "  where a network found things: semantic.ply (object, label and confidence per point), "
         "semantic_classes.ply, semantic_legend.png, objects.json\n"
         "  --mesh: mesh.ply, mesh.obj or mesh.glb, and mesh.png\n"
         "  --planner: octomap.bt; grid.pgm and grid.yaml, as map servers read them; "
         "obstacles.json, and obstacles.jsonl, with the movers, once a second";
}

void check(const DenseOutputs& outputs) {
  for (const std::string& format : outputs.mesh) {
    if (std::find(kMeshFormats.begin(), kMeshFormats.end(), format) != kMeshFormats.end()) continue;
    throw Error("a mesh cannot be written as '" + format + "'", "--mesh", "take ply, obj or glb");
  }
}

std::vector<ReportImage> write_dense(const fs::path& out, const ComposedCloud& cloud,
                                     const PlacedMap& placed, const DenseContext& context,
                                     const DenseOptions& options, const DenseOutputs& outputs,
                                     ResultFiles& files) {
  files.write(out / "cloud.ply", [&](const fs::path& file) { write_ply(file, cloud.cloud); });
  std::vector<ReportImage> pictures;
  if (cloud.cloud.empty()) return pictures;
  const Trajectory& trajectory = context.trajectory;
  const CloudSpan span{cloud.cloud.points, cloud.cloud.colors, {}};
  const CloudView view = choose_cloud_view(span, trajectory);
  pictures.push_back(
      {draw_cloud(span, trajectory, view),
       fmt::format("{} points, cameras drawn in; {} removed as others saw through them",
                   cloud.cloud.size(), cloud.voxels_removed)});
  files.write(out / "cloud.png",
              [&](const fs::path& file) { write_png(file, pictures.front().image); });
  pictures.push_back({before_and_after(placed, trajectory, view, pictures.front().image),
                      "all that was seen, and what is static of it"});
  files.write(out / "cloud_before_after.png",
              [&](const fs::path& file) { write_png(file, pictures.back().image); });
  if (!cloud.semantics.empty()) {
    pictures.push_back(write_semantics(out, cloud, trajectory, view, files));
  }
  if (!outputs.mesh.empty()) {
    pictures.push_back(write_meshes(out, placed, trajectory, view, options.mesh, outputs, files));
  }
  if (outputs.planner) write_planner(out, cloud, placed, context, options.occupancy, files);
  return pictures;
}

}  // namespace stillmap
