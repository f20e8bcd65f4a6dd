// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/pipeline/map_description.hpp"
#include "stillmap/pipeline/saved_views.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/report/mover_files.hpp"
#include "stillmap/report/obstacle_files.hpp"
#include "stillmap/report/planner_files.hpp"
#include "stillmap/report/run_folder.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <sstream>
#include <string_view>
#include <unistd.h>

#include "commands.hpp"
#include "progress.hpp"
#include "terminal.hpp"
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace stillmap {
namespace {
namespace fs = std::filesystem;

struct DenseArguments {
  std::string source, config, out;
  std::vector<std::string> settings;
  std::optional<double> voxel, mesh_voxel;
  std::optional<int> memory;
  DenseOutputs outputs;
  bool force = false;
};

/// The options that act on the views of a saved map. The other options of a run act while it makes
/// these views, or have nothing to do with the dense map.
constexpr std::array<std::string_view, 6> kOptionsInUse{
    "dense.voxel",          "dense.memory",           "outputs.mesh_voxel",
    "outputs.planner_cell", "outputs.planner_lowest", "outputs.planner_highest"};

/// Throws Error for an assignment of an option that has no effect here.
void require_in_use(const std::string& setting) {
  const std::string path = setting.substr(0, setting.find('='));
  if (std::find(kOptionsInUse.begin(), kOptionsInUse.end(), path) != kOptionsInUse.end()) return;
  throw Error("has no effect on the views of a saved map", "--set " + setting,
              fmt::format("stillmap dense uses {}; for all others run `stillmap run` again",
                          fmt::join(kOptionsInUse, ", ")));
}

/// Input files and the output folder. The folder of a run contains all inputs; for a saved map only
/// the map itself is known.
struct DensePaths {
  fs::path map, options, trajectory, movers, out;
};

DensePaths paths_of(const DenseArguments& arguments) {
  const fs::path source = arguments.source;
  DensePaths paths{source, arguments.config, {}, {}, arguments.out};
  if (!fs::is_directory(source)) {
    if (paths.out.empty()) paths.out = source.stem().string() + "_dense";
    return paths;
  }
  require_ended_run(source);
  paths.map = source / kRunMap;
  if (!fs::exists(paths.map)) {
    throw Error("contains no run.map: it is not the folder of a run with a dense map",
                source.string(), "name the folder that `stillmap run --out` wrote, or a saved map");
  }
  if (paths.options.empty()) paths.options = source / kRunOptions;
  paths.trajectory = source / "trajectory.txt";
  paths.movers = source / "movers.csv";
  if (paths.out.empty()) paths.out = source;
  return paths;
}

/// Returns the parameters from the options of the run, overridden by those of the command line.
DenseOptions options_of(const DenseArguments& arguments, const fs::path& file) {
  if (arguments.mesh_voxel && arguments.outputs.mesh.empty())
    throw Error("has no effect without a mesh", "--mesh-voxel", "add --mesh");
  Options options = read_options("", file);
  options.dense.voxel = arguments.voxel.value_or(options.dense.voxel);
  options.dense.memory = arguments.memory.value_or(options.dense.memory);
  options.outputs.mesh_voxel = arguments.mesh_voxel.value_or(options.outputs.mesh_voxel);
  for (const std::string& setting : arguments.settings) {
    set_option(setting, options);
    require_in_use(setting);
  }
  return dense_parameters_of(options);
}

/// Returns the trajectory of the run, or of the keyframes of the newest session in the map.
Trajectory trajectory_of(const DensePaths& paths, const SavedMap& saved) {
  if (fs::exists(paths.trajectory)) return read_trajectory(paths.trajectory);
  const auto sessions = keyframe_trajectories(saved.map, main_component(saved));
  return sessions.empty() ? Trajectory() : sessions.rbegin()->second;
}

/// Returns that the map has parts with world frames of their own; empty if it is one.
std::string unconnected_text(std::size_t parts) {
  if (parts < 2) return "";
  return fmt::format(
      "the map has {} parts that are not connected, each with a world frame of its own: the files "
      "are of the largest, and cameras and movers of the others are misplaced in them; record the "
      "places in one run, or return to the first",
      parts);
}

/// Returns the files that may be written, for a check before the map is composed.
std::vector<std::string> possible_files(const DenseOutputs& outputs) {
  std::vector<std::string> names = mesh_file_names(outputs.mesh);
  const auto add = [&](RunPart part) {
    for (std::string& name : file_names(part)) names.push_back(std::move(name));
  };
  add(RunPart::kDense);
  add(RunPart::kObjects);
  if (outputs.planner) add(RunPart::kPlanner);
  std::erase_if(names, [](const std::string& name) {  // only runs write these
    return name == kRunMap || name == kRunOptions || name == kLiveObstacles;
  });
  return names;
}

int run(const DenseArguments& arguments) {
  check(arguments.outputs);
  const DensePaths paths = paths_of(arguments);
  DenseOptions options = options_of(arguments, paths.options);
  options.memory.folder = paths.out;
  Stopwatch watch;
  const SavedMap saved = read_saved_map(paths.map, options.memory);
  require_views(saved, paths.map.string());
  ResultFolder folder(paths.out, arguments.force ? ResultFolder::Foreign::kOverwrite
                                                 : ResultFolder::Foreign::kKeep);
  folder.require_free(possible_files(arguments.outputs));
  const double reading = watch.lap();
  std::optional<ProgressStep> step("composing the map");
  const PlacedMap placed = place_views(saved, options);
  const ComposedCloud cloud = cloud_of(placed);
  step.reset();
  print_out(
      "{}, {}, {} removed, {}; read in {:.0f} ms, composed in "
      "{:.0f} ms\n",
      counted(cloud.keyframes, "view"), counted(cloud.cloud.size(), "point"),
      counted(cloud.voxels_removed, "voxel"),
      counted(cloud.semantics.objects.size(), "static object"), reading, watch.lap());

  const Trajectory trajectory = trajectory_of(paths, saved);
  const std::vector<MoverTrack> movers =
      fs::exists(paths.movers) ? read_mover_tracks(paths.movers) : std::vector<MoverTrack>();
  step.emplace("making the files");
  const DenseFiles files =
      write_dense_files({cloud, placed, trajectory, movers}, options, arguments.outputs, folder);
  step.reset();
  print_out("{}", folder.written_text());
  folder.require_all();
  print_out("{}",
            open_line(folder.path() / "cloud_before_after.png",
                      ", or turn the map in a browser: stillmap view " + folder.path().string()));
  std::vector<Finding> findings;
  const auto add = [&](FindingCode code, const std::string& text) {
    if (!text.empty()) findings.push_back(make_finding(code, text));
  };
  add("damaged-map", saved.damage);
  add("unconnected-maps", unconnected_text(saved.map.first.size()));
  add("floor-unknown", files.floor_problem);
  return print_findings(findings);
}

/// Returns the parts of a text between its commas.
std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, ',');) parts.push_back(part);
  return parts;
}

