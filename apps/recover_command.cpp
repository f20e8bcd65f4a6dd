// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/pipeline/map_description.hpp"
#include "stillmap/pipeline/recovered_run.hpp"
#include "stillmap/pipeline/run_findings.hpp"
#include "stillmap/pipeline/saved_views.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/report/live_changes.hpp"
#include "stillmap/report/live_trajectory.hpp"
#include "stillmap/report/obstacle_files.hpp"
#include "stillmap/report/run_folder.hpp"

#include "commands.hpp"
#include <fmt/format.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

struct RecoverArguments {
  std::string source, out;
  DenseOutputs outputs;
  bool force = false;
};

/// Returns the journal in the folder of a run, or the file itself.
fs::path journal_of(const fs::path& source) {
  const fs::path journal = fs::is_directory(source) ? source / kRunJournal : source;
  if (fs::exists(journal)) return journal;
  if (!fs::exists(source))
    throw Error("there is no such folder", source.string(), "name the folder of a run");
  throw Error("has no journal: its run ended and wrote all its results, or never began",
              source.string(), "name the folder of a run that was killed");
}

/// Returns the results of the run up to its last journal record.
SlamResult result_of(const RecoveredRun& run, const SlamParameters& parameters) {
  const FrameLog log(run.frames);
  SlamResult result;
  result.set_poses(camera_poses(log, Map(run.map.map), parameters.smooth_trajectory));
  const auto sessions = keyframe_trajectories(run.map.map);
  if (!sessions.empty()) result.keyframes = sessions.rbegin()->second;
  result.placed = place_views(run.map, parameters.dense);
  result.dense = cloud_of(result.placed);
  result.dense_statistics.keyframes = run.map.views.size();
  result.movers = run.movers;
  result.frames = run.frames;
  result.up = upward(run.frames, result.trajectory);
  log.add_times_to(result.timing);
  result.landmarks = run.map.map.landmarks.size();
  result.maps = run.map.map.first.size();
  result.events = run.events;
  result.camera = run.map.map.camera;
  return result;
}

/// Returns the number of poses of a trajectory; 0 if it cannot be read.
std::size_t poses_in(const fs::path& trajectory) {
  try {
    return read_trajectory(trajectory).size();
  } catch (const Error&) {
    return 0;
  }
}

/// Throws Error if a folder holds the results of an earlier run with more poses than a killed run
/// has frames.
void require_fewer_poses(const fs::path& folder, std::size_t frames) {
  const fs::path file = folder / "trajectory.txt";
  if (!fs::exists(file)) return;
  const std::size_t poses = poses_in(file);
  if (poses <= frames) return;
  throw Error(fmt::format("has {} poses of an earlier run, and the killed run has only {}", poses,
                          counted(frames, "frame")),
              file.string(),
              "name another folder for them with --out DIR; --force replaces the earlier results");
}

int run(const RecoverArguments& arguments) {
  check(arguments.outputs);
  const fs::path journal = journal_of(arguments.source);
  const fs::path out = arguments.out.empty() ? journal.parent_path() : fs::path(arguments.out);
  ResultFolder folder(out.empty() ? "." : out, arguments.force ? ResultFolder::Foreign::kOverwrite
                                                               : ResultFolder::Foreign::kKeep);
  const RecoveredRun recovered = recovered_run(journal, {.folder = folder.path()});
  if (recovered.frames.empty()) {
    throw Error("holds no frame: the run was killed in its first second", journal.string(),
                "map the recording again");
  }
  if (!arguments.force) require_fewer_poses(folder.path(), recovered.frames.size());
  if (fs::exists(folder.path() / kRunSummary))
    print_error("stillmap: note: {} holds the results of an earlier run, which are replaced\n",
                folder.path().string());
  folder.write_text(kRunOptions, recovered.heading.options);
  folder.require_all();
  RunRecord record;
  record.sequence = recovered.heading.sequence;
  record.machine = recovered.heading.machine;
  record.options = read_options("", folder.path() / kRunOptions);
  SlamParameters parameters = parameters_of(record.options);
  parameters.dense.memory.folder = folder.path();
  record.result = result_of(recovered, parameters);
  record.map = recovered.map;
  record.frames = recovered.frames.size();
  record.interrupted = record.recovered = true;
  if (!recovered.map.damage.empty())
    record.findings.push_back(make_finding("damaged-map", recovered.map.damage));
  append(run_findings(record), record.findings);
  RunOutputs outputs;
  outputs.dense = arguments.outputs;
  write_run_files(record, outputs, folder);
  for (const char* live :
       {kLiveTrajectory, kLiveObstacles, kLiveChanges}) {  // stay: they cannot be made again
    if (folder.path() == journal.parent_path() && fs::exists(folder.path() / live))
      folder.write(live, [](const fs::path&) {});
  }
  print_out(
      "recovered: {} of {} with a pose, {}, {}; the last frame is at "
      "{:.6f} s\n",
      record.result.tracked(), counted(record.frames, "frame"),
      counted(recovered.map.map.keyframes.size(), "keyframe"),
      counted(recovered.map.views.size(), "view"), recovered.frames.back().timestamp);
  print_out("{}", folder.written_text());
  folder.require_all();
  folder.remove_own(std::vector<std::string>{kRunJournal});
  folder.remove_stale();
  return print_findings(record.findings);
}

}  // namespace

void add_recover_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<RecoverArguments>();
  CLI::App* command = app.add_subcommand(
      "recover", "write the results of a run that was killed, up to its last second");
  command
      ->add_option("source", arguments->source,
                   "output folder of the run, or the run.journal in it")
      ->required();
  add_dense_options(*command, arguments->outputs);
  command->add_option("--out", arguments->out, "output folder; default: that of the run");
  add_force_option(*command, arguments->force);
  command->footer(
      "Examples:\n"
      "  stillmap recover stillmap_office\n"
      "  stillmap recover stillmap_office --planner --out recovered\n"
      "Files: those of stillmap run. Nothing is adjusted once more, so the poses are those that\n"
      "the map had when the run was killed. stillmap run --load-map FOLDER and stillmap map info\n"
      "FOLDER read the folder of a killed run, too.");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace stillmap
