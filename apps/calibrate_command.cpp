// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/pipeline/calibrate_recording.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/make_source.hpp"

#include <filesystem>
#include <memory>

#include "command_tree.hpp"
#include "commands.hpp"
#include "source_with_progress.hpp"
#include <fmt/format.h>

namespace stillmap {
namespace {

struct CalibrateArguments {
  std::string recording, camera, out = "camera.yaml";
  int first = 0, count = 600;
  bool force = false;
};

const char* text_of(CalibrationVerdict verdict) {
  switch (verdict) {
    case CalibrationVerdict::kKept:
      return "kept";
    case CalibrationVerdict::kCorrected:
      return "corrected";
    case CalibrationVerdict::kNotObservable:
      return "not observable from this recording";
  }
  return "";
}

/// Returns one line of the table. Times are shown in milliseconds.
std::string line_of(const CalibratedParameter& p) {
  const bool time = p.key == "readout" || p.key == "depth_delay";
  const bool disparity = p.key.starts_with("disparity");
  const double factor = time ? 1000 : 1;
  const int digits = disparity ? 4 : time ? 1 : 2;
  const std::string name = p.key + (time ? " [ms]" : disparity ? " [1/m]" : " [pixels]");
  return fmt::format("{:<25}{:>10.{}f}{:>11.{}f}{:>10.{}f}  {}\n", name, factor * p.given, digits,
                     factor * p.estimated, digits, factor * p.sigma, digits, text_of(p.verdict));
}

void check_output(const std::filesystem::path& file, bool force) {
  if (std::filesystem::is_directory(file))
    throw Error("is a folder", file.string(), "name a file with --out FILE");
  const std::filesystem::path folder = std::filesystem::absolute(file).parent_path();
  if (!std::filesystem::is_directory(folder))
    throw Error("does not exist", folder.string(), "create the folder, or name another with --out");
  if (std::filesystem::exists(file) && !force) {
    throw Error("exists already", file.string(),
                "name another file with --out, or add --force to overwrite it");
  }
}

int run(const CalibrateArguments& arguments) {
  check_output(arguments.out, arguments.force);
  SourceOptions range;
  range.camera = arguments.camera;
  range.first = arguments.first;
  range.count = arguments.count;
  const Camera given = recorded_camera(arguments.recording, range);
  int pass = 0;
  const auto open = [&](const Camera& camera) -> std::unique_ptr<FrameSource> {
    range.recorded = camera;
    return std::make_unique<SourceWithProgress>(make_source(arguments.recording, range), ++pass);
  };
  const CalibrationReport report =
      calibrate_recording(open, given, parameters_of(read_options("")));
  print_out("{}, {}, {}\n", counted(report.frames, "frame"),
            counted(report.observations, "observation"), counted(pass, "pass"));
  print_out("{:<25}{:>10}{:>11}{:>10}  verdict\n", "parameter", "given", "estimated", "sigma");
  for (const CalibratedParameter& parameter : report.parameters)
    print_out("{}", line_of(parameter));
  for (const std::string& finding : calibration_findings(report)) print_out("{}\n", finding);
  write_camera(arguments.out, report.camera);
  print_out("written: {} (use it with: stillmap run {} --camera {})\n", arguments.out,
            arguments.recording, arguments.out);
  return kSuccess;
}

}  // namespace

void add_calibrate_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<CalibrateArguments>();
  CLI::App* command = app.add_subcommand(
      "calibrate", "estimate intrinsics, depth error and shutter timing from a recording");
  command->add_option("recording", arguments->recording, "folder in TUM layout")->required();
  command
      ->add_option(
          "--camera", arguments->camera,
          "camera to start with: preset name or file; default: the recording's camera.yaml")
      ->type_name(names_or_file(camera_presets()));
  command->add_option("--out", arguments->out, "camera file to write")
      ->type_name("FILE")
      ->capture_default_str();
  command->add_flag("--force", arguments->force, "overwrite the file if it exists");
  command->add_option("--first", arguments->first, "number of frames to skip at the start")
      ->capture_default_str();
  command->add_option("--count", arguments->count, "maximum number of frames; 0: all")
      ->capture_default_str();
  add_quiet_option(*command);
  command->footer(
      "Example:\n  stillmap calibrate my_sequence --out my_camera.yaml\n"
      "Values that the recording does not show for certain stay as they are. A uniform scale of "
      "the depth cannot be observed without a known length.");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace stillmap
