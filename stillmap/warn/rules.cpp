// SPDX-License-Identifier: Apache-2.0
#include "stillmap/warn/rules.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/nearest_name.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <nlohmann/json.hpp>
#include <yaml-cpp/yaml.h>

namespace stillmap {
namespace {

/// A map of the file, with the name for messages.
class Section {
 public:
  Section(const YAML::Node& node, const std::string& where, const std::vector<std::string>& keys)
      : node_(node), where_(where) {
    if (!node.IsMap()) throw Error("is no map of keys and values", where, "see docs/view.md");
    for (const auto& entry : node) {
      const auto key = entry.first.as<std::string>("");
      if (std::find(keys.begin(), keys.end(), key) == keys.end())
        throw Error("there is no key '" + key + "'", where, suggestion(key, keys));
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

  double number_or(const std::string& key, double otherwise, double least) const {
    const double number = value_or(key, otherwise);
    if (!(number >= least) || !std::isfinite(number)) fail(key, "is out of range");
    return number;
  }
  Eigen::Vector3d vector(const std::string& key) const { return vector_of(node_[key], key); }
  Eigen::Vector3d vector_of(const YAML::Node& node, const std::string& key) const {
    std::vector<double> values;
    const bool read = node.IsDefined() && YAML::convert<std::vector<double>>::decode(node, values);
    if (!read || values.size() != 3 || !Eigen::Vector3d(values.data()).allFinite())
      fail(key, "is no list of three numbers");
    return Eigen::Vector3d(values.data());
  }

  [[noreturn]] void fail(const std::string& key, const std::string& what) const {
    throw Error("'" + key + "' " + what, where_, "see the example in docs/view.md");
  }

 private:
  YAML::Node node_;
  std::string where_;
};

Zone zone_of(const YAML::Node& node, const std::string& where, const Eigen::Vector3d& up) {
  const Section section(node, where, {"name", "polygon", "height", "classes"});
  Zone zone{.name = section.value<std::string>("name"), .polygon = {}, .up = up, .classes = {}};
  for (const YAML::Node& corner : section.list("polygon"))
    zone.polygon.push_back(section.vector_of(corner, "polygon"));
  if (zone.polygon.size() < 3) section.fail("polygon", "has fewer than three corners");
  const auto heights = section.value_or<std::vector<double>>("height", {zone.low, zone.high});
  if (heights.size() != 2 || !(heights[0] < heights[1]))
    section.fail("height", "is no list of two ascending numbers");
  zone.low = heights[0];
  zone.high = heights[1];
  zone.classes = section.value_or("classes", zone.classes);
  return zone;
}

DistanceRule distance_of(const YAML::Node& node, const std::string& where,
                         const NamedPoints& points) {
  const Section section(node, where, {"to", "nearer", "within", "level", "classes"});
  DistanceRule rule;
  rule.name = section.value<std::string>("to");
  if (!points.contains(rule.name)) section.fail("to", "names no point; add it to 'points'");
  rule.offset = points.at(rule.name);
  if (!section.has("nearer")) section.fail("nearer", "is missing");
  rule.nearer = section.number_or("nearer", rule.nearer, 0);
  rule.within = section.number_or("within", rule.within, 0);
  rule.level = section.value_or("level", rule.level);
  rule.classes = section.value_or("classes", rule.classes);
  return rule;
}

NamedPoints points_of(const Section& file, const std::string& where) {
  NamedPoints points{{"camera", Eigen::Vector3d::Zero()}};
  for (const YAML::Node& node : file.list("points")) {
    const Section point(node, where + ", points", {"name", "offset"});
    const auto name = point.value<std::string>("name");
    if (!points.emplace(name, point.vector("offset")).second)
      point.fail("name", "is used twice: " + name);
  }
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

WarningRules rules_of(const YAML::Node& file, const NamedPoints& points, const std::string& where) {
  const Section section(file, where, {"up", "zones", "points", "distances", "send"});
  WarningRules rules;
  rules.up_is_given = section.has("up");
  if (rules.up_is_given) rules.up = section.vector("up");
  if (rules.up.norm() < 1e-6) section.fail("up", "is zero");
  rules.up.normalize();
  std::set<std::string> names;
  for (const YAML::Node& node : section.list("zones")) {
    rules.zones.push_back(zone_of(node, where + ", zones", rules.up));
    if (!names.insert(rules.zones.back().name).second)
      section.fail("zones", "has two zones named " + rules.zones.back().name);
  }
  NamedPoints named = points;
  named.merge(points_of(section, where));
  for (const YAML::Node& node : section.list("distances"))
    rules.distances.push_back(distance_of(node, where + ", distances", named));
  rules.receivers = receivers_of(section, where);
  if (rules.zones.empty() && rules.distances.empty())
    throw Error("has no zones and no distances", where, "see the example in docs/view.md");
  return rules;
}

}  // namespace

WarningRules read_warning_rules(const std::filesystem::path& file, const NamedPoints& points) {
  const std::string text = read_file(file);
  try {
    return rules_of(YAML::Load(text), points, file.string());
  } catch (const YAML::Exception& e) {
    throw Error(std::string("is not valid: ") + e.what(), file.string(),
                "see the example in docs/view.md");
  }
}

nlohmann::json zones_message(const WarningRules& rules) {
  const auto array = [](const Eigen::Vector3d& v) {
    return nlohmann::json::array({v.x(), v.y(), v.z()});
  };
  nlohmann::json zones = nlohmann::json::array();
  for (const Zone& zone : rules.zones) {
    nlohmann::json polygon = nlohmann::json::array();
    for (const Eigen::Vector3d& corner : zone.polygon) polygon.push_back(array(corner));
    zones.push_back({{"name", zone.name},
                     {"polygon", polygon},
                     {"height", {zone.low, zone.high}},
                     {"up", array(zone.up)}});
  }
  return {{"type", "zones"}, {"zones", zones}};
}

}  // namespace stillmap
