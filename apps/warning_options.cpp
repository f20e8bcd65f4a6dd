// SPDX-License-Identifier: Apache-2.0
#include "warning_options.hpp"

#include "stillmap/base/error.hpp"

#include "output_file.hpp"
#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr double kFarthestHook = 1000;  // [m]

}  // namespace

CLI::Option* add_events_option(CLI::App& command, std::string& events) {
  return command
      .add_option("--events", events,
                  "- writes each event as a line of JSON to standard output, and all other text to "
                  "standard error; default: events are printed as sentences")
      ->check(CLI::IsMember({kStandardOutput}))
      ->type_name("-");
}

CLI::Option* add_hook_offset(CLI::App& command, std::vector<double>& offset) {
  return command
      .add_option("--hook-offset", offset,
                  "RIGHT,DOWN,AHEAD: place of the point \"hook\" of the distances in the camera "
                  "frame [m], such as 0,4,6")
      ->delimiter(',')
      ->expected(3)
      ->type_name("X,Y,Z");
}

NamedPoints hook_at(const std::vector<double>& offset) {
  if (offset.empty()) return {};
  const Eigen::Vector3d hook(offset.data());
  if (!hook.allFinite() || hook.cwiseAbs().maxCoeff() > kFarthestHook) {
    throw Error(fmt::format("{},{},{} is no place near the camera", hook.x(), hook.y(), hook.z()),
                "--hook-offset", "give RIGHT,DOWN,AHEAD in meters, such as 0,4,6");
  }
  return {{"hook", hook}};
}

}  // namespace stillmap
