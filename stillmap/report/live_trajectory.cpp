// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/live_trajectory.hpp"

#include "stillmap/base/number.hpp"
#include "stillmap/geometry/trajectory.hpp"

#include <fstream>
#include <string>

#include <fmt/format.h>

namespace stillmap {

LiveTrajectory::LiveTrajectory(ResultFolder& folder)
    : lines_(folder, kLiveTrajectory,
             "# timestamp tx ty tz qx qy qz qw, as known when the frame was tracked\n") {}

void LiveTrajectory::on_frame(SlamSystem& slam) {
  const TrackedFrame& tracked = *slam.newest();
  const double timestamp = tracked.frame->image->timestamp;
  const auto T_world_camera = tracked.T_world_filtered();
  lines_.add(T_world_camera ? pose_line(timestamp, *T_world_camera)
                            : fmt::format("# {:.6f} no pose: {}\n", timestamp, tracked.reason));
}

std::vector<LiveFrame> read_live_frames(const std::filesystem::path& file) {
  std::vector<LiveFrame> frames;
  std::ifstream lines(file);
  for (std::string line; std::getline(lines, line);) {
    const bool comment = line.starts_with("# ");
    if (comment && line.find("no pose") == std::string::npos) continue;
    const auto timestamp = leading_number(std::string_view(line).substr(comment ? 2 : 0));
    frames.push_back({timestamp ? timestamp->value : 0, !comment});
  }
  return frames;
}

}  // namespace stillmap
