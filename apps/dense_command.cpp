// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/pipeline/map_description.hpp"
#include "stillmap/pipeline/options.hpp"
#include "stillmap/pipeline/saved_views.hpp"

#include <memory>

#include "commands.hpp"
#include "dense_outputs.hpp"
#include "run_session.hpp"
#include <fmt/format.h>

namespace stillmap {
namespace {
namespace fs = std::filesystem;

struct DenseArguments {
  std::string source, config, out;
  std::vector<std::string> settings;
  double voxel = 0, mesh_voxel = 0;
  DenseOutputs outputs;
};

/// Where everything comes from and goes to: a run's folder holds all of it, a saved map stands for
/// itself.
struct DensePlaces {
  fs::path map, options, trajectory, movers, out;
};

DensePlaces places_of(const DenseArguments& arguments) {
  const fs::path source = arguments.source;
  DensePlaces places{source, arguments.config, {}, {}, arguments.out};
  if (!fs::is_directory(source)) {
    if (places.out.empty()) places.out = source.stem().string() + "_dense";
    return places;
  }
  places.map = source / kRunMap;
  if (!fs::exists(places.map)) {
    throw Error("holds no run.map: no run's folder, or one without a dense map", source.string(),
                "name the folder that `stillmap run --out` wrote, or a saved map");
  }
  if (places.options.empty()) places.options = source / kRunOptions;
  places.trajectory = source / "trajectory.txt";
  places.movers = source / "movers.jsonl";
  if (places.out.empty()) places.out = source;
  return places;
}

/// The run's own options, then what the command line says.
DenseOptions options_of(const DenseArguments& arguments, const fs::path& file) {
  SlamOptions options;
  if (!file.empty()) load_options(file, options);
  if (arguments.voxel > 0) options.dense.voxel = arguments.voxel;
  if (arguments.mesh_voxel > 0) {
    options.dense.mesh.voxel = arguments.mesh_voxel;
    options.dense.mesh.truncation = 4 * arguments.mesh_voxel;
  }
  for (const std::string& setting : arguments.settings) set_option(setting, options);
  return options.dense;
}

/// The camera's way: the run's, or that of the newest session's keyframes.
DenseContext context_of(const DensePlaces& places, const SavedMap& saved) {
  DenseContext context;
  if (fs::exists(places.trajectory)) {
    context.trajectory = read_trajectory(places.trajectory);
  } else if (const auto sessions = keyframe_trajectories(saved.map); !sessions.empty()) {
    context.trajectory = sessions.rbegin()->second;
  }
  if (fs::exists(places.movers)) context.movers_jsonl = read_file(places.movers);
  return context;
}

int run(const DenseArguments& arguments) {
  check(arguments.outputs);
  const DensePlaces places = places_of(arguments);
  const DenseOptions options = options_of(arguments, places.options);
  Stopwatch watch;
  const SavedMap saved = read_saved_map(places.map);
  if (saved.views.empty()) {
    throw Error("holds nothing of the dense map: it was saved with --slim-map", places.map.string(),
                "save it without");
  }
  make_output_folder(places.out);
  const double reading = watch.lap();
  const PlacedMap placed = place_views(saved, options);
  const ComposedCloud cloud = cloud_of(placed, options.semantics);
  fmt::print(
      "{} views, {} points, {} voxels removed, {} static things; read in {:.0f} ms, put "
      "together in {:.0f} ms\n",
      cloud.keyframes, cloud.cloud.size(), cloud.voxels_removed, cloud.semantics.objects.size(),
      reading, watch.lap());

  ResultFiles files;
  write_dense(places.out, cloud, placed, context_of(places, saved), options, arguments.outputs,
              files);
  fmt::print("written:\n");
  for (const fs::path& file : files.written()) fmt::print("  {}\n", file.string());
  files.require_all();
  return kSuccess;
}

}  // namespace

void add_dense_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<DenseArguments>();
  CLI::App* command = app.add_subcommand(
      "dense", "make the static map of a run or a saved map again, finer or as a mesh, untracked");
  command
      ->add_option("source", arguments->source,
                   "folder that stillmap run --out wrote, or file that --save-map wrote")
      ->required();
  command->add_option("--voxel", arguments->voxel,
                      "side of the cloud's voxels [m]; default: the run's");
  command->add_option("--mesh-voxel", arguments->mesh_voxel,
                      "side of the mesh's voxels [m]; default: the run's");
  add_dense_options(*command, arguments->outputs);
  command->add_option("--config", arguments->config,
                      "YAML file with options; default: the run's, for a saved map the usual ones");
  command->add_option("--set", arguments->settings,
                      "override one of the options, dense.option=value; may be repeated");
  command->add_option("--out", arguments->out,
                      "folder for the results; default: the run's, or NAME_dense for a saved map");
  command->footer(
      "Examples:\n"
      "  stillmap dense out --mesh ply,glb\n"
      "  stillmap dense office.map --voxel 0.005 --planner --out fine\n"
      "Written: cloud.ply, cloud.png; with the run's options the very ones it wrote. "
      "And\n" +
      dense_files_help());
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace stillmap
