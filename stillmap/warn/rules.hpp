// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/warn/event_address.hpp"
#include "stillmap/warn/zone.hpp"

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// A rule about the distance of movers from a point that moves with the camera.
struct DistanceRule {
  std::string name;              ///< Name of the rule: that of its point, unless several have it.
  std::string point = "camera";  ///< Name of the point.
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< The point in the camera frame [m].
  double nearer = 2;   ///< A mover whose cylinder is nearer is too near [m].
  double within = 0;   ///< Time to look ahead for courses that come too near; 0: none [s].
  bool level = false;  ///< Whether distances are measured along the floor, as for a raised hook.
  std::vector<std::string> classes;  ///< Classes of movers that it is for; empty: all.
  double confidence = 0;             ///< A class of a lower confidence counts as "unknown" [0..1].
};

/// Class of movers without one.
inline constexpr const char* kNoClass = "unknown";

/// The hook or the load of the crane itself, which the camera may see as a mover without a class.
struct OwnLoad {
  std::string point;                                 ///< Name of the point that it hangs at.
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< The point in the camera frame [m].
  double radius = 0;  ///< Movers without a class whose centroid is as near are the load [m].
};

/// What to warn of.
struct WarningRules {
  Eigen::Vector3d up = {0, -1, 0};  ///< Unit vector, world frame.
  bool up_is_given = false;         ///< Whether the file has it.
  std::vector<Zone> zones;
  std::vector<DistanceRule> distances;
  std::vector<OwnLoad> loads = {};           ///< Movers that nothing warns of.
  std::vector<EventAddress> receivers = {};  ///< Where the events are sent.
};

/// Points in the camera frame by their names [m].
using NamedPoints = std::map<std::string, Eigen::Vector3d>;

/// Reads a file of rules; docs/view.md has its format. Throws Error that names the key for unknown
/// keys, missing or invalid values, names that are used twice, and a file without rules.
/// @param points  points that the rules may name besides those of the file, in whose place they are
WarningRules read_warning_rules(const std::filesystem::path& file, const NamedPoints& points = {});

/// Returns the rules in force as a file for read_warning_rules(). The receivers are left out: the
/// file is for the results of a run, where their passwords do not belong.
std::string rules_yaml(const WarningRules& rules);

/// Throws Error, naming `where` and the rule, if a rule is for a class that no mover can have: it
/// would never warn, and its silence would mean nothing.
/// @param known  classes of the network or the masks; none: there is neither, so that all movers
///               have the class "unknown"
void check_rule_classes(const WarningRules& rules,
                        const std::optional<std::vector<std::string>>& known,
                        const std::string& where);

/// Returns the zones for the page of the view: {"type": "zones", "zones": [...]}.
nlohmann::json zones_message(const WarningRules& rules);

}  // namespace stillmap
