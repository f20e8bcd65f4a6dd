// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/warn/warning_monitor.hpp"

#include <optional>
#include <vector>

namespace stillmap {

/// Collects the input of WarningMonitor for each frame.
class FrameWatch {
 public:
  /// @param zones        zones whose visible share is computed
  /// @param has_network  whether there are masks to come
  FrameWatch(std::vector<Zone> zones, bool has_network);

  /// Returns the input for the frame pushed last. In lockstep this waits for its movers.
  WatchedFrame newest(SlamSystem& slam);

 private:
  double mask_age(const FrameRecord& record);

  const std::vector<Zone> zones_;
  const bool has_network_;
  std::optional<double> first_;  // time of the first frame [s]
  double previous_ = 0;          // time of the previous frame [s]
  double frame_time_ = 0;        // time between the last two frames [s]
};

}  // namespace stillmap
