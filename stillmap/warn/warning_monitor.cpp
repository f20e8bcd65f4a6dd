// SPDX-License-Identifier: Apache-2.0
#include "stillmap/warn/warning_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

constexpr double kVelocityTime = 0.4;  // time over which the camera's velocity is taken [s]
constexpr double kCourseStep = 0.1;    // step of the search for the nearest approach [s]

/// Whether a rule for some classes is for a mover. A class of a lower confidence than that of the
/// rule counts as "unknown".
bool is_for(const std::vector<std::string>& classes, double confidence, const WatchedMover& mover) {
  const std::string name = mover.confidence < confidence ? kNoClass : mover.class_name;
  return classes.empty() || std::find(classes.begin(), classes.end(), name) != classes.end();
}

WarningEvent event_of(const WatchedFrame& frame, WarningKind kind, const std::string& rule) {
  WarningEvent event;
  event.kind = kind;
  event.rule = rule;
  event.frame = frame.index;
  event.timestamp = frame.timestamp;
  event.T_world_camera = frame.T_world_camera;
  return event;
}

WarningEvent event_of(const WatchedFrame& frame, WarningKind kind, const std::string& rule,
                      const WatchedMover& mover) {
  WarningEvent event = event_of(frame, kind, rule);
  event.mover = mover.id;
  event.class_name = mover.class_name;
  event.confidence = mover.confidence;
  event.observed = mover.observed;
  event.position = mover.centroid;
  return event;
}

WarningEvent event_of(const WatchedFrame& frame, WarningKind kind, const DistanceRule& rule,
                      const WatchedMover& mover, double distance) {
  WarningEvent event = event_of(frame, kind, rule.name, mover);
  event.point = rule.point;
  event.nearer = rule.nearer;
  event.distance = distance;
  return event;
}

/// Whether a warning is about what is not known, and not about a mover.
bool is_gap(WarningKind kind) {
  return kind == WarningKind::kUnseen || kind == WarningKind::kUnknown;
}

/// Returns the mover of a warning: "person 3", or "person" if it has no number to be shown.
std::string mover_text(const WarningEvent& event) {
  const std::string name = event.class_name == kNoClass ? "object" : event.class_name;
  return event.mover > 0 ? fmt::format("{} {}", name, event.mover) : name;
}

/// Returns where the mover of a warning is: "in zone 'gate'".
std::string place_text(const WarningEvent& event) {
  if (event.kind == WarningKind::kZone) return fmt::format("in zone '{}'", event.rule);
  const bool near = event.kind == WarningKind::kNear;
  const std::string text = (near ? "near the " : "on course to the ") + event.point;
  return event.rule == event.point ? text : fmt::format("{} ({})", text, event.rule);
}

/// Returns that it is there no longer: "has left zone 'gate'".
std::string left_text(const WarningEvent& event) {
  if (event.kind == WarningKind::kZone) return fmt::format("has left zone '{}'", event.rule);
  return "is no longer " + place_text(event);
}

Eigen::Vector3d vector_of(const nlohmann::json& json) {
  return {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()};
}

double rounded(double value) { return std::round(value * 1e3) / 1e3; }

}  // namespace

