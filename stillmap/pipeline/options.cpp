// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/options.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/nearest_name.hpp"

#include <sstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <yaml-cpp/yaml.h>

namespace stillmap {
namespace {

template <typename T>
constexpr bool is_list = std::is_same_v<T, std::vector<std::string>>;

/// Where a key was read: "file.yaml:12" or "--set".
std::string place(const YAML::Node& node, const std::string& source) {
  const int line = node.Mark().line;
  return source == "--set" || line < 0 ? source : fmt::format("{}:{}", source, line + 1);
}

template <typename Options>
std::vector<std::string> field_names(const Options& options) {
  std::vector<std::string> names;
  for_each_field(options, [&](const char* name, const auto&) { names.emplace_back(name); });
  return names;
}

template <typename T>
void assign(const YAML::Node& node, const std::string& key, const std::string& source, T& value) {
  try {
    if constexpr (is_list<T>) {
      value = node.IsSequence() ? node.as<T>() : T{node.as<std::string>()};
    } else {
      value = node.as<T>();
    }
  } catch (const YAML::Exception&) {
    constexpr const char* kind = std::is_same_v<T, bool>       ? "true or false"
                                 : std::is_integral_v<T>       ? "a whole number"
                                 : std::is_floating_point_v<T> ? "a number"
                                 : is_list<T>                  ? "a list of names"
                                                               : "a text";
    throw Error(fmt::format("option {} wants {}", key, kind), place(node, source),
                "see --dump-config for the options and their present values");
  }
}

template <typename Options>
void override_fields(const YAML::Node& node, const std::string& prefix, const std::string& source,
                     Options& options);

/// Sets the one field called `name`; false if there is none.
template <typename Options>
bool override_field(const YAML::Node& node, const std::string& name, const std::string& key,
                    const std::string& source, Options& options) {
  bool known = false;
  for_each_field(options, [&](const char* field, auto& member) {
    if (name != field) return;
    known = true;
    if constexpr (HasFields<std::decay_t<decltype(member)>>) {
      override_fields(node, key + ".", source, member);
    } else {
      assign(node, key, source, member);
    }
  });
  return known;
}

template <typename Options>
void override_fields(const YAML::Node& node, const std::string& prefix, const std::string& source,
                     Options& options) {
  if (node.IsNull()) return;
  if (!node.IsMap()) {
    throw Error(fmt::format("{} holds further options, not a value",
                            prefix.empty() ? "the file" : prefix.substr(0, prefix.size() - 1)),
                place(node, source), suggestion("", field_names(options)));
  }
  for (const auto& entry : node) {
    const auto name = entry.first.as<std::string>();
    if (!override_field(entry.second, name, prefix + name, source, options)) {
      throw Error(fmt::format("there is no option '{}{}'", prefix, name),
                  place(entry.first, source), suggestion(name, field_names(options)));
    }
  }
}

/// Wraps "a.b.c" and a value into nested maps, so that an assignment is read like a file.
YAML::Node nested(const std::string& key, const YAML::Node& value) {
  const auto dot = key.find('.');
  YAML::Node node;
  node[key.substr(0, dot)] = dot == std::string::npos ? value : nested(key.substr(dot + 1), value);
  return node;
}

YAML::Node parse_value(const std::string& text) {
  if (text.find(',') == std::string::npos) return YAML::Load(text);
  YAML::Node list;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) list.push_back(part);
  return list;
}

template <typename Options>
nlohmann::json to_ordered_json(const Options& options) {
  nlohmann::json json = nlohmann::json::object();
  for_each_field(options, [&](const char* name, const auto& member) {
    if constexpr (HasFields<std::decay_t<decltype(member)>>) {
      json[name] = to_ordered_json(member);
    } else {
      json[name] = member;
    }
  });
  return json;
}

template <typename Options>
void emit(const Options& options, YAML::Emitter& out) {
  out << YAML::BeginMap;
  for_each_field(options, [&](const char* name, const auto& member) {
    out << YAML::Key << name << YAML::Value;
    using Member = std::decay_t<decltype(member)>;
    if constexpr (HasFields<Member>) {
      emit(member, out);
    } else if constexpr (is_list<Member>) {
      out << YAML::Flow << member;
    } else if constexpr (std::is_floating_point_v<Member>) {
      out << fmt::format("{}", member);  // the shortest text that reads back the same
    } else {
      out << member;
    }
  });
  out << YAML::EndMap;
}

void require(bool fine, const std::string& key, const std::string& wanted) {
  if (!fine) throw Error(fmt::format("option {} must be {}", key, wanted), "", "see --dump-config");
}

}  // namespace

void load_options(const std::filesystem::path& file, SlamOptions& options) {
  YAML::Node node;
  try {
    node = YAML::LoadFile(file.string());
  } catch (const YAML::BadFile&) {
    throw Error("cannot be read", file.string(),
                "check that the file exists; --dump-config writes one");
  } catch (const YAML::Exception& e) {
    throw Error(std::string("is not YAML: ") + e.what(), file.string(),
                "--dump-config writes one that is");
  }
  override_fields(node, "", file.string(), options);
  check_options(options);
}

void set_option(const std::string& assignment, SlamOptions& options) {
  const auto equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw Error("'" + assignment + "' is no assignment", "--set", "write --set room.option=value");
  }
  YAML::Node value;
  try {
    value = parse_value(assignment.substr(equals + 1));
  } catch (const YAML::Exception&) {
    throw Error("'" + assignment + "' has no readable value", "--set",
                "write --set room.option=value");
  }
  override_fields(nested(assignment.substr(0, equals), value), "", "--set", options);
  check_options(options);
}

void check_options(const SlamOptions& o) {
  require(o.schedule.mode == "lockstep" || o.schedule.mode == "realtime", "schedule.mode",
          "'lockstep' or 'realtime'");
  require(o.schedule.insert_delay >= 1, "schedule.insert_delay", "at least 1");
  require(o.schedule.refine_delay >= o.schedule.insert_delay, "schedule.refine_delay",
          "at least schedule.insert_delay");
  require(o.schedule.relocalize_delay >= 1, "schedule.relocalize_delay", "at least 1");
  require(o.schedule.global_delay >= 1, "schedule.global_delay", "at least 1");
  require(o.schedule.segment_every >= 1, "schedule.segment_every", "at least 1");
  require(o.schedule.mask_delay >= 0, "schedule.mask_delay", "0 or more");
  require(o.orb.keypoints >= 50, "orb.keypoints", "at least 50");
  require(o.mapper.adjustment.max_free >= 1, "mapper.adjustment.max_free", "at least 1");
  require(o.movers.detection.trim >= 0 && o.movers.detection.trim < 0.5, "movers.detection.trim",
          "from 0 to below 0.5");
  require(o.movers.tracking.births >= 1, "movers.tracking.births", "at least 1");
  require(o.movers.tracking.position_noise > 0 && o.movers.tracking.cut_off_noise > 0,
          "movers.tracking.position_noise (and cut_off_noise)", "more than 0");
  check_rule(o.mapper.repeated);
  find_preset(o.motion.preset);
}

std::string options_yaml(const SlamOptions& options) {
  YAML::Emitter out;
  emit(options, out);
  return std::string(out.c_str()) + "\n";
}

nlohmann::json options_json(const SlamOptions& options) { return to_ordered_json(options); }

}  // namespace stillmap
