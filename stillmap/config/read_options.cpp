// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/nearest_name.hpp"
#include "stillmap/config/option_values.hpp"
#include "stillmap/config/preset_files.hpp"

#include <algorithm>
#include <set>
#include <sstream>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

namespace stillmap {
namespace {

constexpr const char* kPresetKey = "preset";
constexpr const char* kOptionsFix = "docs/options.md and `stillmap options` list all options";
constexpr char kListBegin = '[';

std::vector<std::string> paths() {
  std::vector<std::string> all;
  const Options options;
  visit_options(options, [&](const OptionInfo& info, const auto&) { all.push_back(info.path); });
  return all;
}

std::string group_of(const std::string& path) { return path.substr(0, path.find('.')); }
std::string name_of(const std::string& path) { return path.substr(path.find('.') + 1); }

/// Returns the names in a group; empty if there is no such group.
std::vector<std::string> names_in(const std::string& group) {
  std::vector<std::string> names;
  for (const std::string& path : paths()) {
    if (group_of(path) == group) names.push_back(name_of(path));
  }
  return names;
}

std::vector<std::string> groups() {
  std::vector<std::string> all;
  for (const std::string& path : paths()) {
    if (all.empty() || all.back() != group_of(path)) all.push_back(group_of(path));
  }
  return all;
}

/// Suggests a known option for an unknown one: the same name in another group, otherwise the
/// nearest name in its group, otherwise the nearest group.
std::string advice(const std::string& path) {
  const std::string group = group_of(path);
  const std::string name = path.substr(path.rfind('.') + 1);
  std::vector<std::string> namesakes = paths();
  std::erase_if(namesakes, [&](const std::string& known) { return name_of(known) != name; });
  if (!namesakes.empty()) return "did you mean '" + nearest_name(path, namesakes) + "'?";
  const auto siblings = names_in(group);
  return siblings.empty() ? suggestion(group, groups()) : suggestion(name, siblings);
}

/// Where options were read, for messages.
struct Source {
  std::string name;       ///< Name of a file, or an assignment.
  bool has_lines = true;  ///< Whether it is a file, so that lines can be named.
};

/// Returns the place of a value: "file.yaml:12", or the assignment.
std::string place(const YAML::Node& node, const Source& source) {
  const int line = node.Mark().line;
  return !source.has_lines || line < 0 ? source.name : fmt::format("{}:{}", source.name, line + 1);
}

template <typename T>
T converted(const YAML::Node& node, const std::string& path, const Source& source) {
  try {
    if constexpr (is_list<T>) {
      if (node.IsNull()) return {};
      if (!node.IsSequence()) return {node.as<std::string>()};
    }
    if constexpr (is_text<T>) {
      if (node.IsNull()) return {};
    }
    if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>) {
      // YAML reads 010 as octal and 0x10 as hexadecimal.
      const std::string& text = node.Scalar();
      const std::size_t first = text.find_first_of("0123456789");
      if (first != std::string::npos && text[first] == '0' && text.size() > first + 1)
        throw YAML::Exception(node.Mark(), "not decimal");
    }
    return node.as<T>();
  } catch (const YAML::Exception&) {
    throw Error(fmt::format("option {}: expected {}, found '{}'", path, type_name<T>(),
                            node.IsScalar() ? node.Scalar() : std::string("a list")),
                place(node, source), kOptionsFix);
  }
}

/// Assigns a value to the option at `path`. Throws Error if there is no such option, and for a
/// value that it refuses.
void assign(const std::string& path, const YAML::Node& value, const Source& source,
            Options& options) {
  bool known = false;
  visit_options(options, [&](const OptionInfo& info, auto& member) {
    if (info.path != path) return;
    known = true;
    auto read = converted<std::decay_t<decltype(member)>>(value, path, source);
    if (const auto problem = range_problem(info, read)) {
      throw Error(*problem, place(value, source), range_advice(info));
    }
    member = std::move(read);
  });
  if (!known) {
    throw Error("there is no option '" + path + "'", place(value, source), advice(path));
  }
}

/// Throws Error for a key that a map of a file holds twice: YAML would use either of the values.
void require_unique_keys(const YAML::Node& map, const Source& source) {
  std::set<std::string> keys;
  for (const auto& entry : map) {
    const auto key = entry.first.as<std::string>("");
    if (keys.insert(key).second) continue;
    throw Error("the key '" + key + "' is given twice", place(entry.first, source),
                "keep only the valid one");
  }
}

/// Throws Error for a key of the top level that is no group.
[[noreturn]] void refuse_group(const YAML::Node& key, const Source& source) {
  const auto group = key.as<std::string>("");
  const auto known = paths();
  if (std::find(known.begin(), known.end(), group) != known.end()) {
    throw Error("option " + group + " is outside its group", place(key, source),
                fmt::format("write '{}:' and in the next line '  {}: VALUE'", group_of(group),
                            name_of(group)));
  }
  throw Error("there is no option '" + group + "'", place(key, source), advice(group));
}

[[noreturn]] void refuse_value_for_group(const std::string& group, const std::string& where) {
  throw Error(group + " is a group of options and takes no value itself", where,
              "its options are " + fmt::format("{}", fmt::join(names_in(group), ", ")));
}

/// Returns whether an option of former versions has the value that is now fixed. The run folders of
/// these versions contain all options.
bool is_of_former_version(const std::string& path, const YAML::Node& value) {
  if (!value.IsScalar()) return false;
  return (path == "network.nms_iou" && value.Scalar() == "0.7") ||
         (path == "tracking.odometry_fallback" && value.Scalar() == "true") ||
         (path == "motion.box_flow_memory" && value.Scalar() == "10") ||
         (path == "dense.max_sigma" && value.Scalar() == "0.025824");
}

/// Assigns all options of one group of a file.
/// @returns their paths
std::vector<std::string> assign_group(const std::string& group, const YAML::Node& node,
                                      const Source& source, Options& options) {
  std::vector<std::string> assigned;
  if (node.IsNull()) return assigned;
  if (!node.IsMap()) refuse_value_for_group(group, place(node, source));
  require_unique_keys(node, source);
  for (const auto& entry : node) {
    const std::string path = group + "." + entry.first.as<std::string>();
    if (is_of_former_version(path, entry.second)) continue;
    assigned.push_back(path);
    assign(assigned.back(), entry.second, source, options);
  }
  return assigned;
}

/// Assigns all options of a file but its preset.
/// @returns whether the file sets every option there is
bool assign_file(const YAML::Node& file, const Source& source, Options& options) {
  std::set<std::string> assigned;
  require_unique_keys(file, source);
  for (const auto& entry : file) {
    const auto group = entry.first.as<std::string>("");
    if (group == kPresetKey) continue;
    if (names_in(group).empty()) refuse_group(entry.first, source);
    const auto paths = assign_group(group, entry.second, source, options);
    assigned.insert(paths.begin(), paths.end());
  }
  return assigned.size() == paths().size();
}

YAML::Node parsed(const std::string& text, const Source& source) {
  YAML::Node file;
  try {
    file = YAML::Load(text);
  } catch (const YAML::Exception& e) {
    throw Error("is not YAML: " + e.msg, fmt::format("{}:{}", source.name, e.mark.line + 1),
                kOptionsFix);
  }
  if (!file.IsNull() && !file.IsMap()) {
    throw Error("holds no groups of options", source.name, suggestion("", groups()));
  }
  return file;
}

/// Returns the preset that a file of options names; empty if it names none.
std::string preset_named_in(const YAML::Node& file, const Source& source) {
  const YAML::Node named = file.IsMap() ? file[kPresetKey] : YAML::Node();
  return named.IsDefined() && !named.IsNull() ? converted<std::string>(named, kPresetKey, source)
                                              : "";
}

/// Assigns the options of the preset that this one is based on, then its own.
/// @param derived  presets based on this one, to detect cycles
void assign_preset(const std::string& name, std::vector<std::string> derived, Options& options) {
  const PresetFile preset = find_preset_file(name);
  const Source source{preset.source};
  const YAML::Node file = parsed(preset.text, source);
  const std::string base = preset_named_in(file, source);
  derived.push_back(name);
  if (std::find(derived.begin(), derived.end(), base) != derived.end()) {
    throw Error("is based on itself", place(file[kPresetKey], source),
                "name another preset, or remove the line");
  }
  if (!base.empty()) assign_preset(base, std::move(derived), options);
  assign_file(file, source, options);
}

bool is_list_option(const std::string& path) {
  bool list = false;
  const Options options;
  visit_options(options, [&](const OptionInfo& info, const auto& member) {
    if (info.path == path) list = is_list<std::decay_t<decltype(member)>>;
  });
  return list;
}

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t"), last = text.find_last_not_of(" \t");
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

YAML::Node list_node(const std::string& text, const Source& source) {
  if (trimmed(text).starts_with(kListBegin)) {
    try {
      return YAML::Load(text);
    } catch (const YAML::Exception& e) {
      throw Error("is not a YAML list: " + e.msg, source.name, "write [a, b] or a,b");
    }
  }
  YAML::Node items(YAML::NodeType::Sequence);
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) items.push_back(trimmed(part));
  return items;
}