std::vector<WarningEvent> WarningMonitor::update(const WatchedFrame& frame) {
  if (frame.T_world_camera) {
    cameras_.emplace_back(frame.timestamp, frame.T_world_camera->translation());
    while (cameras_.front().first < frame.timestamp - kVelocityTime) cameras_.pop_front();
  } else {
    cameras_.clear();
  }
  newest_ = frame;
  newest_.movers.clear();
  std::vector<WarningEvent> changes;
  for (WarningEvent& event : broken_rules(frame)) {
    const auto [entry, begins] = active_.try_emplace(Key{event.kind, event.rule, event.mover});
    event.id = begins ? ++events_ : entry->second.newest.id;
    entry->second = {event, frame.timestamp, false};
    if (begins) changes.push_back(event);
  }
  std::set<int> seen;
  for (const WatchedMover& mover : frame.movers) {
    if (mover.observed) seen.insert(mover.id);
  }
  for (auto entry = active_.begin(); entry != active_.end();) {
    Active& warning = entry->second;
    const bool unknown = is_gap(warning.newest.kind);
    const bool broken_now = warning.broken == frame.timestamp;
    if (warning.newest.kind != WarningKind::kUnknown && !frame.T_world_camera)
      warning.broken = frame.timestamp;  // nothing is known
    if (!broken_now && seen.contains(warning.newest.mover)) warning.seen = true;
    if (frame.timestamp - warning.broken < kHold) {
      ++entry;
      continue;
    }
    warning.newest.id = ++events_;
    warning.newest.begins = false;
    warning.newest.seen_clear = unknown || warning.seen;
    warning.newest.frame = frame.index;
    warning.newest.timestamp = frame.timestamp;
    warning.newest.T_world_camera = frame.T_world_camera;
    changes.push_back(warning.newest);
    entry = active_.erase(entry);
  }
  return changes;
}

std::vector<WarningEvent> WarningMonitor::announce(const std::string& reason) {
  WarningEvent event = event_of(newest_, WarningKind::kUnknown, reason);
  const auto [entry, begins] = active_.try_emplace(Key{event.kind, event.rule, event.mover});
  if (!begins) return {};
  event.id = ++events_;
  entry->second = {event, newest_.timestamp, false};
  return {std::move(event)};
}

std::vector<WarningEvent> WarningMonitor::active() const {
  std::vector<WarningEvent> events;
  for (const auto& [key, warning] : active_) events.push_back(warning.newest);
  return events;
}

std::vector<WarningEvent> WarningMonitor::broken_rules(const WatchedFrame& frame) {
  std::vector<WarningEvent> broken;
  check_unknown(frame, broken);
  if (!frame.T_world_camera) return broken;
  check_unseen(frame, broken);
  for (const WatchedMover& mover : frame.movers) {
    if (is_own_load(mover, *frame.T_world_camera)) continue;
    const UprightCylinder space = cylinder_in(mover.box, mover.centroid, rules_.up);
    for (const Zone& zone : rules_.zones) {
      if (is_for(zone.classes, zone.confidence, mover) && reaches_into(zone, space))
        broken.push_back(event_of(frame, WarningKind::kZone, zone.name, mover));
    }
    for (const DistanceRule& rule : rules_.distances) {
      if (is_for(rule.classes, rule.confidence, mover)) check_distance(rule, frame, mover, broken);
    }
  }
  return broken;
}

void WarningMonitor::check_unknown(const WatchedFrame& frame,
                                   std::vector<WarningEvent>& broken) const {
  const auto add = [&](const char* reason) {
    broken.push_back(event_of(frame, WarningKind::kUnknown, reason));
  };
  if (!frame.T_world_camera) add("the camera is lost");
  if (frame.depth_share < kMinDepth) add("there is hardly any depth");
  if (frame.mask_age > kMaxAge) add("the network is late");
  if (frame.T_world_camera && frame.movers_age > kMaxAge) add("the moving objects are late");
}

void WarningMonitor::check_unseen(const WatchedFrame& frame,
                                  std::vector<WarningEvent>& broken) const {
  for (std::size_t i = 0; i < std::min(rules_.zones.size(), frame.zones_seen.size()); ++i) {
    const std::string& zone = rules_.zones[i].name;
    const double least = is_active(WarningKind::kUnseen, zone, 0) ? kMargin * kMinSeen : kMinSeen;
    if (frame.zones_seen[i] < least) broken.push_back(event_of(frame, WarningKind::kUnseen, zone));
  }
}

