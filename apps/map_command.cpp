// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/json_text.hpp"
#include "stillmap/base/machine.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/dense/cloud.hpp"
#include "stillmap/pipeline/map_changes.hpp"
#include "stillmap/pipeline/map_description.hpp"
#include "stillmap/pipeline/merge_maps.hpp"
#include "stillmap/pipeline/saved_views.hpp"
#include "stillmap/pipeline/site_frame.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/report/changes_image.hpp"
#include "stillmap/report/planner_files.hpp"
#include "stillmap/report/run_folder.hpp"
#include "stillmap/report/scene_export.hpp"
#include "stillmap/report/site_plan.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <vector>

#include "command_tree.hpp"
#include "commands.hpp"
#include "output_file.hpp"
#include "progress.hpp"
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

struct MapArguments {
  std::string file, json, out, points, plan;
  std::optional<double> scale;     // of the plan: side of a pixel [m]
  std::vector<std::string> files;  // to be merged
  std::optional<int> memory;       // for their views and keyframes [MB]
  bool force = false;
  std::vector<std::string> formats;  // of other programs
};

const std::vector<std::string> kFormats{"colmap", "colmap-text", "nerfstudio", "las"};

void make_folder_of(const fs::path& file) {
  if (file.has_parent_path()) make_output_folder(file.parent_path());
}

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
  make_folder_of(out);
  write_saved_map(out, saved);
  print_out("written: {} ({:.2f} MB of {:.2f})\n", out.string(),
            static_cast<double>(fs::file_size(out)) / 1e6,
            static_cast<double>(fs::file_size(map_file_of(arguments.file))) / 1e6);
  return code_for(saved);
}

/// Returns a table of the points with their errors.
std::string alignment_text(const std::vector<KnownPoint>& points, const SiteAlignment& alignment) {
  std::string text =
      fmt::format("{:<20}{:>12}{:>26}\n", "point", "error [mm]", "error by the others [mm]");
  double squares = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool checked =
        i < alignment.errors_of_others.size() && !std::isnan(alignment.errors_of_others[i]);
    text +=
        fmt::format("{:<20}{:>12.1f}{:>26}\n", points[i].name, 1000 * alignment.errors[i],
                    checked ? fmt::format("{:.1f}", 1000 * alignment.errors_of_others[i]) : "-");
    squares += alignment.errors[i] * alignment.errors[i];
  }
  return text + fmt::format("RMS {:.1f} mm\n",
                            1000 * std::sqrt(squares / static_cast<double>(points.size())));
}

/// Reads the known points of a map, and tells which tags it does not contain.
std::vector<KnownPoint> known_points(const MapArguments& arguments, const SavedMap& saved,
                                     const std::optional<SitePlan>& plan = {}) {
  std::vector<std::string> unseen;
  std::vector<KnownPoint> points = read_known_points(arguments.points, saved, plan, &unseen);
  if (!unseen.empty()) print_out("not in the map: {}\n", fmt::join(unseen, ", "));
  return points;
}

/// Returns the views of a saved map, with the options of its run.
PlacedMap placed_map(const MapArguments& arguments, const SavedMap& saved) {
  require_views(saved, arguments.file);
  const fs::path options = fs::path(arguments.file) / kRunOptions;
  return place_views(
      saved, dense_parameters_of(read_options("", fs::exists(options) ? options : fs::path())));
}

/// Moves the main component of a map to its site, writes the map, and prints the errors of the
/// points. Returns the exit code.
int write_aligned(const MapArguments& arguments, const std::vector<KnownPoint>& points,
                  const SiteAlignment& alignment, SavedMap& saved) {
  const std::uint32_t component = main_component(saved);
  if (is_at_site(saved.map, component))
    print_out("the map is already in the frame of a site; the points are in that frame\n");
  move_world(saved.map, component, alignment.T_site_map);
  make_folder_of(arguments.out);
  write_saved_map(arguments.out, saved);
  print_out("written: {}\n{}", arguments.out, alignment_text(points, alignment));
  if (alignment.errors_of_others.empty())
    print_out("three points do not check each other: add a fourth\n");
  if (saved.map.first.size() > 1)
    print_out("component {} is aligned; the other {} stay in frames of their own\n", component,
              saved.map.first.size() - 1);
  std::string problem = alignment.contradiction;
  if (problem.empty()) problem = reason_against_up(saved.map, component);
  if (problem.empty()) return code_for(saved);
  print_error("DO NOT TRUST THIS RESULT: {}\n", problem);
  return kDoubtful;
}

