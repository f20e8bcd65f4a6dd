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
      return "ok       ";
    case Severity::kNote:
      return "note     ";
    case Severity::kWarning:
      return "WARNING  ";
    case Severity::kUntrusted:
      return "UNTRUSTED";
    case Severity::kError:
      return "ERROR    ";
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
    const Camera camera = recorded_camera(folder, range);
    if (camera.depth_sensor.principle == DepthPrinciple::kStereo) return;  // cannot be replaced
    auto report = calibrate_recording(open, camera, parameters_of(read_options("")));
    // `run` estimates the readout time by itself.
    std::erase_if(report.parameters, [](const auto& p) { return p.key == "readout"; });
    if (report.carried_parts) {
      diagnosis.add(*report.carried_parts);
      return;  // the calibration relies on poses that follow these parts
    }
    const Severity severity =
        shows_wrong_intrinsics(report) ? Severity::kUntrusted : Severity::kWarning;
    for (const std::string& finding : calibration_findings(report)) {
      diagnosis.add(with_severity(
          severity,
          make_finding("calibration", finding,
                       "write a corrected camera file with: stillmap calibrate " + folder +
                           (arguments.camera.empty() ? "" : " --camera " + arguments.camera))));
    }
    if (!shows_focal_length(report)) {
      std::string text = "The focal length was not checked: the frames do not show it for certain.";
      if (report.discarded_focal_length) {
        text += fmt::format(" They fit {:.0f} pixels better than the given {:.0f}.",
                            *report.discarded_focal_length, camera.fx);
      }
      diagnosis.add_ok(text);
    }
  } catch (const Error& error) {
    diagnosis.add(make_finding("calibration", error.what()));
  }
}

/// Returns the camera that a run would use; none if the folder has no readable camera, which
/// diagnose() reports. Throws Error if the camera of --camera cannot be read.
std::optional<Camera> camera_of(const DoctorArguments& arguments) {
  SourceOptions options;
  options.camera = arguments.camera;
  options.associations = arguments.associations;
  try {
    return recorded_camera(arguments.folder, options);
  } catch (const Error&) {
    if (!arguments.camera.empty()) return read_camera(arguments.camera);
    return std::nullopt;
  }
}

/// Returns the diagnosis of a recorded file or a stereo pair.
Diagnosis examined(const DoctorArguments& arguments) {
  SourceOptions range;
  range.camera = arguments.camera;
  range.count = kCalibrationFrames;
  try {
    return diagnose(*make_source(arguments.folder, range), kCalibrationFrames);
  } catch (const Error& error) {
    Diagnosis diagnosis;
    diagnosis.add(make_finding("unreadable", error.where() + ": " + error.problem(), error.fix()));
    return diagnosis;
  }
}

int run(const DoctorArguments& arguments) {
  Diagnosis diagnosis =
      names_image_folder(arguments.folder)
          ? diagnose(arguments.folder, camera_of(arguments), arguments.associations)
          : examined(arguments);
  if (diagnosis.conclusion() < Severity::kUntrusted) check_calibration(arguments, diagnosis);
  for (const Finding& finding : diagnosis.findings) {
    print_out("{} {}{}\n", label(finding.severity), finding.message,
              finding.code.empty() ? "" : fmt::format(" [{}]", finding.code));
    if (!finding.fix.empty()) print_out("          fix: {}\n", finding.fix);
  }
  switch (diagnosis.conclusion()) {
    case Severity::kOk:
    case Severity::kNote:
      print_out("No problems were found.\n");
      return kSuccess;
    case Severity::kWarning:
      print_out("This sequence can be mapped, but see the warnings.\n");
      return kSuccess;
    case Severity::kUntrusted:
      print_out("This sequence can be mapped, but its map would be wrong: see the findings.\n");
      return kDoubtful;
    case Severity::kError:
      print_out("This sequence cannot be mapped as it is.\n");
      return kFailure;
  }
  return kFailure;
}

}  // namespace

void add_doctor_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<DoctorArguments>();
  CLI::App* command = app.add_subcommand("doctor", "check a recording and its camera for problems");
  command->add_option("recording", arguments->folder, "recording, as for run")->required();
  command
      ->add_option("--camera", arguments->camera,
                   "preset name or file; default: the sequence's camera.yaml")
      ->type_name(names_or_file(camera_presets()));
  command->add_option("--associations", arguments->associations,
                      "file that pairs color and depth images");
  add_quiet_option(*command);
  command->footer(
      "Example:\n  stillmap doctor my_sequence --camera tum_fr3\nExit code 1 if the sequence "
      "cannot be mapped as it is, 3 if its map would be wrong.");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace stillmap
