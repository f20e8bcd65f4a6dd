// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"

#include <cstddef>
#include <optional>
#include <string>

#include <Eigen/Core>

namespace stillmap {

enum class WarningKind {
  kZone,     ///< A mover is in a zone.
  kNear,     ///< A mover is too near to a point.
  kCourse,   ///< A mover and a point will come too near to each other.
  kUnseen,   ///< Movers in a zone could be missed: most of it is out of view or hidden.
  kUnknown,  ///< Movers could be missed: the camera is lost, has no depth, or the network is late.
};

/// Begin or end of a warning.
struct WarningEvent {
  bool begins = true;
  WarningKind kind = WarningKind::kZone;
  std::size_t id = 0;      ///< Running number from 1; in WarningMonitor::active() of the begin.
  std::string rule;        ///< Name of the zone or distance rule, or the reason of kUnknown.
  std::string point;       ///< Point of a distance rule; otherwise empty.
  double nearer = 0;       ///< Distance of the rule; 0 for others [m].
  int mover = 0;           ///< Id of the mover; 0 for kUnseen and kUnknown; negative: not shown.
  std::string class_name;  ///< Of the mover.
  double confidence = 0;   ///< Of its class [0..1].
  bool observed = true;    ///< The mover is observed, not predicted.
  double distance = 0;     ///< From the point, or the nearest predicted one; 0 for zones [m].
  double seconds = 0;      ///< Time until the nearest predicted distance [s].
  bool seen_clear = true;  ///< Of an end: the mover was seen outside; false: it went out of sight.
  std::size_t frame = 0;
  double timestamp = 0;                                ///< [s]
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< Of the mover, world frame [m].
  std::optional<Pose> T_world_camera;
};

/// Returns the name of a kind as in events.jsonl: zone, near, course, unseen or unknown.
std::string name_of(WarningKind kind);

/// Returns an event as a sentence: "person 3 is in zone 'gate'".
std::string warning_text(const WarningEvent& event);

}  // namespace stillmap