/// Aligns the map with a floor plan, and writes the plan with the map drawn onto it.
int align_with_plan(const MapArguments& arguments) {
  const fs::path picture = fs::path(arguments.out).replace_extension("plan.png");
  if (!arguments.force && fs::exists(picture) && !fs::exists(arguments.out))
    throw Error("exists", picture.string(), "name another map with --out, or add --force");
  cv::Mat3b image = read_plan_image(arguments.plan);
  const SitePlan plan{*arguments.scale, image.rows, image.cols};
  SavedMap saved = read_saved_map(arguments.file);
  const std::vector<KnownPoint> points = known_points(arguments, saved, plan);
  SearchedFloor floor = search_floor(placed_map(arguments, saved), {});
  if (!floor.finding.floor)
    throw Error("the floor is unknown: " + floor.finding.reason, arguments.file,
                "give the coordinates of the points at the site in place of a plan");
  const SiteAlignment alignment =
      align_to_plan(points, map_frame(*floor.finding.floor, floor.cameras.front()));
  for (Surfel& surfel : floor.surfels) surfel.point = alignment.T_site_map * surfel.point;
  draw_on_plan(floor.surfels, plan, image);
  const int code = write_aligned(arguments, points, alignment, saved);
  write_png(picture, image);
  print_out("written: {}\n", picture.string());
  return code;
}

int align(const MapArguments& arguments) {
  require_replaceable(arguments.out, is_saved_map, arguments.force);
  if (!arguments.force) require_no_input(arguments.out, {arguments.file});
  if (!arguments.plan.empty()) return align_with_plan(arguments);
  SavedMap saved = read_saved_map(arguments.file);
  const std::vector<KnownPoint> points = known_points(arguments, saved);
  return write_aligned(arguments, points, align_to_site(points), saved);
}

int merge(const MapArguments& arguments) {
  make_folder_of(arguments.out);
  require_replaceable(arguments.out, is_saved_map, arguments.force);
  require_replaceable(arguments.json, is_figures_file, arguments.force);
  if (!arguments.force)
    require_no_input(arguments.out, {arguments.files.begin(), arguments.files.end()});
  Options options = read_options("");
  options.dense.memory = arguments.memory.value_or(options.dense.memory);
  SlamParameters parameters = parameters_of(options);
  parameters.dense.memory.folder = fs::path(arguments.out).parent_path();
  std::vector<NamedMap> maps;
  {
    const ProgressStep step("reading the maps");
    maps =
        read_named_maps({arguments.files.begin(), arguments.files.end()}, parameters.dense.memory);
  }
  MergedMap merged;
  {
    const ProgressStep step("merging the maps");
    merged = merge_maps(std::move(maps), parameters, "stillmap " STILLMAP_VERSION);
  }
  write_saved_map(arguments.out, merged.saved);
  print_to(arguments.json == kStandardOutput ? stderr : stdout, "{}{}written: {}\n",
           merge_text(merged), description_text(describe_map(merged.saved)), arguments.out);
  if (!arguments.json.empty()) {
    nlohmann::json json = merge_json(merged);
    json["peak_memory_mib"] = peak_memory_mib();
    write_named(arguments.json, json_text(json, 2) + "\n", is_figures_file, arguments.force);
  }
  return code_for(merged.saved);
}