void WarningMonitor::check_distance(const DistanceRule& rule, const WatchedFrame& frame,
                                    const WatchedMover& mover,
                                    std::vector<WarningEvent>& broken) const {
  const Eigen::Vector3d point = *frame.T_world_camera * rule.offset;
  const auto limit = [&](WarningKind kind) {
    return is_active(kind, rule.name, mover.id) ? kMargin * rule.nearer : rule.nearer;
  };
  const UprightCylinder space = cylinder_in(mover.box, mover.centroid, rules_.up);
  const double now = distance_of(space, point, rules_.up, rule.level);
  if (now < limit(WarningKind::kNear)) {
    broken.push_back(event_of(frame, WarningKind::kNear, rule, mover, now));
    return;
  }
  const Eigen::Vector3d approach = camera_velocity() - mover.velocity;  // seen from the mover
  double nearest = now, when = 0;
  for (int step = 1; step * kCourseStep <= rule.within + 1e-9; ++step) {
    const double time = step * kCourseStep;
    const double then = distance_of(space, point + time * approach, rules_.up, rule.level);
    if (then < nearest) {
      nearest = then;
      when = time;
    }
  }
  if (when == 0 || nearest >= limit(WarningKind::kCourse)) return;
  WarningEvent event = event_of(frame, WarningKind::kCourse, rule, mover, nearest);
  event.seconds = when;
  broken.push_back(event);
}

bool WarningMonitor::is_active(WarningKind kind, const std::string& rule, int mover) const {
  return active_.contains({kind, rule, mover});
}

/// Whether a mover is what hangs at a named point. Only movers without a class can be: a person is
/// warned of wherever he or she is.
bool WarningMonitor::is_own_load(const WatchedMover& mover, const Pose& T_world_camera) const {
  if (mover.class_name != kNoClass) return false;
  return std::any_of(rules_.loads.begin(), rules_.loads.end(), [&](const OwnLoad& load) {
    return (T_world_camera * load.offset - mover.centroid).norm() <= load.radius;
  });
}

/// Returns the mean velocity in the last moments; zero right after a loss [m/s].
Eigen::Vector3d WarningMonitor::camera_velocity() const {
  if (cameras_.size() < 2) return Eigen::Vector3d::Zero();
  const auto& [first, from] = cameras_.front();
  const auto& [last, to] = cameras_.back();
  return (to - from) / (last - first);
}

std::string warning_text(const WarningEvent& event) {
  const std::string who = mover_text(event);
  if (!event.begins && !is_gap(event.kind)) {
    return event.seen_clear ? fmt::format("clear: {} {}", who, left_text(event))
                            : fmt::format("out of sight: {}, last {}", who, place_text(event));
  }
  // Several rules of one point have names that tell them apart.
  const std::string title = event.rule == event.point ? "" : event.rule + ": ";
  switch (event.kind) {
    case WarningKind::kZone:
      return fmt::format("{} is {}", who, place_text(event));
    case WarningKind::kNear:
      return fmt::format("{}{} is {:.1f} m from the {}", title, who, event.distance, event.point);
    case WarningKind::kCourse:
      return fmt::format("{}{} will be {:.1f} m from the {} in {:.1f} s", title, who,
                         event.distance, event.point, event.seconds);
    case WarningKind::kUnseen:
      return fmt::format("zone '{}' is {}in view", event.rule, event.begins ? "not " : "");
    case WarningKind::kUnknown:
      return (event.begins ? "not known: " : "over: ") + event.rule;
  }
  return "";
}

// The first one is that of unknown names.
NLOHMANN_JSON_SERIALIZE_ENUM(WarningKind, {{WarningKind::kUnknown, "unknown"},
                                           {WarningKind::kZone, "zone"},
                                           {WarningKind::kNear, "near"},
                                           {WarningKind::kCourse, "course"},
                                           {WarningKind::kUnseen, "unseen"}})

std::string name_of(WarningKind kind) { return nlohmann::json(kind).get<std::string>(); }