/// Returns the direction that a text X,Y,Z names. Throws Error.
Eigen::Vector3d direction_in(const std::string& text) {
  const std::vector<std::string> parts = split(text);
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  bool valid = parts.size() == 3;
  for (std::size_t i = 0; valid && i < parts.size(); ++i)
    valid = CLI::detail::lexical_cast(parts[i], direction[static_cast<Eigen::Index>(i)]);
  if (!valid || !(direction.norm() > 1e-6 && direction.norm() < 1e6)) {
    throw Error("'" + text + "' is no direction", "--up",
                "give three numbers with commas that are not all 0, such as --up 0,-1,0");
  }
  return direction;
}

/// Adds the options that replace the estimate of the floor.
void add_floor_options(CLI::App& command, CLI::Option* planner, FloorHints& floor) {
  command
      .add_option_function<std::string>(
          "--up", [&floor](const std::string& text) { floor.up = direction_in(text); },
          "upward direction in the frame of the first camera of the map (x right, y down, z "
          "forward); 0,-1,0 for a level camera")
      ->type_name("X,Y,Z")
      ->needs(planner);
  command
      .add_option_function<double>(
          "--camera-height",
          [&floor](double height) {
            constexpr double kHighest = 1000;  // m
            if (!(height > 0 && height <= kHighest)) {
              throw Error(fmt::format("{} is no height of a camera", height), "--camera-height",
                          fmt::format("give meters, up to {}", kHighest));
            }
            floor.camera_height = height;
          },
          "height of the first camera of the map above the floor [m]")
      ->type_name("METERS")
      ->needs(planner);
  command
      .add_option_function<std::string>(
          "--floor", [&floor](const std::string& file) { floor.floor = read_floor(file); },
          "floor.json of a run in the same map")
      ->type_name("FILE")
      ->needs(planner)
      ->excludes("--up")
      ->excludes("--camera-height");
}

}  // namespace

