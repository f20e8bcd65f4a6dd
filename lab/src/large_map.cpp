// SPDX-License-Identifier: Apache-2.0
/// Memory of a dense map that is larger than the memory for it: views along a long corridor are
/// added, fused, saved and loaded. Printed for each step: its largest resident memory, that of the
/// process before the first view included, its time, and the views' memory in the map.
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/dense/map_mesh.hpp"
#include "stillmap/pipeline/saved_views.hpp"

#include <cmath>
#include <fstream>
#include <string>

#include "commands.hpp"
#include <fmt/format.h>

namespace stillmap::lab {
namespace {

struct LargeMapArguments {
  std::string out;
  std::uint64_t views = 3000;
  std::uint64_t megabytes = 150;
  double voxel = 0.05;  // [m]; the voxels of so long a corridor would be most of the memory
};

constexpr double kBetween = 0.5;  // distance of the views [m]

/// Returns a number of /proc/self/status [MiB].
double status_mib(const std::string& name) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(name + ":")) return std::stod(line.substr(name.size() + 1)) / 1024;
  }
  return 0;
}

/// Prints the figures of the step that has ended, and begins the next one.
class Steps {
 public:
  Steps() {
    fmt::print(
        "| step | resident memory, most [MiB] | time [s] | views in memory [MB] | views on disk |\n"
        "|---|---|---|---|---|\n");
    begin();
  }
  void end(const std::string& name, std::size_t bytes_in_memory, std::size_t on_disk) {
    fmt::print("| {} | {:.0f} | {:.1f} | {:.1f} | {} |\n", name, status_mib("VmHWM"),
               watch_.lap() / 1000, static_cast<double>(bytes_in_memory) / 1e6, on_disk);
    std::fflush(stdout);
    begin();
  }

 private:
  void begin() {
    std::ofstream("/proc/self/clear_refs") << 5;  // the largest memory so far is forgotten
    watch_.lap();
  }
  Stopwatch watch_;
};

Camera camera() {
  Camera camera;
  camera.width = 320, camera.height = 240;
  camera.fx = camera.fy = 262.5, camera.cx = 159.5, camera.cy = 119.5;
  camera.depth_sensor = find_depth_sensor("kinect_v1");
  return camera;
}

/// Returns the pose of a view: in a corridor along x, looking at one of its walls.
Pose pose_of(std::uint64_t id) {
  return Pose(Eigen::Quaterniond::Identity(), {kBetween * static_cast<double>(id), 0, 0});
}

/// Returns a view of a wall with a relief and a texture, which differ from view to view.
DenseView view_of(const Camera& camera, std::uint64_t id) {
  DenseView view{.camera = camera};
  view.depth.create(camera.height, camera.width);
  view.color.create(camera.height, camera.width);
  view.kind = cv::Mat1b(camera.height, camera.width, std::uint8_t{kStaticSurface});
  cv::RNG noise(id + 1);
  for (int row = 0; row < camera.height; ++row) {
    for (int col = 0; col < camera.width; ++col) {
      const double x = pose_of(id).translation().x() + 2 * (col - camera.cx) / camera.fx;
      const double z = 2 + 0.1 * std::sin(3 * x) + noise.gaussian(0.003);
      view.depth(row, col) = static_cast<std::uint16_t>(z / DenseView::kDepthUnit);
      const int light = noise.uniform(100, 130);
      view.color(row, col) = cv::Vec3b::all(static_cast<std::uint8_t>(light));
    }
  }
  return view;
}

std::size_t bytes_in_memory(const SavedMap& saved) {
  std::size_t sum = 0;
  for (const AnchoredView& view : saved.views) sum += view.view.bytes_in_memory();
  return sum;
}

std::size_t on_disk(const SavedMap& saved) {
  return static_cast<std::size_t>(
      std::count_if(saved.views.begin(), saved.views.end(),
                    [](const AnchoredView& view) { return view.view.pages != nullptr; }));
}

/// Returns a map with a single keyframe, to which all views are attached.
SavedMap saved_map_of(const DenseMap& dense) {
  SavedMap saved;
  saved.writer = "lab";
  Map map(camera(), PyramidShape{});
  Keyframe keyframe;
  keyframe.features = std::make_shared<Features>();
  const KeyframeId anchor = map.add_keyframe(std::move(keyframe)).id;
  saved.map = map.content();
  for (const auto& [id, view] : dense.views()) saved.views.push_back({anchor, pose_of(id), *view});
  return saved;
}

void measure(const LargeMapArguments& arguments) {
  DenseOptions options;
  options.voxel = arguments.voxel;
  options.memory = {arguments.megabytes * 1000000, arguments.out};
  const std::filesystem::path file = std::filesystem::path(arguments.out) / "large.map";
  Steps steps;
  DenseMap dense(camera(), options);
  for (std::uint64_t id = 0; id < arguments.views; ++id)
    dense.add(id, view_of(camera(), id), pose_of(id));
  const DenseStatistics made = dense.statistics();
  steps.end(fmt::format("add {} views of {:.2f} MB", made.keyframes,
                        6e-6 * static_cast<double>(made.pixels / made.keyframes)),
            made.bytes_in_memory, made.views_on_disk);
  const Cloud cloud = cloud_of(dense.place(pose_of)).cloud;
  steps.end(fmt::format("fuse into {} points", cloud.size()), made.bytes_in_memory,
            made.views_on_disk);
  write_saved_map(file, saved_map_of(dense));
  steps.end(fmt::format("save {:.0f} MB", 1e-6 * static_cast<double>(file_size(file))),
            made.bytes_in_memory, made.views_on_disk);
  dense = DenseMap(camera(), options);
  const SavedMap saved = read_saved_map(file, options.memory);
  steps.end("load", bytes_in_memory(saved), on_disk(saved));
  const Cloud again = cloud_of(place_views(saved, options)).cloud;
  steps.end(fmt::format("fuse again: {} cloud", again == cloud ? "the same" : "ANOTHER"),
            bytes_in_memory(saved), on_disk(saved));
}

}  // namespace

void add_large_map_command(CLI::App& app) {
  auto arguments = std::make_shared<LargeMapArguments>();
  CLI::App* command = app.add_subcommand(
      "large-map", "memory of a dense map that is larger than the memory for it, step by step");
  command->add_option("--out", arguments->out, "folder for the map and the temporary file")
      ->required();
  command->add_option("--views", arguments->views, "number of views")->capture_default_str();
  command->add_option("--memory", arguments->megabytes, "memory for the views [MB]")
      ->capture_default_str();
  command->add_option("--voxel", arguments->voxel, "side of the voxels [m]")->capture_default_str();
  command->callback([arguments] { measure(*arguments); });
}

}  // namespace stillmap::lab