nlohmann::json warning_json(const WarningEvent& event) {
  const auto array = [](const Eigen::Vector3d& v) {
    return nlohmann::json::array({rounded(v.x()), rounded(v.y()), rounded(v.z())});
  };
  nlohmann::json json{{"id", event.id},
                      {"event", event.begins ? "begin" : "end"},
                      {"kind", event.kind},
                      {"rule", event.rule},
                      {"frame", event.frame},
                      {"timestamp", event.timestamp},
                      {"text", warning_text(event)},
                      {"camera", nullptr}};
  if (event.T_world_camera) {
    const auto& q = event.T_world_camera->quaternion().coeffs();
    json["camera"] = array(event.T_world_camera->translation());
    for (int i = 0; i < 4; ++i) json["camera"].push_back(std::round(q[i] * 1e5) / 1e5);
  }
  if (is_gap(event.kind)) return json;
  json["mover"] = event.mover;
  json["class"] = event.class_name;
  json["confidence"] = rounded(event.confidence);
  json["observed"] = event.observed;
  json["position"] = array(event.position);
  if (event.kind != WarningKind::kZone) {
    json["point"] = event.point;
    json["nearer"] = event.nearer;
    json["distance"] = rounded(event.distance);
  }
  if (event.kind == WarningKind::kCourse) json["seconds"] = rounded(event.seconds);
  if (!event.begins) json["seen_clear"] = event.seen_clear;
  return json;
}

WarningEvent warning_of(const nlohmann::json& json) {
  WarningEvent event;
  event.begins = json.at("event") == "begin";
  event.kind = json.at("kind").get<WarningKind>();
  event.id = json.value("id", event.id);
  event.rule = json.at("rule").get<std::string>();
  event.point = json.value("point", event.point);
  event.nearer = json.value("nearer", event.nearer);
  event.mover = json.value("mover", event.mover);
  event.class_name = json.value("class", event.class_name);
  event.confidence = json.value("confidence", event.confidence);
  event.observed = json.value("observed", event.observed);
  event.distance = json.value("distance", event.distance);
  event.seconds = json.value("seconds", event.seconds);
  event.seen_clear = json.value("seen_clear", event.seen_clear);
  event.frame = json.at("frame").get<std::size_t>();
  event.timestamp = json.at("timestamp").get<double>();
  if (json.contains("position")) event.position = vector_of(json["position"]);
  if (const nlohmann::json& camera = json.at("camera"); camera.is_array()) {
    const Eigen::Quaterniond q(camera.at(6).get<double>(), camera.at(3).get<double>(),
                               camera.at(4).get<double>(), camera.at(5).get<double>());
    event.T_world_camera = Pose(q, vector_of(camera));
  }
  return event;
}

std::vector<Warning> warnings_of(const std::vector<WarningEvent>& events) {
  std::vector<Warning> warnings;
  std::map<std::tuple<WarningKind, std::string, int>, std::size_t> open;
  for (const WarningEvent& event : events) {
    const std::tuple key{event.kind, event.rule, event.mover};
    if (event.begins) {
      open[key] = warnings.size();
      warnings.push_back({event, std::nullopt});
    } else if (const auto begun = open.find(key); begun != open.end()) {
      warnings[begun->second].end = event.timestamp;
      open.erase(begun);
    }
  }
  return warnings;
}

nlohmann::json warnings_message(const std::vector<WarningEvent>& active, std::size_t count) {
  nlohmann::json list = nlohmann::json::array();
  for (const WarningEvent& event : active) list.push_back(warning_json(event));
  return {{"type", "warnings"}, {"count", count}, {"active", std::move(list)}};
}

nlohmann::json events_message(const std::vector<Warning>& warnings) {
  nlohmann::json events = nlohmann::json::array();
  for (const Warning& warning : warnings) {
    events.push_back(warning_json(warning.begin));
    events.back()["end"] = warning.end ? nlohmann::json(*warning.end) : nlohmann::json();
  }
  return {{"type", "events"}, {"events", std::move(events)}};
}

}  // namespace stillmap
