// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/run_folder.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/file_copy.hpp"
#include "stillmap/base/json_text.hpp"
#include "stillmap/base/machine.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/evaluate/timing.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/report/live_changes.hpp"
#include "stillmap/report/live_trajectory.hpp"
#include "stillmap/report/mover_files.hpp"
#include "stillmap/report/mover_image.hpp"
#include "stillmap/report/obstacle_files.hpp"
#include "stillmap/report/planner_files.hpp"
#include "stillmap/report/profile.hpp"
#include "stillmap/report/report_page.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <nlohmann/json.hpp>

namespace stillmap {
namespace {
namespace fs = std::filesystem;

/// Writes the map for `stillmap dense`, and the one that the user wants saved.
/// @returns time taken [s]
double write_maps(const RunRecord& record, const RunOutputs& outputs, ResultFolder& folder) {
  if (!record.map) return 0;
  const SavedMap& map = *record.map;
  const Stopwatch watch;
  bool written = false;
  if (!map.views.empty() || (record.recovered && !map.map.keyframes.empty())) {
    written = folder.write(kRunMap, [&](const fs::path& file) { write_saved_map(file, map); });
    folder.write_text(kRunOptions, options_yaml(record.options));
  }
  if (outputs.save_map.empty()) return 0;
  folder.write_elsewhere(outputs.save_map, [&](const fs::path& file) {
    if (outputs.slim_map) return write_saved_map(file, {map.writer, map.map, {}});
    if (written) return write_copy(folder.path() / kRunMap, file);
    write_saved_map(file, map);
  });
  return watch.milliseconds() / 1000;
}

void write_summary(const RunRecord& record, const RunOutputs& outputs, double saving_seconds,
                   ResultFolder& folder) {
  nlohmann::json summary = run_summary_json(record);
  if (!outputs.save_map.empty())
    summary["saved_map"] = {{"file", outputs.save_map.string()}, {"seconds", saving_seconds}};
  folder.write_text(kRunSummary, json_text(summary, 2) + "\n");
}

/// Adds to the findings of the record.
ReportImages write_dense_map(RunRecord& record, const DenseOutputs& outputs, ResultFolder& folder) {
  const SlamResult& result = record.result;
  ReportImages images;
  DenseOutputs known = outputs;
  known.floor.gravity = result.up;
  DenseFiles files =
      write_dense_files({result.dense, result.placed, result.trajectory, result.movers},
                        dense_parameters_of(record.options), known, folder);
  images.more = std::move(files.images);
  if (!files.floor_problem.empty())
    record.findings.push_back(make_finding("floor-unknown", files.floor_problem));
  if (images.more.empty()) return images;
  images.cloud = images.more.front();
  images.more.erase(images.more.begin());
  return images;
}

CaptionedImage movers_image(const SlamResult& result) {
  const Cloud& cloud = result.dense.cloud;
  return {draw_movers(result.movers, result.trajectory, {cloud.points, cloud.colors, {}}),
          "Paths from above, from the first position (disc) to the last one (box; the arrow is the "
          "path of one second); dotted where the position was predicted"};
}

}  // namespace

std::vector<std::string> file_names(RunPart part) {
  switch (part) {
    case RunPart::kAlways:
      return {"trajectory.txt", "trajectory_covariance.txt",
              "keyframes.txt",  "frames.csv",
              "timing.txt",     kRunSummary,
              "report.html"};
    case RunPart::kLive:
      return {kLiveTrajectory, kRunJournal};
    case RunPart::kMovers:
      return {"movers.csv", "movers.jsonl", "movers.png"};
    case RunPart::kDense:
      return {"cloud.ply", "cloud.png", "cloud_before_after.png", kRunMap, kRunOptions};
    case RunPart::kObjects:
      return {"semantic.ply", "semantic_classes.ply", "semantic_legend.png", "semantic.png",
              "objects.json"};
    case RunPart::kMesh:
      return mesh_file_names({"ply", "glb", "obj"});
    case RunPart::kPlanner: {
      std::vector<std::string> names = planner_file_names();
      names.emplace_back(kLiveObstacles);
      return names;
    }
    case RunPart::kChanges:
      return {kLiveChanges};
    case RunPart::kLabels:
      return {LabelRecording().file()};
    case RunPart::kWarnings:
      return {kRunWarnings, kRunRules};
    case RunPart::kProfile:
      return {"profile.txt", "profile.svg", "trace.json"};
  }
  return {};
}

void require_ended_run(const fs::path& folder) {
  if (!fs::exists(folder / kRunJournal)) return;
  if (is_written_to(folder))
    throw Error("another run writes its results to this folder", folder.string(),
                "wait for its end");
  throw Error(
      "holds the journal of a run that did not end; other results there may be those of an "
      "earlier run",
      folder.string(), "write its results with: stillmap recover " + folder.string());
}

void remove_journal(const Options& options, ResultFolder& folder) {
  std::vector<std::string> results{"trajectory.txt", "keyframes.txt", kRunSummary};
  if (options.dense.enabled) results.insert(results.end(), {kRunMap, kRunOptions});
  if (options.movers.enabled) results.emplace_back("movers.csv");
  if (folder.is_complete() || folder.wrote(results)) folder.discard(kRunJournal);
}

std::vector<std::string> possible_run_files(const Options& options, const RunOutputs& outputs) {
  std::vector<std::string> names = file_names(RunPart::kAlways);
  const auto add = [&](bool wanted, RunPart part) {
    if (!wanted) return;
    const auto more = file_names(part);
    names.insert(names.end(), more.begin(), more.end());
  };
  add(options.movers.enabled, RunPart::kMovers);
  add(options.dense.enabled, RunPart::kDense);
  add(options.dense.enabled, RunPart::kObjects);
  add(outputs.dense.planner, RunPart::kPlanner);
  add(outputs.profile, RunPart::kProfile);
  for (std::string& name : mesh_file_names(outputs.dense.mesh)) names.push_back(std::move(name));
  if (outputs.labels.save) names.push_back(outputs.labels.file());
  return names;
}

void write_run_files(RunRecord& record, const RunOutputs& outputs, ResultFolder& folder) {
  const SlamResult& result = record.result;
  const std::vector<std::string> last{kRunSummary, "report.html"};
  folder.remove_own(last);
  folder.write("trajectory.txt",
               [&](const fs::path& file) { write_trajectory(file, result.trajectory); });
  folder.write("trajectory_covariance.txt",
               [&](const fs::path& file) { write_covariances(file, result.poses); });
  folder.write("keyframes.txt",
               [&](const fs::path& file) { write_trajectory(file, result.keyframes); });
  if (record.options.movers.enabled) {
    folder.write_text("movers.csv", movers_csv(result.movers));
    folder.write_text("movers.jsonl", movers_jsonl(result.movers));
  }
  const double saving_seconds = write_maps(record, outputs, folder);
  ReportImages images;
  if (record.options.dense.enabled) images = write_dense_map(record, outputs.dense, folder);
  if (!result.movers.empty()) {
    images.movers = movers_image(result);
    folder.write("movers.png",
                 [&](const fs::path& file) { write_png(file, images.movers->image); });
  }
  folder.write_text("frames.csv", frames_csv(result));
  folder.write_text("timing.txt", timing_text(result.timing.stages()));
  record.peak_memory_mib = peak_memory_mib();
  write_summary(record, outputs, saving_seconds, folder);
  for (const fs::path& file : folder.written()) {
    if (file.filename() == kRunJournal) continue;  // removed at the end
    images.files.push_back(file.lexically_relative(folder.path()).string());
  }
  folder.write_text("report.html", report_html(record, images));
}

std::string write_profile(const Trace& trace, double process_cpu_ms, ResultFolder& folder) {
  const Profile profile = make_profile(trace, process_cpu_ms);
  folder.write_text("profile.txt", machine_description() + "\n" + profile_text(profile));
  folder.write_text("profile.svg", profile_chart(trace).file());
  folder.write_text("trace.json", trace_json(trace));
  return profile_in_brief(profile);
}

std::vector<std::filesystem::path> write_run_folder(RunRecord record,
                                                    const std::filesystem::path& folder,
                                                    const RunOutputs& outputs,
                                                    ResultFolder::Foreign foreign) {
  ResultFolder files(folder, foreign);
  files.require_free(possible_run_files(record.options, outputs));
  write_run_files(record, outputs, files);
  files.remove_stale();
  files.require_all();
  return files.written();
}

}  // namespace stillmap
