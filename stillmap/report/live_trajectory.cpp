// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/live_trajectory.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/geometry/trajectory.hpp"

#include <cstdlib>
#include <string>

#include <fmt/format.h>

namespace stillmap {

LiveTrajectory::LiveTrajectory(ResultFolder& folder) {
  folder.write(kLiveTrajectory, [&](const std::filesystem::path& file) {
    write_file(file, "# timestamp tx ty tz qx qy qz qw, as known when the frame was tracked\n");
    file_.open(file, std::ios::app);
  });
}

void LiveTrajectory::add(const TrackedFrame& tracked) {
  if (!file_.is_open()) return;
  const double timestamp = tracked.frame->image->timestamp;
  if (const auto T_world_camera = tracked.T_world_filtered()) {
    file_ << pose_line(timestamp, *T_world_camera);
  } else {
    file_ << fmt::format("# {:.6f} no pose: {}\n", timestamp, tracked.reason);
  }
  file_.flush();
}

std::vector<LiveFrame> read_live_frames(const std::filesystem::path& file) {
  std::vector<LiveFrame> frames;
  std::ifstream lines(file);
  for (std::string line; std::getline(lines, line);) {
    const bool comment = line.starts_with("# ");
    if (comment && line.find("no pose") == std::string::npos) continue;
    frames.push_back({std::strtod(line.c_str() + (comment ? 2 : 0), nullptr), !comment});
  }
  return frames;
}

}  // namespace stillmap
