// SPDX-License-Identifier: Apache-2.0
#include "stillmap/warn/rules.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/nearest_name.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <yaml-cpp/yaml.h>

namespace stillmap {
namespace {

/// Values that a number may have. They only refuse mistakes, such as millimeters.
struct Range {
  double least = 0, most = 0;
};
constexpr Range kHeights{-1e3, 1e3};    // [m]
constexpr Range kOffsets{-1e3, 1e3};    // [m]
constexpr Range kNearer{0.01, 1e3};     // [m]
constexpr Range kWithin{0, 60};         // [s]
constexpr Range kLoadRadius{0.01, 20};  // [m]
constexpr Range kConfidence{0, 1};
constexpr double kShortestUp = 1e-6;  // least length of the upward direction

constexpr const char* kCorrect = "correct it; docs/view.md lists the keys with an example";

/// Returns a value for messages; empty for long ones.
std::string shown(const YAML::Node& node) {
  constexpr std::size_t kMostShown = 40, kMostItems = 4;
  std::string text;
  if (node.IsScalar()) text = "'" + node.Scalar() + "'";
  if (node.IsSequence() && node.size() <= kMostItems) {
    for (const YAML::Node& item : node) {
      if (!item.IsScalar()) return "";
      text += (text.empty() ? "[" : ", ") + item.Scalar();
    }
    text += text.empty() ? "[]" : "]";
  }
  return text.size() > kMostShown ? "" : text;
}

/// A map of the file, with its place for messages.
class Section {
 public:
  /// @param title  what the section is for: "zone 'gate'"; empty for the whole file
  Section(const YAML::Node& node, const std::string& file, std::string title,
          const std::vector<std::string>& keys)
      : node_(node), file_(file), title_(std::move(title)) {
    if (!node.IsDefined() || node.IsNull())
      throw Error("is empty", title_.empty() ? file_ : place(node),
                  "write zones or distances (docs/view.md)");
    if (!node.IsMap())
      throw Error("is no map of keys and values: " + shown(node), place(node), kCorrect);
    std::set<std::string> used;
    for (const auto& entry : node) {
      const auto key = entry.first.as<std::string>("");
      if (std::find(keys.begin(), keys.end(), key) == keys.end())
        throw Error("there is no key '" + key + "'", place(entry.first), suggestion(key, keys));
      if (!used.insert(key).second)
        throw Error("has the key '" + key + "' twice", place(entry.first), "join the two");
    }
  }

  bool has(const std::string& key) const { return node_[key].IsDefined(); }
  YAML::Node list(const std::string& key) const {
    if (has(key) && !node_[key].IsSequence()) fail(key, "is no list");
    return has(key) ? YAML::Node(node_[key]) : YAML::Node(YAML::NodeType::Sequence);
  }

  template <typename T>
  T value(const std::string& key) const {
    if (!has(key)) fail(key, "is missing");
    T value{};
    if (!YAML::convert<T>::decode(node_[key], value)) fail(key, "has no valid value");
    return value;
  }
  template <typename T>
  T value_or(const std::string& key, const T& otherwise) const {
    return has(key) ? value<T>(key) : otherwise;
  }
  std::string name(const std::string& key) const {
    const auto name = value<std::string>(key);
    if (name.empty()) fail(key, "is empty");
    return name;
  }

