// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/json_text.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/dense/cloud.hpp"
#include "stillmap/pipeline/map_description.hpp"
#include "stillmap/report/result_folder.hpp"

#include <array>
#include <filesystem>

#include "commands.hpp"
#include "output_file.hpp"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

struct MapArguments {
  std::string file, json, out;
  bool force = false;
};

/// Returns the exit code for a map, and tells damage of its file.
int code_for(const SavedMap& map) {
  if (map.damage.empty()) return kSuccess;
  return print_findings(std::array{make_finding("damaged-map", map.damage)});
}

int show(const MapArguments& arguments) {
  require_replaceable(arguments.json, is_figures_file, arguments.force);
  const SavedMap map = read_saved_map(arguments.file);
  const MapDescription description = describe_map(map);
  const auto bytes = fs::file_size(map_file_of(arguments.file));
  print_to(arguments.json == kStandardOutput ? stderr : stdout, "{}: {:.2f} MB\n{}", arguments.file,
           static_cast<double>(bytes) / 1e6, description_text(description));
  const int code = code_for(map);
  if (arguments.json.empty()) return code;
  nlohmann::json json = description_json(description);
  json["file"] = arguments.file;
  json["bytes"] = bytes;
  json["stillmap"] = STILLMAP_VERSION;
  write_named(arguments.json, json_text(json, 2) + "\n", is_figures_file, arguments.force);
  return code;
}

int slim(const MapArguments& arguments) {
  const fs::path out = arguments.out.empty()
                           ? fs::path(arguments.file).replace_extension("slim.map")
                           : fs::path(arguments.out);
  require_replaceable(out, is_saved_map, arguments.force);
  if (!arguments.force && fs::exists(out) && fs::equivalent(out, arguments.file)) {
    throw Error("is the map itself, which would lose the views of its dense map", out.string(),
                "name another file with --out, or add --force");
  }
  SavedMap saved = read_saved_map(arguments.file);
  saved.views.clear();
  if (out.has_parent_path()) make_output_folder(out.parent_path());
  write_saved_map(out, saved);
  print_out("written: {} ({:.2f} MB of {:.2f})\n", out.string(),
            static_cast<double>(fs::file_size(out)) / 1e6,
            static_cast<double>(fs::file_size(map_file_of(arguments.file))) / 1e6);
  return code_for(saved);
}

int export_map(const MapArguments& arguments) {
  const SavedMap saved = read_saved_map(arguments.file);
  ResultFolder folder(
      arguments.out.empty() ? fs::path(arguments.file).stem().string() + "_export" : arguments.out,
      arguments.force ? ResultFolder::Foreign::kOverwrite : ResultFolder::Foreign::kKeep);
  folder.write("landmarks.ply",
               [&](const fs::path& file) { write_ply(file, landmark_cloud(saved.map)); });
  folder.write_text("graph.json", json_text(map_graph(saved), 1) + "\n");
  const auto sessions = keyframe_trajectories(saved.map);
  for (const auto& [number, keyframes] : sessions) {
    const bool only = sessions.size() == 1;
    folder.write(only ? "keyframes.txt" : fmt::format("keyframes_session_{}.txt", number),
                 [&](const fs::path& file) { write_trajectory(file, keyframes); });
  }
  if (!saved.views.empty())
    folder.write("cloud.ply", [&](const fs::path& file) { write_ply(file, dense_cloud(saved)); });
  print_out("{}", folder.written_text());
  folder.require_all();
  return code_for(saved);
}

}  // namespace

void add_map_command(CLI::App& app, int& exit_code) {
  CLI::App* map =
      app.add_subcommand("map", "describe, export or reduce a map saved by `run --save-map`");
  map->require_subcommand(1);
  auto arguments = std::make_shared<MapArguments>();
  CLI::App* info = map->add_subcommand("info", "versions, camera, counts, extent and size");
  info->add_option("file", arguments->file, "saved map, or folder of a run")->required();
  info->add_option("--json", arguments->json,
                   "also write this description to a JSON file (- for standard output)");
  add_force_option(*info, arguments->force);
  info->footer("Example:\n  stillmap map info office.map");
  info->callback([arguments, &exit_code] { exit_code = show(*arguments); });
  CLI::App* slimming =
      map->add_subcommand("slim", "write the map without the views of its dense map");
  slimming->add_option("file", arguments->file, "saved map, or folder of a run")->required();
  slimming->add_option("--out", arguments->out, "file to write; default: NAME.slim.map")
      ->type_name("FILE");
  add_force_option(*slimming, arguments->force);
  slimming->footer("Example:\n  stillmap map slim office.map --out small.map");
  slimming->callback([arguments, &exit_code] { exit_code = slim(*arguments); });
  CLI::App* exporting = map->add_subcommand(
      "export", "write landmarks.ply, keyframes.txt (TUM format), graph.json and cloud.ply");
  exporting->add_option("file", arguments->file, "saved map, or folder of a run")->required();
  exporting->add_option("--out", arguments->out, "output folder; default: NAME_export");
  add_force_option(*exporting, arguments->force);
  exporting->footer("Example:\n  stillmap map export office.map --out office");
  exporting->callback([arguments, &exit_code] { exit_code = export_map(*arguments); });
}

}  // namespace stillmap
