// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/doctor.hpp"

#include "command_tree.hpp"
#include "commands.hpp"
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

int run(const DoctorArguments& arguments) {
  const std::string& camera = arguments.camera;
  const Diagnosis diagnosis =
      diagnose(arguments.folder, camera.empty() ? std::nullopt : std::optional(read_camera(camera)),
               arguments.associations);
  for (const Finding& finding : diagnosis.findings) {
    fmt::print("{}{}\n", label(finding.severity), finding.what);
    if (!finding.fix.empty()) fmt::print("        fix: {}\n", finding.fix);
  }
  switch (diagnosis.conclusion()) {
    case Severity::kOk:
      fmt::print("No problems were found.\n");
      break;
    case Severity::kWarning:
      fmt::print("This sequence can be mapped, but see the warnings.\n");
      break;
    case Severity::kError:
      fmt::print("This sequence cannot be mapped as it is.\n");
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