  double number(const std::string& key, const Range& range) const {
    const auto number = value<double>(key);
    if (!(number >= range.least && number <= range.most))
      fail(key, fmt::format("is out of range, {} to {}", range.least, range.most));
    return number;
  }
  double number_or(const std::string& key, double otherwise, const Range& range) const {
    return has(key) ? number(key, range) : otherwise;
  }
  /// Returns a vector whose elements are within a range.
  Eigen::Vector3d vector(const std::string& key, const Range& range) const {
    const Eigen::Vector3d vector = vector_of(node_[key], key);
    if (vector.minCoeff() < range.least || vector.maxCoeff() > range.most)
      fail(key, fmt::format("is out of range, {} to {}", range.least, range.most));
    return vector;
  }
  Eigen::Vector3d vector_of(const YAML::Node& node, const std::string& key) const {
    std::vector<double> values;
    const bool read = node.IsDefined() && YAML::convert<std::vector<double>>::decode(node, values);
    if (!read || values.size() != 3) fail(key, "needs three numbers [x, y, z]", node);
    const Eigen::Vector3d vector(values.data());
    if (!vector.allFinite()) fail(key, "has a number that is not finite", node);
    return vector;
  }
  /// Returns the classes of a rule; none if it is for all.
  std::vector<std::string> classes() const {
    const auto classes = value_or<std::vector<std::string>>("classes", {});
    if (has("classes") && classes.empty())
      fail("classes", "is empty; without this key the rule is for all classes");
    return classes;
  }

  [[noreturn]] void fail(const std::string& key, const std::string& what) const {
    fail(key, what, node_[key]);
  }
  [[noreturn]] void fail(const std::string& key, const std::string& what,
                         const YAML::Node& node) const {
    const bool defined = node.IsDefined();
    const std::string value = defined ? shown(node) : "";
    throw Error("'" + key + "' " + what + (value.empty() ? "" : ": " + value),
                place(defined ? node : node_), kCorrect);
  }

 private:
  /// Returns file, line and title.
  std::string place(const YAML::Node& node) const {
    const YAML::Mark mark = node.Mark();
    std::string text = mark.is_null() ? file_ : fmt::format("{}:{}", file_, mark.line + 1);
    return title_.empty() ? text : text + ", " + title_;
  }