int changes(const MapArguments& arguments) {
  const SlamParameters parameters = parameters_of(read_options(""));
  std::vector<NamedMap> maps =
      read_named_maps({arguments.files.begin(), arguments.files.end()}, parameters.dense.memory);
  ResultFolder folder(arguments.out, arguments.force ? ResultFolder::Foreign::kOverwrite
                                                     : ResultFolder::Foreign::kKeep);
  const MapChanges found = [&] {
    const ProgressStep step("comparing the maps");
    return find_changes(std::move(maps[0]), std::move(maps[1]), parameters);
  }();
  folder.write_text("changes.json", json_text(changes_json(found), 2) + "\n");
  folder.write("changes.ply", [&](const fs::path& file) { write_ply(file, changes_cloud(found)); });
  folder.write("after.ply", [&](const fs::path& file) { write_ply(file, found.after.cloud); });
  folder.write("after.txt",
               [&](const fs::path& file) { write_trajectory(file, found.after.cameras); });
  folder.write("changes.png", [&](const fs::path& file) { write_png(file, draw_changes(found)); });
  print_out("{}{}", changes_text(found), folder.written_text());
  folder.require_all();
  return kSuccess;
}

void write_map_files(const SavedMap& saved, ResultFolder& folder) {
  folder.write("landmarks.ply",
               [&](const fs::path& file) { write_ply(file, landmark_cloud(saved)); });
  folder.write_text("graph.json", json_text(map_graph(saved), 1) + "\n");
  const auto sessions = keyframe_trajectories(saved.map, main_component(saved));
  for (const auto& [number, keyframes] : sessions) {
    const bool only = sessions.size() == 1;
    folder.write(only ? "keyframes.txt" : fmt::format("keyframes_session_{}.txt", number),
                 [&](const fs::path& file) { write_trajectory(file, keyframes); });
  }
  if (!saved.views.empty())
    folder.write("cloud.ply", [&](const fs::path& file) { write_ply(file, dense_cloud(saved)); });
}

bool has_no_photo(const PosedView& posed) { return image_of(posed.view->photo).empty(); }

/// Writes the photos, masks and depths of the views of a placed map.
class ImageWriter {
 public:
  ImageWriter(const PlacedMap& placed, bool with_depth, ResultFolder& folder)
      : placed_(placed), with_depth_(with_depth), folder_(folder) {}

  PosedImages written() {
    PosedImages images{photo_camera(*placed_.views.front().view), {}};
    for (const PosedView& posed : placed_.views) write(posed, images);
    if (masked_ == 0)
      print_error(
          "stillmap: note: no pixel is masked: nothing moved, or the map was made without a "
          "network, and people who stood still are in the images\n");
    return images;
  }

 private:
  void write(const PosedView& posed, PosedImages& images) {
    const DenseView& view = *posed.view;
    const std::string name = fmt::format("{:05}.jpg", images.images.size());
    const cv::Size size(images.camera.width, images.camera.height);
    folder_.write_text("images/" + name, std::string(view.photo.begin(), view.photo.end()));
    const cv::Mat1b mask = static_mask(posed, *placed_.grid);
    masked_ += cv::countNonZero(mask == 0);
    write("masks/" + name + ".png", enlarged(mask, size));
    if (with_depth_) write("depth/" + name + ".png", enlarged(static_millimeters(view), size));
    images.images.push_back({name, posed.T_world_camera});
    view.drop_pages();
  }
  void write(const std::string& name, const cv::Mat& image) {
    folder_.write(name, [&](const fs::path& file) { write_png(file, image); });
  }
  static cv::Mat enlarged(const cv::Mat& image, cv::Size size) {
    cv::Mat large;
    cv::resize(image, large, size, 0, 0, cv::INTER_NEAREST);
    return large;
  }

  const PlacedMap& placed_;
  bool with_depth_;
  ResultFolder& folder_;
  std::int64_t masked_ = 0;  // pixels
};

