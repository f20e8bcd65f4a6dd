// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"
#include "stillmap/warn/rules.hpp"
#include "stillmap/warn/warning_event.hpp"

#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// A moving object as the rules see it. World frame.
struct WatchedMover {
  int id = 0;
  std::string class_name = "unknown";
  double confidence = 0;  ///< Of its class [0..1].
  bool observed = false;  ///< It was observed in this frame, not predicted.
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s]
  Eigen::AlignedBox3d box;                             ///< [m]
};

/// What is known at one frame.
struct WatchedFrame {
  std::size_t index = 0;
  double timestamp = 0;                 ///< [s]
  std::optional<Pose> T_world_camera;   ///< None while the camera is lost.
  double depth_share = 1;               ///< Share of the pixels with a depth [0..1].
  double mask_age = 0;                  ///< Age of the network's result [s]; 0 without a network.
  double movers_age = 0;                ///< Age of `movers` [s].
  std::vector<double> zones_seen = {};  ///< Share of each zone in view [0..1]; empty: not known.
  std::vector<WatchedMover> movers;
};

/// Evaluates the rules in each frame. A warning begins in the first frame that breaks a rule, and
/// ends when the rule has been kept for kHold, with a margin of kMargin for distances; so it does
/// not flicker. A mover that vanishes keeps its warnings for kHold as well. While the camera is
/// lost, warnings stay as they are. It is an aid, no safety device.
class WarningMonitor {
 public:
  static constexpr double kHold = 0.5;      ///< [s]
  static constexpr double kMargin = 1.1;    ///< Factor of the distance that ends a warning.
  static constexpr double kMinDepth = 0.2;  ///< Least share of pixels with a depth.
  static constexpr double kMinSeen = 0.5;   ///< Least share of a zone in view.
  static constexpr double kMaxAge =
      0.7;  ///< Greatest age of the movers and the network's result [s].

  explicit WarningMonitor(WarningRules rules) : rules_(std::move(rules)) {}

  /// Returns the warnings that begin or end in the next frame.
  std::vector<WarningEvent> update(const WatchedFrame& frame);

  /// Returns the begin of a kUnknown that no frame tells, such as that no frame comes; nothing if
  /// it has begun already. It ends with the frames that come again.
  std::vector<WarningEvent> announce(const std::string& reason);

  /// Returns the present warnings, as of the newest frame.
  std::vector<WarningEvent> active() const;

  const WarningRules& rules() const { return rules_; }

 private:
  using Key = std::tuple<WarningKind, std::string, int>;
  struct Active {
    WarningEvent newest;
    double broken = 0;  // last time at which the rule was broken [s]
    bool seen = false;  // the mover has been observed since then
  };

  std::vector<WarningEvent> broken_rules(const WatchedFrame& frame);
  void check_unknown(const WatchedFrame& frame, std::vector<WarningEvent>& broken) const;
  void check_unseen(const WatchedFrame& frame, std::vector<WarningEvent>& broken) const;
  void check_distance(const DistanceRule& rule, const WatchedFrame& frame,
                      const WatchedMover& mover, std::vector<WarningEvent>& broken) const;
  bool is_active(WarningKind kind, const std::string& rule, int mover) const;
  bool is_own_load(const WatchedMover& mover, const Pose& T_world_camera) const;
  Eigen::Vector3d camera_velocity() const;

  WarningRules rules_;
  std::size_t events_ = 0;  // number of events so far
  std::map<Key, Active> active_;
  WatchedFrame newest_;                                     // without movers
  std::deque<std::pair<double, Eigen::Vector3d>> cameras_;  // recent positions by time
};

/// Returns an event as a line of events.jsonl; docs/view.md lists its keys.
nlohmann::json warning_json(const WarningEvent& event);

/// Returns the event of a line of events.jsonl: the inverse of warning_json(). Throws
/// nlohmann::json::exception if it is none.
WarningEvent warning_of(const nlohmann::json& json);

/// A warning from its begin to its end.
struct Warning {
  WarningEvent begin;
  std::optional<double> end;  ///< None if it lasted to the end of the run [s].
};

/// Returns the warnings of the events of a run, in the order in which they begin.
std::vector<Warning> warnings_of(const std::vector<WarningEvent>& events);

/// Returns the present warnings for the page of the view, type "warnings", as warning_json() does.
/// @param count  number of warnings that have begun so far
nlohmann::json warnings_message(const std::vector<WarningEvent>& active, std::size_t count);

/// Returns the warnings of a run for the page of the view, type "events": each like warning_json()
/// of its begin, and "end" [s], null if there is none.
nlohmann::json events_message(const std::vector<Warning>& warnings);

}  // namespace stillmap
