// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/report/live_lines.hpp"
#include "stillmap/report/run_sink.hpp"

#include <filesystem>
#include <vector>

namespace stillmap {

/// Name of the file.
constexpr const char* kLiveTrajectory = "trajectory_live.txt";

/// The file trajectory_live.txt of a run folder: T_world_camera of every frame in TUM format, as it
/// was known when the frame was tracked, and a comment for every frame without a pose. Each line is
/// written at once, so that the poses of a run that was killed are not lost.
class LiveTrajectory final : public RunSink {
 public:
  /// Starts the file. A problem is kept for ResultFolder::require_all().
  explicit LiveTrajectory(ResultFolder& folder);
  void on_frame(SlamSystem& slam) override;

 private:
  LiveLines lines_;
};

/// A frame of trajectory_live.txt.
struct LiveFrame {
  double timestamp = 0;  ///< [s]
  bool has_pose = false;
};

/// Returns the frames of a trajectory_live.txt in the order of its lines; none without the file.
std::vector<LiveFrame> read_live_frames(const std::filesystem::path& file);

}  // namespace stillmap
