// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"
#include "stillmap/recording/recording.hpp"

#include <map>
#include <optional>
#include <string>

namespace stillmap {

/// The transforms between coordinate frames that a recording contains: those of /tf_static, and the
/// first ones of /tf for cameras whose driver publishes fixed transforms there. They are read on
/// demand.
class FrameTree {
 public:
  /// @param recording  must outlive the tree
  explicit FrameTree(Recording& recording) : recording_(&recording) {}
  /// Returns T_a_b; none if no chain of transforms connects the frames.
  std::optional<Pose> find(const std::string& a, const std::string& b);

 private:
  void read(bool fixed);
  std::optional<Pose> chain(const std::string& a, const std::string& b) const;

  Recording* recording_;
  bool has_fixed_ = false, has_all_ = false;                      // which of them were read
  std::map<std::string, std::map<std::string, Pose>> neighbors_;  // T_frame_neighbor
};

}  // namespace stillmap