int print_findings(std::span<const Finding> findings) {
  for (const Finding& finding : findings_with(Severity::kNote, findings))
    print_error("stillmap: note: {} [{}]\n", finding.text(), finding.code);
  for (const Finding& finding : findings_with(Severity::kWarning, findings))
    print_error("stillmap: warning: {} [{}]\n", finding.text(), finding.code);
  const std::string title = styled("DO NOT TRUST THIS RESULT:", Style::kRed, STDERR_FILENO);
  for (const Finding& finding : findings_with(Severity::kUntrusted, findings))
    print_error("{} {} [{}]\n", title, finding.text(), finding.code);
  return worst(findings) < Severity::kUntrusted ? kSuccess : kDoubtful;
}

void add_dense_options(CLI::App& command, DenseOutputs& outputs) {
  command
      .add_option_function<std::string>(
          "--mesh", [&outputs](const std::string& formats) { outputs.mesh = split(formats); },
          "also write a mesh: glb or obj with a texture, ply with colors; several with commas")
      ->expected(0, 1)
      ->type_name("{ply,obj,glb}")
      ->default_str("ply");
  CLI::Option* planner = command.add_flag(
      "--planner", outputs.planner,
      "also write maps for planners: octomap.bt, grid.pgm and grid.yaml, obstacles");
  add_floor_options(command, planner, outputs.floor);
}

void add_quiet_option(CLI::App& command) {
  command.add_flag_callback("-q,--quiet", Progress::hide, "show no progress");
}

void add_force_option(CLI::App& command, bool& force) {
  command.add_flag("--force", force, "overwrite files that Stillmap did not write");
}

std::string files_help(const std::string& condition, RunPart part) {
  return fmt::format("  {}: {}\n", condition, fmt::join(file_names(part), ", "));
}

std::string dense_files_help() {
  return files_help("if a network found objects", RunPart::kObjects) +
         files_help("--mesh", RunPart::kMesh) + files_help("--planner", RunPart::kPlanner);
}

void add_dense_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<DenseArguments>();
  CLI::App* command = app.add_subcommand(
      "dense", "make the dense map of a run or of a saved map again, with other settings");
  command
      ->add_option("source", arguments->source,
                   "folder written by stillmap run, or file written by --save-map")
      ->required();
  command->add_option("--voxel", arguments->voxel, "voxel size of the cloud [m]; default: as run");
  command->add_option("--mesh-voxel", arguments->mesh_voxel,
                      "voxel size of the mesh [m]; default: as run");
  command
      ->add_option("--memory", arguments->memory,
                   "memory for the views [MB]; the others are kept in a temporary file in the "
                   "output folder; default: as run")
      ->type_name("MB");
  add_dense_options(*command, arguments->outputs);
  command->add_option("--config", arguments->config,
                      "YAML file with options, of which those of --set act; default: those of the "
                      "run, or the defaults for a saved map");
  command
      ->add_option("--set", arguments->settings,
                   fmt::format("override one of the options {}; may be repeated",
                               fmt::join(kOptionsInUse, ", ")))
      ->allow_extra_args(false);
  command->add_option("--out", arguments->out,
                      "output folder; default: that of the run, or NAME_dense for a saved map");
  add_force_option(*command, arguments->force);
  command->footer(
      "Examples:\n"
      "  stillmap dense out --mesh ply,glb\n"
      "  stillmap dense office.map --voxel 0.005 --planner --out fine\n"
      "Files: cloud.ply, cloud.png, cloud_before_after.png; with unchanged options the same as "
      "those of the run\n" +
      dense_files_help() + "docs/dense_map.md explains them.");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace stillmap