void write_colmap(const PosedImages& images, const Cloud& cloud, ColmapFormat format,
                  ResultFolder& folder) {
  const std::string end = format == ColmapFormat::kText ? ".txt" : ".bin";
  const std::string model = format == ColmapFormat::kText ? "sparse_text/0/" : "sparse/0/";
  folder.write_text(model + "cameras" + end, colmap_cameras(images, format));
  folder.write_text(model + "images" + end, colmap_images(images, format));
  folder.write_text(model + "points3D" + end, colmap_points(cloud, format));
}

/// Returns the motion of the world into a frame with z up: none if it has z up already.
Pose upright_frame(const SearchedFloor& floor) {
  const FloorFinding& finding = floor.finding;
  if (finding.up && is_upright(*finding.up)) return {};
  if (finding.floor) return map_frame(*finding.floor, floor.cameras.front());
  return {upright_axes(finding, floor.surfels, floor.cameras), {0, 0, 0}};
}

/// Writes the files for other programs.
void write_scene_files(const MapArguments& arguments, const SavedMap& saved, ResultFolder& folder) {
  const auto wanted = [&](const char* format) {
    return std::find(arguments.formats.begin(), arguments.formats.end(), format) !=
           arguments.formats.end();
  };
  const PlacedMap placed = placed_map(arguments, saved);
  const Cloud cloud = cloud_of(placed).cloud;
  if (wanted("las"))
    folder.write_text("cloud.las", las_bytes(cloud, upright_frame(search_floor(placed, {}))));
  const bool with_images = std::ranges::any_of(
      arguments.formats, [](const std::string& format) { return format != "las"; });
  if (!with_images) return;
  if (std::ranges::any_of(placed.views, has_no_photo)) {
    throw Error("has views without images: an earlier version made them", arguments.file,
                "make the map again with stillmap run");
  }
  const PosedImages images = ImageWriter(placed, wanted("nerfstudio"), folder).written();
  if (wanted("colmap")) write_colmap(images, cloud, ColmapFormat::kBinary, folder);
  if (wanted("colmap-text")) write_colmap(images, cloud, ColmapFormat::kText, folder);
  if (!wanted("nerfstudio")) return;
  folder.write("sparse_pc.ply", [&](const fs::path& file) { write_ply(file, cloud); });
  folder.write_text("transforms.json", json_text(nerfstudio_transforms(images), 1) + "\n");
}

int export_map(const MapArguments& arguments) {
  for (const std::string& format : arguments.formats) {
    if (std::find(kFormats.begin(), kFormats.end(), format) == kFormats.end()) {
      throw Error("there is no format '" + format + "'", "--for",
                  fmt::format("use {}", fmt::join(kFormats, ", ")));
    }
  }
  const SavedMap saved = read_saved_map(arguments.file);
  ResultFolder folder(
      arguments.out.empty() ? fs::path(arguments.file).stem().string() + "_export" : arguments.out,
      arguments.force ? ResultFolder::Foreign::kOverwrite : ResultFolder::Foreign::kKeep);
  if (arguments.formats.empty())
    write_map_files(saved, folder);
  else
    write_scene_files(arguments, saved, folder);
  print_out("{}", folder.written_text());
  folder.require_all();
  return code_for(saved);
}

}  // namespace

