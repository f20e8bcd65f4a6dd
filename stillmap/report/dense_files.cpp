// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/dense_files.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/json_text.hpp"
#include "stillmap/dense/cloud.hpp"
#include "stillmap/dense/map_mesh.hpp"
#include "stillmap/dense/mesh_files.hpp"
#include "stillmap/dense/semantic_files.hpp"
#include "stillmap/report/chart.hpp"
#include "stillmap/report/cloud_image.hpp"
#include "stillmap/report/planner_files.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {
namespace fs = std::filesystem;

constexpr std::array kMeshFormats{"ply", "obj", "glb"};
/// Files that mesh.obj refers to.
constexpr const char *kMaterial = "mesh.mtl", *kTexture = "mesh_texture.png";

cv::Mat image_of(const Cloud& cloud, const Trajectory& trajectory, const CloudView& view) {
  return draw_cloud({cloud.points, cloud.colors, {}}, trajectory, view);
}

void write_image(ResultFolder& folder, const std::string& name, const cv::Mat& image) {
  folder.write(name, [&](const fs::path& file) { write_png(file, image); });
}

/// Returns an image of the cloud of all measurements and the static cloud, side by side.
cv::Mat before_and_after(const DenseResults& results, const CloudView& view, const cv::Mat& after) {
  cv::Mat both, half;
  cv::hconcat(image_of(raw_cloud(results.placed), results.trajectory, view), after, both);
  cv::resize(both, half, {}, 0.5, 0.5, cv::INTER_AREA);
  return half;
}

/// Writes the objects in the cloud; returns their image, with the legend in a corner.
CaptionedImage write_semantics(const DenseResults& results, const CloudView& view,
                               const Eigen::Matrix3d& R_upright_world, ResultFolder& folder) {
  const Cloud& cloud = results.cloud.cloud;
  const SemanticMap& objects = results.cloud.semantics;
  const Cloud classes = colored_by_class(cloud, objects);
  const cv::Mat legend = legend_image(class_colors(objects));
  folder.write_text("semantic.ply", semantic_ply(cloud, objects));
  folder.write("semantic_classes.ply", [&](const fs::path& file) { write_ply(file, classes); });
  write_image(folder, "semantic_legend.png", legend);
  nlohmann::json list = objects_json(objects);
  add_upright_boxes(objects, cloud, R_upright_world, list);
  folder.write_text("objects.json", json_text(list, 2) + "\n");
  cv::Mat image = image_of(classes, results.trajectory, view);
  const cv::Rect corner(0, 0, std::min(legend.cols, image.cols), std::min(legend.rows, image.rows));
  legend(corner).copyTo(image(corner));
  write_image(folder, "semantic.png", image);
  return {image, fmt::format("{} of {}", counted(objects.objects.size(), "static object"),
                             counted(class_colors(objects).size(), "class"))};
}

CaptionedImage write_meshes(const DenseResults& results, const CloudView& view,
                            const MeshOptions& options, const std::vector<std::string>& formats,
                            const Eigen::Vector3d& up, ResultFolder& folder) {
  const TriangleMesh mesh = make_mesh(results.placed, options);
  const auto wanted = [&](const char* format) { return std::ranges::count(formats, format) > 0; };
  if (wanted("ply")) folder.write_text("mesh.ply", mesh_ply(mesh));
  if (wanted("obj") || wanted("glb")) {
    const TexturedMesh for_viewers = make_textured_mesh(mesh, results.placed, options);
    if (wanted("glb")) folder.write_text("mesh.glb", mesh_glb(for_viewers, up));
    if (wanted("obj")) {
      folder.write_text("mesh.obj", mesh_obj(for_viewers, kMaterial));
      folder.write_text(kMaterial, mesh_mtl(kTexture));
      write_image(folder, kTexture, for_viewers.image);
    }
  }
  const cv::Mat image = image_of(sampled(mesh, 0.25 * options.voxel), results.trajectory, view);
  write_image(folder, "mesh.png", image);
  return {image, fmt::format("mesh of {}, voxel size {} m",
                             counted(mesh.triangles.size(), "triangle"), options.voxel)};
}

}  // namespace

void check(const DenseOutputs& outputs) {
  for (const std::string& format : outputs.mesh) {
    if (std::find(kMeshFormats.begin(), kMeshFormats.end(), format) != kMeshFormats.end()) continue;
    throw Error("there is no mesh format '" + format + "'", "--mesh",
                "use ply, obj or glb; write --mesh=FORMAT in front of another argument");
  }
}

std::vector<std::string> mesh_file_names(const std::vector<std::string>& formats) {
  std::vector<std::string> names;
  for (const std::string& format : formats) {
    names.push_back("mesh." + format);
    if (format == "obj") names.insert(names.end(), {kMaterial, kTexture});
  }
  if (!names.empty()) names.emplace_back("mesh.png");
  return names;
}

DenseFiles write_dense_files(const DenseResults& results, const DenseOptions& options,
                             const DenseOutputs& outputs, ResultFolder& folder) {
  const Cloud& cloud = results.cloud.cloud;
  folder.write("cloud.ply", [&](const fs::path& file) { write_ply(file, cloud); });
  DenseFiles written;
  std::vector<CaptionedImage>& images = written.images;
  if (cloud.empty()) return written;
  const CloudView view = choose_cloud_view({cloud.points, cloud.colors, {}}, results.trajectory);
  images.push_back({image_of(cloud, results.trajectory, view),
                    fmt::format("{}, with camera poses; {} removed because other views saw through "
                                "them",
                                counted(cloud.size(), "point"),
                                counted(results.cloud.voxels_removed, "voxel"))});
  write_image(folder, "cloud.png", images.front().image);
  images.push_back({before_and_after(results, view, images.front().image),
                    "all measurements (left) and the static cloud (right)"});
  write_image(folder, "cloud_before_after.png", images.back().image);
  const bool has_objects = !results.cloud.semantics.empty(), has_mesh = !outputs.mesh.empty();
  if (!has_objects && !has_mesh && !outputs.planner) return written;
  const SearchedFloor floor = search_floor(results.placed, outputs.floor);
  const Eigen::Matrix3d R = upright_axes(floor.finding, floor.surfels, floor.cameras);
  if (has_objects) images.push_back(write_semantics(results, view, R, folder));
  if (has_mesh)
    images.push_back(
        write_meshes(results, view, options.mesh, outputs.mesh, R.row(2).transpose(), folder));
  if (outputs.planner) {
    PlannerFiles planner =
        write_planner_files({results.placed, floor, results.trajectory, results.movers},
                            options.occupancy, outputs.floor, folder);
    written.floor_problem = std::move(planner.problem);
    if (!planner.grid.image.empty()) images.push_back(std::move(planner.grid));
  }
  return written;
}

}  // namespace stillmap
