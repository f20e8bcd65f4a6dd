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
constexpr const char* kSetFlag = "--set";

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

/// Advice for an unknown option: the same name in another group, or the nearest name.
std::string advice(const std::string& path) {
  const std::string group = group_of(path);
  const std::string name = path.substr(path.rfind('.') + 1);
  for (const std::string& known : paths()) {
    if (name_of(known) == name) return "did you mean '" + known + "'?";
  }
  const auto siblings = names_in(group);
  return siblings.empty() ? suggestion(group, groups()) : suggestion(name, siblings);
}

/// Where a value was read: "file.yaml:12" or "--set".
std::string place(const YAML::Node& node, const std::string& source) {
  const int line = node.Mark().line;
  return source == kSetFlag || line < 0 ? source : fmt::format("{}:{}", source, line + 1);
}

template <typename T>
T converted(const YAML::Node& node, const std::string& path, const std::string& source) {
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
    throw Error(fmt::format("option {} takes a {} as value, not '{}'", path, type_name<T>(),
                            node.IsScalar() ? node.Scalar() : std::string("a list")),
                place(node, source), "see --dump-config for the options and their values");
  }
}

/// Assigns a value to the option at `path`. Throws Error if there is no such option, and for a
/// value that it refuses.
void assign(const std::string& path, const YAML::Node& value, const std::string& source,
            Options& options) {
  bool known = false;
  visit_options(options, [&](const OptionInfo& info, auto& member) {
    if (info.path != path) return;
    known = true;
    auto read = converted<std::decay_t<decltype(member)>>(value, path, source);
    if (const auto problem = range_problem(info, read)) {
      throw Error(*problem, place(value, source), "give a value in this range");
    }
    member = std::move(read);
  });
  if (!known) {
    throw Error("there is no option '" + path + "'", place(value, source), advice(path));
  }
}

[[noreturn]] void refuse_value_for_group(const std::string& group, const std::string& where) {
  throw Error(group + " is a group of options and takes no value itself", where,
              "its options are " + fmt::format("{}", fmt::join(names_in(group), ", ")));
}

/// Assigns all options of one group of a file.
/// @returns their paths
std::vector<std::string> assign_group(const std::string& group, const YAML::Node& node,
                                      const std::string& source, Options& options) {
  std::vector<std::string> assigned;
  if (node.IsNull()) return assigned;
  if (!node.IsMap()) refuse_value_for_group(group, place(node, source));
  for (const auto& entry : node) {
    assigned.push_back(group + "." + entry.first.as<std::string>());
    assign(assigned.back(), entry.second, source, options);
  }
  return assigned;
}

/// Assigns all options of a file but its preset.
/// @returns whether the file sets every option there is
bool assign_file(const YAML::Node& file, const std::string& source, Options& options) {
  std::set<std::string> assigned;
  for (const auto& entry : file) {
    const auto group = entry.first.as<std::string>();
    if (group == kPresetKey) continue;
    if (names_in(group).empty()) {
      throw Error("there is no option '" + group + "'", place(entry.first, source), advice(group));
    }
    const auto paths = assign_group(group, entry.second, source, options);
    assigned.insert(paths.begin(), paths.end());
  }
  return assigned.size() == paths().size();
}

YAML::Node parsed(const std::string& text, const std::string& source) {
  YAML::Node file;
  try {
    file = YAML::Load(text);
  } catch (const YAML::Exception& e) {
    throw Error(std::string("is not YAML: ") + e.what(), source,
                "compare it with the output of --dump-config");
  }
  if (!file.IsNull() && !file.IsMap()) {
    throw Error("holds no groups of options", source, suggestion("", groups()));
  }
  return file;
}

Options options_of(const PresetFile& preset, const std::string& name) {
  Options options;
  options.preset = name;
  const YAML::Node file = parsed(preset.text, preset.source);
  if (file[kPresetKey]) {
    throw Error("a preset cannot be based on another one", place(file[kPresetKey], preset.source),
                "list all options that differ from the defaults");
  }
  assign_file(file, preset.source, options);
  return options;
}

/// Returns the preset that a file of options names; empty if it names none.
std::string preset_named_in(const YAML::Node& file, const std::string& source) {
  const YAML::Node named = file.IsMap() ? file[kPresetKey] : YAML::Node();
  return named.IsDefined() && !named.IsNull() ? converted<std::string>(named, kPresetKey, source)
                                              : "";
}

/// The value of an assignment on the command line.
YAML::Node value_node(const std::string& path, const std::string& text) {
  bool list = false;
  const Options options;
  visit_options(options, [&](const OptionInfo& info, const auto& member) {
    if (info.path == path) list = is_list<std::decay_t<decltype(member)>>;
  });
  if (!list) return YAML::Node(text);
  YAML::Node items(YAML::NodeType::Sequence);
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) items.push_back(part);
  return items;
}

void require(bool holds, const std::string& problem) {
  if (!holds) throw Error(problem, "", "see --dump-config for the options and their values");
}

}  // namespace

Options read_options(const std::string& preset, const std::filesystem::path& file) {
  const std::string source = file.string();
  const YAML::Node overrides = file.empty() ? YAML::Node() : parsed(read_file(file), source);
  const std::string named = preset_named_in(overrides, source);
  if (!preset.empty() && !named.empty() && preset != named) {
    throw Error(fmt::format("is based on preset {}, but preset {} was chosen", named, preset),
                source, "remove the line 'preset' from the file, or the choice of another one");
  }
  const std::string name = !preset.empty() ? preset : !named.empty() ? named : Options().preset;
  Options options;
  options.preset = name;
  if (!assign_file(overrides, source, options)) {  // a complete file needs no preset
    options = options_of(find_preset_file(name), name);
    assign_file(overrides, source, options);
  }
  check_options(options);
  return options;
}

void set_option(const std::string& assignment, Options& options) {
  const auto equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw Error("'" + assignment + "' is no assignment", kSetFlag,
                "write --set group.option=value");
  }
  const std::string path = assignment.substr(0, equals);
  if (path == kPresetKey) {
    throw Error("a preset is no single option", kSetFlag, "choose it with --preset NAME");
  }
  if (!names_in(path).empty()) refuse_value_for_group(path, kSetFlag);
  assign(path, value_node(path, assignment.substr(equals + 1)), kSetFlag, options);
}

void check_options(const Options& options) {
  visit_options(options, [](const OptionInfo& info, const auto& member) {
    if (const auto problem = range_problem(info, member)) {
      throw Error(*problem, "", "give a value in this range");
    }
  });
  require(options.outputs.planner_lowest < options.outputs.planner_highest,
          "outputs.planner_lowest must be less than outputs.planner_highest");
  require(options.schedule.insert_delay <= options.schedule.refine_delay,
          "schedule.insert_delay must be at most schedule.refine_delay");
}

}  // namespace stillmap
