// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/doctor.hpp"

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

int run(const std::string& folder, const std::string& camera) {
  const Diagnosis diagnosis =
      diagnose(folder, camera.empty() ? std::nullopt : std::optional(read_camera(camera)));
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
  struct Arguments {
    std::string folder, camera;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("doctor", "check a recording and its camera for problems");
  command->add_option("folder", arguments->folder, "sequence in TUM layout")->required();
  command->add_option("--camera", arguments->camera,
                      "preset name or file; default: the sequence's camera.yaml");
  command->footer(
      "Example:\n  stillmap doctor my_sequence --camera tum_fr3\nExit code 1 if the sequence "
      "cannot be mapped as it is.");
  command->callback(
      [arguments, &exit_code] { exit_code = run(arguments->folder, arguments->camera); });
}

}  // namespace stillmap