  YAML::Node node_;
  std::string file_, title_;
};

/// Returns "zone 'gate'" for the section of a zone; "zones" if it has no name.
std::string title_of(const YAML::Node& node, const std::string& key, const std::string& one,
                     const std::string& list) {
  if (!node.IsMap() || !node[key].IsDefined() || !node[key].IsScalar()) return list;
  return one + " '" + node[key].Scalar() + "'";
}

Zone zone_of(const YAML::Node& node, const std::string& file, const Eigen::Vector3d& up) {
  const Section section(node, file, title_of(node, "name", "zone", "zones"),
                        {"name", "polygon", "height", "classes", "confidence"});
  Zone zone{.name = section.name("name"), .polygon = {}, .up = up, .classes = {}};
  for (const YAML::Node& corner : section.list("polygon"))
    zone.polygon.push_back(section.vector_of(corner, "polygon"));
  if (zone.polygon.size() < 3) section.fail("polygon", "has fewer than three corners");
  if (const std::string problem = polygon_problem(zone); !problem.empty())
    section.fail("polygon", problem);
  const auto heights = section.value_or<std::vector<double>>("height", {zone.low, zone.high});
  if (heights.size() != 2 || !(heights[0] < heights[1]) || heights[0] < kHeights.least ||
      heights[1] > kHeights.most)
    section.fail("height", "is no list of two ascending numbers in meters");
  zone.low = heights[0];
  zone.high = heights[1];
  zone.classes = section.classes();
  zone.confidence = section.number_or("confidence", zone.confidence, kConfidence);
  return zone;
}

/// A point of the file or of the caller.
struct Point {
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  double load_radius = 0;  // 0: nothing hangs at it [m]
};
using Points = std::map<std::string, Point>;

DistanceRule distance_of(const YAML::Node& node, const std::string& file, const Points& points) {
  const Section section(node, file, title_of(node, "to", "distance to", "distances"),
                        {"to", "name", "nearer", "within", "level", "classes", "confidence"});
  DistanceRule rule;
  rule.point = section.name("to");
  const auto point = points.find(rule.point);
  if (point == points.end()) section.fail("to", "names no point; add it to 'points'");
  rule.offset = point->second.offset;
  if (section.has("name")) rule.name = section.name("name");
  rule.nearer = section.number("nearer", kNearer);
  rule.within = section.number_or("within", rule.within, kWithin);
  rule.level = section.value_or("level", rule.level);
  rule.classes = section.classes();
  rule.confidence = section.number_or("confidence", rule.confidence, kConfidence);
  return rule;
}

/// Returns the rules of the distances. Those without a name get that of their point, with the
/// distance if it has several.
std::vector<DistanceRule> distances_of(const Section& file, const std::string& where,
                                       const Points& points) {
  std::vector<DistanceRule> rules;
  std::map<std::string, int> unnamed;
  for (const YAML::Node& node : file.list("distances")) {
    rules.push_back(distance_of(node, where, points));
    if (rules.back().name.empty()) ++unnamed[rules.back().point];
  }
  std::set<std::string> names;
  for (DistanceRule& rule : rules) {
    if (rule.name.empty()) {
      rule.name =
          unnamed[rule.point] == 1 ? rule.point : fmt::format("{} {} m", rule.point, rule.nearer);
    }
    if (!names.insert(rule.name).second)
      file.fail("distances", "has two rules named '" + rule.name + "': give each its own 'name'");
  }
  return rules;
}

/// @param given  points that replace those of the file
Points points_of(const Section& file, const std::string& where, const NamedPoints& given) {
  Points points{{"camera", {Eigen::Vector3d::Zero()}}};
  for (const YAML::Node& node : file.list("points")) {
    const Section point(node, where, title_of(node, "name", "point", "points"),
                        {"name", "offset", "load_radius"});
    const auto name = point.name("name");
    const Point values{point.vector("offset", kOffsets),
                       point.number_or("load_radius", 0, kLoadRadius)};
    if (!points.emplace(name, values).second) point.fail("name", "is used twice");
  }
  for (const auto& [name, offset] : given) points[name].offset = offset;
  return points;
}

std::vector<EventAddress> receivers_of(const Section& file, const std::string& where) {
  std::vector<EventAddress> receivers;
  for (const YAML::Node& node : file.list("send")) {
    if (!node.IsScalar()) file.fail("send", "is no list of addresses");
    receivers.push_back(parse_event_address(node.as<std::string>(), where + ", send"));
  }
  return receivers;
}

WarningRules rules_of(const YAML::Node& file, const NamedPoints& given, const std::string& where) {
  const Section section(file, where, "", {"up", "zones", "points", "distances", "send"});
  WarningRules rules;
  constexpr Range kAny{std::numeric_limits<double>::lowest(), std::numeric_limits<double>::max()};
  rules.up_is_given = section.has("up");
  if (rules.up_is_given) rules.up = section.vector("up", kAny);
  if (rules.up.stableNorm() < kShortestUp) section.fail("up", "is zero");
  rules.up.stableNormalize();
  std::set<std::string> names;
  for (const YAML::Node& node : section.list("zones")) {
    rules.zones.push_back(zone_of(node, where, rules.up));
    if (!names.insert(rules.zones.back().name).second)
      section.fail("zones", "has two zones named '" + rules.zones.back().name + "'");
  }
  const Points points = points_of(section, where, given);
  rules.distances = distances_of(section, where, points);
  for (const auto& [name, point] : points) {
    if (point.load_radius > 0) rules.loads.push_back({name, point.offset, point.load_radius});
  }
  rules.receivers = receivers_of(section, where);
  if (rules.zones.empty() && rules.distances.empty())
    throw Error("has no zones and no distances", where,
                "add 'zones' or 'distances'; docs/view.md has an example");
  return rules;
}

std::vector<double> numbers_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

using OrderedJson = nlohmann::ordered_json;  // a map of YAML in flow style, too

std::string yaml_list(const std::string& key, const std::vector<OrderedJson>& items) {
  std::string text = items.empty() ? "" : key + ":\n";
  for (const OrderedJson& item : items)
    text += "  - " + item.dump(-1, ' ', false, OrderedJson::error_handler_t::replace) + "\n";
  return text;
}

/// Adds the keys that zones and distances have in common.
void add_classes(const std::vector<std::string>& classes, double confidence, OrderedJson& json) {
  if (!classes.empty()) json["classes"] = classes;
  if (confidence > 0) json["confidence"] = confidence;
}

void check_classes_of(const std::vector<std::string>& classes,
                      const std::optional<std::vector<std::string>>& known,
                      const std::string& where) {
  const auto has = [](const std::vector<std::string>& list, const std::string& name) {
    return std::find(list.begin(), list.end(), name) != list.end();
  };
  if (classes.empty()) return;
  if (!known) {
    if (has(classes, kNoClass)) return;
    throw Error(
        fmt::format("is for the class '{}' only, but there is neither a network nor masks, "
                    "so that nothing that moves has a class: it would never warn",
                    classes.front()),
        where,
        "give a network (--model FILE.onnx) or masks (--masks DIR), or leave out 'classes', "
        "or add 'unknown' to them");
  }
  std::vector<std::string> all = *known;
  if (!has(all, kNoClass)) all.emplace_back(kNoClass);
  for (const std::string& name : classes) {
    if (!has(all, name))
      throw Error("there is no class '" + name + "': it would never warn of one", where,
                  suggestion(name, all));
  }
}

}  // namespace

WarningRules read_warning_rules(const std::filesystem::path& file, const NamedPoints& points) {
  const std::string text = read_file(file);
  try {
    return rules_of(YAML::Load(text), points, file.string());
  } catch (const YAML::Exception& e) {
    throw Error(std::string("is not valid: ") + e.what(), file.string(), kCorrect);
  }
}

std::string rules_yaml(const WarningRules& rules) {
  std::vector<OrderedJson> zones, points, distances;
  for (const Zone& zone : rules.zones) {
    OrderedJson json{{"name", zone.name}, {"polygon", OrderedJson::array()}};
    for (const Eigen::Vector3d& corner : zone.polygon)
      json["polygon"].push_back(numbers_of(corner));
    json["height"] = {zone.low, zone.high};
    add_classes(zone.classes, zone.confidence, json);
    zones.push_back(std::move(json));
  }
  Points used;
  for (const DistanceRule& rule : rules.distances) used[rule.point].offset = rule.offset;
  for (const OwnLoad& load : rules.loads) used[load.point] = {load.offset, load.radius};
  used.erase("camera");
  for (const auto& [name, point] : used) {
    points.push_back({{"name", name}, {"offset", numbers_of(point.offset)}});
    if (point.load_radius > 0) points.back()["load_radius"] = point.load_radius;
  }
  for (const DistanceRule& rule : rules.distances) {
    OrderedJson json{{"to", rule.point},
                     {"name", rule.name},
                     {"nearer", rule.nearer},
                     {"within", rule.within},
                     {"level", rule.level}};
    add_classes(rule.classes, rule.confidence, json);
    distances.push_back(std::move(json));
  }
  const std::string up =
      rules.up_is_given ? "up: " + OrderedJson(numbers_of(rules.up)).dump() + "\n" : "";
  return "# The rules of the run (--zones), without their receivers.\n" + up +
         yaml_list("zones", zones) + yaml_list("points", points) +
         yaml_list("distances", distances);
}

void check_rule_classes(const WarningRules& rules,
                        const std::optional<std::vector<std::string>>& known,
                        const std::string& where) {
  for (const Zone& zone : rules.zones)
    check_classes_of(zone.classes, known, fmt::format("{}, zone '{}'", where, zone.name));
  for (const DistanceRule& rule : rules.distances)
    check_classes_of(rule.classes, known, fmt::format("{}, distance '{}'", where, rule.name));
}

nlohmann::json zones_message(const WarningRules& rules) {
  nlohmann::json zones = nlohmann::json::array();
  for (const Zone& zone : rules.zones) {
    nlohmann::json polygon = nlohmann::json::array();
    for (const Eigen::Vector3d& corner : zone.polygon) polygon.push_back(numbers_of(corner));
    zones.push_back({{"name", zone.name},
                     {"polygon", polygon},
                     {"height", {zone.low, zone.high}},
                     {"up", numbers_of(zone.up)}});
  }
  return {{"type", "zones"}, {"zones", zones}};
}

}  // namespace stillmap
