// SPDX-License-Identifier: Apache-2.0
#include "stillmap/config/write_options.hpp"

#include "stillmap/config/option_values.hpp"

#include <algorithm>
#include <map>
#include <sstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

constexpr std::size_t kCommentWidth = 96;  // characters

/// An option, and its default as text.
struct OptionLine {
  OptionInfo info;
  std::string type, value;
};

std::vector<OptionLine> option_lines(const Options& options) {
  std::vector<OptionLine> lines;
  visit_options(options, [&](const OptionInfo& info, const auto& member) {
    lines.push_back({info, type_name<std::decay_t<decltype(member)>>(), value_text(member)});
  });
  return lines;
}

std::string group_of(const OptionInfo& info) { return info.path.substr(0, info.path.find('.')); }
std::string name_of(const OptionInfo& info) { return info.path.substr(info.path.find('.') + 1); }

/// A comment of an indented YAML map, broken into lines.
std::string comment(const std::string& text) {
  constexpr const char* kSign = "  #";
  std::string result, line = kSign;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (line.size() + 1 + word.size() > kCommentWidth) {
      result += line + "\n";
      line = kSign;
    }
    line += " " + word;
  }
  return result + line + "\n";
}

/// Unit, range and default of an option: "Unit: m. Range: 0 to 100. Default: 0.1."
std::string limits_text(const OptionLine& line) {
  const std::string range = range_text(line.info);
  std::string text;
  if (!line.info.unit.empty()) text += "Unit: " + line.info.unit + ". ";
  if (!range.empty()) text += (line.info.words.empty() ? "Range: " : "Words: ") + range + ". ";
  return text + "Default: " + line.value + ".";
}

std::string table_row(const OptionLine& line) {
  return fmt::format("| `{}` | {} | {} | {} | `{}` | {} |\n", name_of(line.info), line.type,
                     line.info.unit, range_text(line.info), line.value, line.info.sentence);
}

}  // namespace

std::string options_yaml(const Options& options) {
  const auto defaults = option_lines(Options());
  const auto values = option_lines(options);
  std::string text = std::string(kOptionsFileTitle) + "\n";
  text += "preset: " + value_text(options.preset()) + "\n";
  std::string group;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (group_of(values[i].info) != group) {
      group = group_of(values[i].info);
      text += "\n" + group + ":\n";
    }
    text += comment(values[i].info.sentence + " " + limits_text(defaults[i]));
    text += "  " + name_of(values[i].info) + ": " + values[i].value + "\n";
  }
  return text;
}

nlohmann::json options_json(const Options& options) {
  nlohmann::json json = {{"preset", options.preset()}};
  visit_options(options, [&](const OptionInfo& info, const auto& member) {
    json[group_of(info)][name_of(info)] = member;
  });
  return json;
}

std::string options_markdown() {
  std::string text =
      "# Options\n\n"
      "<!-- Made by `stillmap options --markdown`; do not edit. -->\n\n"
      "Each option is `group.name`: in a YAML file (`stillmap run --config FILE`) as a nested map, "
      "on the command line as\n`--set group.name=value`; a list is written `[a, b]` or `a,b`. "
      "`stillmap run --dump-config FILE` writes all\noptions in force with these "
      "explanations. Later sources override earlier ones: defaults, preset (`--preset NAME` or\n"
      "`--preset FILE`, or the key `preset` of the YAML file), YAML file, named flags such as "
      "`--model`, `--set`.\nA value outside its range, an unknown name and a repeated key are "
      "errors.\n\nLists of classes take the class names of the network; those of COCO and "
      "`unknown`, the class of mask folders, are\nalways known.\n";
  std::string group;
  for (const OptionLine& line : option_lines(Options())) {
    if (group_of(line.info) != group) {
      group = group_of(line.info);
      text += "\n## " + group +
              "\n\n| option | type | unit | range or words | default | meaning |\n"
              "|---|---|---|---|---|---|\n";
    }
    text += table_row(line);
  }
  return text;
}

std::string presets_text() {
  const auto all = presets();
  std::size_t width = 0;
  for (const Preset& preset : all) width = std::max(width, preset.name.size());
  std::string lines;
  for (const Preset& preset : all) {
    lines += fmt::format("  {:<{}}  {}\n", preset.name, width, preset.description);
  }
  return lines;
}

}  // namespace stillmap
