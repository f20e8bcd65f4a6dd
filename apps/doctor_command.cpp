// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/pipeline/calibrate_recording.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/doctor.hpp"
#include "stillmap/sensor/make_source.hpp"

#include <memory>
#include <string>

#include "command_tree.hpp"
#include "commands.hpp"
#include "source_with_progress.hpp"
#include <fmt/format.h>

namespace stillmap {
namespace {

const char* label(Severity severity) {
  switch (severity) {
    case Severity::kOk:
      return "ok      ";
    case Severity::kWarning:
      return "WARNING ";
    case Severity::kError:
      return "ERROR   ";
  }
  return "";
}

struct DoctorArguments {
  std::string folder, camera, associations;
};

/// Number of frames from which the camera is checked; some seconds of work.
constexpr int kCalibrationFrames = 300;

/// Adds what the recording shows about the errors of its camera.
void check_calibration(const DoctorArguments& arguments, Diagnosis& diagnosis) {
  const std::string& folder = arguments.folder;
  SourceOptions range;
  range.camera = arguments.camera;
  range.associations = arguments.associations;
  range.count = kCalibrationFrames;
  int pass = 0;
  const auto open = [&](const Camera& recorded) -> std::unique_ptr<FrameSource> {
    range.recorded = recorded;
    return std::make_unique<SourceWithProgress>(make_source(folder, range), ++pass);
  };
  try {
    const auto report =
        calibrate_recording(open, recorded_camera(folder, range), parameters_of(read_options("")));
    for (const std::string& finding : calibration_findings(report)) {
      diagnosis.add(Severity::kWarning, finding,
                    "write a corrected camera file with: stillmap calibrate " + folder +
                        (arguments.camera.empty() ? "" : " --camera " + arguments.camera));
    }
  } catch (const Error& error) {
    diagnosis.add(Severity::kWarning, error.what());
  }
}

int run(const DoctorArguments& arguments) {
  const std::string& camera = arguments.camera;
  Diagnosis diagnosis =
      diagnose(arguments.folder, camera.empty() ? std::nullopt : std::optional(read_camera(camera)),
               arguments.associations);
  if (diagnosis.conclusion() != Severity::kError) check_calibration(arguments, diagnosis);
  for (const Finding& finding : diagnosis.findings) {
    print_out("{}{}\n", label(finding.severity), finding.what);
    if (!finding.fix.empty()) print_out("        fix: {}\n", finding.fix);
  }
  switch (diagnosis.conclusion()) {
    case Severity::kOk:
      print_out("No problems were found.\n");
      break;
    case Severity::kWarning:
      print_out("This sequence can be mapped, but see the warnings.\n");
      break;
    case Severity::kError:
      print_out("This sequence cannot be mapped as it is.\n");
      break;
  }
  return diagnosis.conclusion() == Severity::kError ? kFailure : kSuccess;
}

}  // namespace

void add_doctor_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<DoctorArguments>();
  CLI::App* command = app.add_subcommand("doctor", "check a recording and its camera for problems");
  command->add_option("folder", arguments->folder, "sequence in TUM layout")->required();
  command
      ->add_option("--camera", arguments->camera,
                   "preset name or file; default: the sequence's camera.yaml")
      ->type_name(names_or_file(camera_presets()));
  command->add_option("--associations", arguments->associations,
                      "file that pairs color and depth images");
  command->footer(
      "Example:\n  stillmap doctor my_sequence --camera tum_fr3\nExit code 1 if the sequence "
      "cannot be mapped as it is.");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace stillmap
