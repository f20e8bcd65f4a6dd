// SPDX-License-Identifier: Apache-2.0
#include "warning_options.hpp"

namespace stillmap {

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
  return {{"hook", Eigen::Vector3d(offset.data())}};
}

}  // namespace stillmap