void require(bool holds, const std::string& problem) {
  if (!holds) throw Error(problem, "", kOptionsFix);
}

}  // namespace

Options read_options(const std::string& preset, const std::filesystem::path& file) {
  const Source source{file.string()};
  const YAML::Node overrides = file.empty() ? YAML::Node() : parsed(read_file(file), source);
  const std::string named = preset_named_in(overrides, source);
  if (!preset.empty() && !named.empty() && preset != named) {
    throw Error(fmt::format("is based on preset {}, but preset {} was chosen", named, preset),
                source.name,
                "remove the line 'preset' from the file, or the choice of another one");
  }
  const std::string name = !preset.empty() ? preset : !named.empty() ? named : Options().preset();
  Options options;
  if (!assign_file(overrides, source, options)) {  // a complete file needs no preset
    options = Options();
    assign_preset(name, {}, options);
    assign_file(overrides, source, options);
  }
  options.preset_ = name;
  check_options(options);
  return options;
}

void set_option(const std::string& assignment, Options& options) {
  const Source source{"option '" + assignment + "'", /*has_lines=*/false};
  const auto equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw Error("is not of the form group.name=value", source.name,
                "write, for example, --set features.keypoints=1000");
  }
  const std::string path = assignment.substr(0, equals), text = assignment.substr(equals + 1);
  if (path == kPresetKey) {
    throw Error("a preset is no single option", source.name,
                "choose it with --preset NAME, or in read_options()");
  }
  if (!names_in(path).empty()) refuse_value_for_group(path, source.name);
  assign(path, is_list_option(path) ? list_node(text, source) : YAML::Node(text), source, options);
}

void check_options(const Options& options) {
  visit_options(options, [](const OptionInfo& info, const auto& member) {
    if (const auto problem = range_problem(info, member)) {
      throw Error(*problem, "", range_advice(info));
    }
  });
  require(options.outputs.planner_lowest < options.outputs.planner_highest,
          "outputs.planner_lowest must be less than outputs.planner_highest");
  require(options.schedule.insert_delay <= options.schedule.refine_delay,
          "schedule.insert_delay must be at most schedule.refine_delay");
}

}  // namespace stillmap
