// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/print.hpp"

#include <cstdio>
#include <filesystem>

#include "commands.hpp"
#include "output_file.hpp"
#include "warning_options.hpp"
#include "warning_recorder.hpp"
#include "warning_replay.hpp"

namespace stillmap {
namespace {
namespace fs = std::filesystem;

struct WarnArguments {
  std::string run, zones, out, events;
  std::vector<double> hook_offset;
  bool force = false;
};

/// Throws Error if the folder has events already: those of a run tell what was really warned of.
/// @param names  the files that would be overwritten
void require_no_events(const fs::path& folder, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    if (fs::exists(folder / name))
      throw Error("exists already", (folder / name).string(),
                  "keep it by --out FOLDER, or replace it by --force; `stillmap view RUN --zones "
                  "FILE` shows the events of other rules and writes nothing");
  }
}

int warn(const WarnArguments& arguments) {
  std::FILE* const lines = arguments.events.empty() ? nullptr : standard_output_for_data();
  const WarningRules rules = rules_for(arguments.run, arguments.zones, arguments.hook_offset);
  const auto frames = watched_frames(arguments.run);
  const fs::path out = arguments.out.empty() ? arguments.run : arguments.out;
  const bool own_rules = arguments.zones.empty() && arguments.out.empty();
  if (!arguments.force) {
    require_no_events(
        out, own_rules ? std::vector<std::string>{kRunWarnings} : file_names(RunPart::kWarnings));
  }
  ResultFolder folder(
      out, arguments.force ? ResultFolder::Foreign::kOverwrite : ResultFolder::Foreign::kKeep);
  WarningRecorder recorder(rules, folder, {.show = {}, .lines = lines});
  for (const WatchedFrame& frame : frames) recorder.add(frame);
  folder.require_all();
  print_out("{} in {}: {}\n", counted(recorder.warnings(), "warning"),
            counted(frames.size(), "frame"), (folder.path() / kRunWarnings).string());
  print_out(
      "what was not known (no depth, old masks, zones out of view) is only told during a run\n");
  return kSuccess;
}

}  // namespace

void add_warn_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<WarnArguments>();
  CLI::App* command = app.add_subcommand(
      "warn", "evaluate zones and distances of moving objects on a finished run");
  command->add_option("run", arguments->run, "folder of results of stillmap run")->required();
  command->add_option("--zones", arguments->zones,
                      "YAML file of zones and distances (docs/view.md); default: those of the run");
  add_hook_offset(*command, arguments->hook_offset);
  command->add_option("--out", arguments->out,
                      "folder of events.jsonl; default: the folder of the run");
  add_events_option(*command, arguments->events);
  add_force_option(*command, arguments->force);
  command->footer(
      "Example:\n"
      "  stillmap warn results --zones zones.yaml\n"
      "`stillmap run --zones zones.yaml` warns during the run. An aid, no safety device.");
  command->callback([arguments, &exit_code] { exit_code = warn(*arguments); });
}

}  // namespace stillmap