void add_map_command(CLI::App& app, int& exit_code) {
  CLI::App* map = app.add_subcommand(
      "map", "describe, merge, compare, align, export or reduce maps saved by `run --save-map`");
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
  slimming->add_option("-o,--out", arguments->out, "file to write; default: NAME.slim.map")
      ->type_name("FILE");
  add_force_option(*slimming, arguments->force);
  slimming->footer("Example:\n  stillmap map slim office.map --out small.map");
  slimming->callback([arguments, &exit_code] { exit_code = slim(*arguments); });
  CLI::App* merging = map->add_subcommand(
      "merge", "merge maps that show common places into one; the others remain apart in it");
  merging->add_option("files", arguments->files, "saved maps, or folders of runs")
      ->required()
      ->type_name("FILE or DIR");
  merging->add_option("-o,--out", arguments->out, "file to write")->required()->type_name("FILE");
  merging->add_option("--json", arguments->json,
                      "also write which maps are connected to a JSON file (- for standard output)");
  merging
      ->add_option("--memory", arguments->memory,
                   "memory for the views and the features of keyframes, as for run [MB]")
      ->check(CLI::Range(0, 1000000));
  add_force_option(*merging, arguments->force);
  merging->footer(
      "That maps stay apart is no error: --json tells it.\nExample:\n  stillmap map merge "
      "monday.map tuesday.map --out site.map");
  add_quiet_option(*merging);
  merging->callback([arguments, &exit_code] { exit_code = merge(*arguments); });
  CLI::App* comparing = map->add_subcommand(
      "changes", "find the objects that appeared, went or moved between two visits");
  comparing->add_option("files", arguments->files, "map of the earlier and of the later visit")
      ->required()
      ->expected(2)
      ->type_name("FILE or DIR");
  comparing
      ->add_option(
          "-o,--out", arguments->out,
          "folder for changes.json, changes.ply, changes.png, and the later map as after.ply, with "
          "its views in after.txt")
      ->required()
      ->type_name("DIR");
  add_force_option(*comparing, arguments->force);
  comparing->footer(
      "Example:\n  stillmap map changes monday.map friday.map --out changes\n"
      "  stillmap view changes");
  add_quiet_option(*comparing);
  comparing->callback([arguments, &exit_code] { exit_code = changes(*arguments); });
  CLI::App* aligning =
      map->add_subcommand("align", "move the map into the frame of its site, by known points");
  aligning->add_option("file", arguments->file, "saved map, or folder of a run")->required();
  aligning
      ->add_option(
          "--points", arguments->points,
          "lines 'name,x,y,z,X,Y,Z': coordinates of three or more points in the map, as the view's "
          "Measure shows them, and at the site [m]; or 'tag36h11:7,X,Y,Z' for the center of a tag "
          "that `map info` lists; or 'name@TIME,u,v,X,Y,Z' for a pixel of the undistorted image of "
          "a keyframe, whose times are in keyframes.txt; with --plan U,V in place of X,Y,Z")
      ->required();
  CLI::Option* plan = aligning->add_option(
      "--plan", arguments->plan,
      "image of a floor plan, in which a point is at column U and row V; its lower left corner is "
      "the origin of the site. The map drawn onto it is written beside --out (.plan.png)");
  plan->type_name("FILE");
  CLI::Option* scale =
      aligning->add_option("--scale", arguments->scale, "side of a pixel of the plan [m]");
  scale->check(CLI::PositiveNumber)->needs(plan);
  plan->needs(scale);
  aligning->add_option("-o,--out", arguments->out, "file to write")->required()->type_name("FILE");
  add_force_option(*aligning, arguments->force);
  aligning->footer(
      "Runs that load the new map, and what is exported from it, are in the frame of the site.\n"
      "Example:\n  stillmap map align hall.map --points survey.csv --out hall_site.map");
  aligning->callback([arguments, &exit_code] { exit_code = align(*arguments); });
  CLI::App* exporting = map->add_subcommand(
      "export",
      "write landmarks.ply, keyframes.txt (TUM format), graph.json and cloud.ply, or the files of "
      "other programs");
  exporting->add_option("file", arguments->file, "saved map, or folder of a run")->required();
  exporting->add_option("--out", arguments->out, "output folder; default: NAME_export");
  exporting
      ->add_option("--for", arguments->formats,
                   fmt::format("formats of other programs with commas: {}; images with masks of "
                               "what moves, poses, points",
                               fmt::join(kFormats, ", ")))
      ->delimiter(',')
      ->type_name(fmt::format("{{{}}}", fmt::join(kFormats, ",")));
  add_force_option(*exporting, arguments->force);
  exporting->footer(
      "Examples:\n  stillmap map export office.map --out office\n"
      "  stillmap map export RUN --for colmap,nerfstudio,las --out scene\n"
      "docs/dense_map.md explains the files.");
  exporting->callback([arguments, &exit_code] { exit_code = export_map(*arguments); });
}

}  // namespace stillmap
