// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/file.hpp"
#include "stillmap/base/machine.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/report/comparison_chart.hpp"
#include "stillmap/segment/make_detector.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/tum_folder.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"
#include "stillmap/simulate/tum_writer.hpp"

#include <array>

#include "commands.hpp"
#include "interrupt.hpp"
#include "progress.hpp"
#include "run_session.hpp"
#include "terminal.hpp"
#include <fmt/format.h>

namespace stillmap {
namespace {
namespace fs = std::filesystem;

struct DemoArguments {
  std::string out = "stillmap_demo", model;
  int frames = 240;
  bool force = false;

  ResultFolder::Foreign foreign() const {
    return force ? ResultFolder::Foreign::kOverwrite : ResultFolder::Foreign::kKeep;
  }
};

constexpr std::array<const char*, 3> kPresets{"static", "seg-mask", "fused"};
constexpr const char* kChart = "comparison.svg";

/// Throws Error before the rendering if a foreign file would be overwritten. The folder of the
/// sequence is checked by write_tum_layout().
void require_free(const DemoArguments& arguments) {
  const fs::path out = arguments.out;
  ResultFolder(out, arguments.foreign()).require_free(std::array<std::string, 1>{kChart});
  for (const char* preset : kPresets) {
    ResultFolder(out / preset, arguments.foreign())
        .require_free(possible_run_files(read_options(preset), {}));
  }
}

fs::path render(const DemoArguments& arguments) {
  SimulationOptions options;
  options.people = 3;
  options.frames = arguments.frames;
  const SimulatedSequence sequence(options);
  const fs::path folder = fs::path(arguments.out) / "sequence";
  make_output_folder(folder);
  Progress progress("rendering", sequence.frames());
  write_tum_layout(sequence, folder, [&](std::size_t) {
    progress.step();
    return !interrupted();
  });
  return folder;
}

/// Maps the rendered sequence like `stillmap run`, with the rendered masks instead of a network.
RunRecord map(const DemoArguments& arguments, const fs::path& folder, const std::string& preset) {
  const SequencePaths paths = find_sequence(folder);
  Session session;
  session.begun = seconds_since_start();
  session.sequence = "demo";
  session.options = read_options(preset);
  if (preset != "static") {
    Options::Network& network = session.options.network;
    network.model = arguments.model;
    if (arguments.model.empty()) network.masks = paths.masks.string();
  }
  session.parameters = parameters_of(session.options);
  session.detector = make_detector(session.parameters.segment);
  auto source = std::make_unique<TumFolder>(paths, read_camera(paths.camera.string()));
  session.total_frames = source->size();
  session.source = std::move(source);
  session.truth = read_trajectory(paths.ground_truth);
  session.out = fs::path(arguments.out) / preset;
  session.foreign = arguments.foreign();
  return run_session(std::move(session));
}

int run(const DemoArguments& arguments) {
  require_free(arguments);
  catch_interrupt();
  print_out("1. Render an office with three walking people and the noise of a Kinect\n");
  const fs::path folder = render(arguments);
  if (interrupted()) return kInterrupted;
  const Trajectory truth = read_trajectory(folder / "groundtruth.txt");
  std::vector<RecordedRun> runs;
  int step = 2;
  for (const char* preset : kPresets) {
    print_out("\n{}. Map it with preset {}\n", step++, preset);
    RunRecord record = map(arguments, folder, preset);
    if (record.interrupted) return kInterrupted;
    runs.push_back({preset, "", record.result.trajectory, truth,
                    static_cast<std::size_t>(arguments.frames),
                    findings_on_trajectory(record.findings)});
  }
  print_out("\n{}. Compare\n", step);
  const Comparison comparison = compare_runs(runs);
  ResultFolder results(arguments.out, arguments.foreign());
  results.write_text(kChart, comparison_chart(comparison).file());
  results.require_all();
  print_out("{}\n{}{}", comparison_markdown(comparison), results.written_text(),
            open_line(fs::path(arguments.out) / "fused" / "report.html",
                      ", or turn the map in a browser: stillmap view " +
                          (fs::path(arguments.out) / "fused").string()));
  return kSuccess;
}

}  // namespace

void add_demo_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<DemoArguments>();
  CLI::App* command = app.add_subcommand(
      "demo", "render a scene with walking people, map it with three presets, and compare");
  command->add_option("--out", arguments->out, "output folder")->capture_default_str();
  command->add_option("--frames", arguments->frames, "number of frames to render")
      ->capture_default_str();
  command->add_option("--model", arguments->model,
                      "network (.onnx) that detects people; default: the rendered masks");
  add_force_option(*command, arguments->force);
  add_quiet_option(*command);
  command->footer("Example:\n  stillmap demo --out /tmp/demo");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace stillmap
