// SPDX-License-Identifier: Apache-2.0
#include "command_tree.hpp"

#include "stillmap/base/nearest_name.hpp"

#include <algorithm>
#include <map>
#include <regex>
#include <sstream>
#include <stdexcept>

namespace stillmap {
namespace {

constexpr const char* kOrFile = " or FILE";

void append(const std::string& path, const CLI::App& app, std::vector<CommandNode>& nodes) {
  nodes.push_back({path, &app});
  for (const CLI::App* child : visible_subcommands(app))
    append(path + " " + child->get_name(), *child, nodes);
}

/// Returns the names with two dashes of the options that a command lists.
std::vector<std::string> long_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : named_options(command)) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

/// Returns the subcommand of this name, hidden or not; null if there is none.
const CLI::App* find_subcommand(const CLI::App& command, const std::string& name) {
  const auto all = command.get_subcommands([](const CLI::App*) { return true; });
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&](const CLI::App* app) { return app->get_name() == name; });
  return found == all.end() ? nullptr : *found;
}

/// Names of the values that options and arguments take, by their names.
const std::map<std::string, std::string> kValueTypes{{"aligned-like", "FILE"},
                                                     {"associations", "FILE"},
                                                     {"baseline", "NAME=DIR"},
                                                     {"camera", "NAME or FILE"},
                                                     {"cloud", "FILE"},
                                                     {"config", "FILE"},
                                                     {"covariances", "FILE"},
                                                     {"data", "DIR"},
                                                     {"dump-config", "FILE"},
                                                     {"estimate", "FILE"},
                                                     {"file", "FILE"},
                                                     {"folder", "DIR"},
                                                     {"image", "FILE"},
                                                     {"json", "FILE"},
                                                     {"labels", "FILE"},
                                                     {"list", "FILE"},
                                                     {"load-map", "FILE"},
                                                     {"masks", "DIR"},
                                                     {"merge", "FILE"},
                                                     {"model", "FILE"},
                                                     {"movers", "FILE"},
                                                     {"name", "NAME"},
                                                     {"out", "DIR"},
                                                     {"picture", "FILE"},
                                                     {"points", "FILE"},
                                                     {"recording", "DIR"},
                                                     {"recordings", "DIR or FILE"},
                                                     {"run", "DIR or FILE"},
                                                     {"runs", "[NAME=]PATH"},
                                                     {"save-map", "FILE"},
                                                     {"sequence", "DIR or FILE"},
                                                     {"sequences", "NAME"},
                                                     {"set", "NAME=VALUE"},
                                                     {"source", "DIR or FILE"},
                                                     {"speeds", "DIR"},
                                                     {"surface", "FILE"},
                                                     {"topics", "COLOR,DEPTH"},
                                                     {"truth", "FILE"},
                                                     {"truth-frame", "{bonn,camera} or FILE"},
                                                     {"variant", "NAME=PRESET"},
                                                     {"verdicts", "FILE"},
                                                     {"view-address", "ADDRESS"},
                                                     {"zones", "FILE"}};

constexpr const char* kText = "TEXT";  // CLI11's name of a std::string

}  // namespace

void name_value_types(CLI::App& program) {
  for (CLI::Option* option : program.get_options([](const CLI::Option*) { return true; })) {
    if (option->get_type_name() != kText || option->get_group().empty()) continue;
    const auto& names = option->get_lnames();
    const auto found = kValueTypes.find(names.empty() ? option->get_name(true) : names.front());
    if (found == kValueTypes.end())
      throw std::logic_error("no type of value for " + option->get_name(true));
    option->type_name(found->second);
  }
  for (CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; }))
    name_value_types(*command);
}

std::vector<CommandNode> visible_commands(const CLI::App& program) {
  std::vector<CommandNode> nodes;
  append("stillmap", program, nodes);
  return nodes;
}

std::vector<const CLI::App*> visible_subcommands(const CLI::App& command) {
  return command.get_subcommands([](const CLI::App* app) { return !app->get_group().empty(); });
}

std::vector<const CLI::Option*> named_options(const CLI::App& command) {
  return command.get_options([](const CLI::Option* option) {
    return option->nonpositional() && !option->get_group().empty();
  });
}

std::vector<const CLI::Option*> positional_arguments(const CLI::App& command) {
  return command.get_options([](const CLI::Option* option) { return option->get_positional(); });
}

std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

std::string names_or_file(const std::vector<std::string>& names) {
  std::string type;
  for (const std::string& name : names) type += (type.empty() ? "{" : ",") + name;
  return type + "}" + kOrFile;
}

bool takes_file(const CLI::Option& option) { return option.get_type_name().ends_with(kOrFile); }

std::vector<std::string> choices_of(const CLI::Option& option) {
  // The name of the option's type lists the values: "{lockstep,realtime}".
  const std::string type = option.get_type_name();
  const auto open = type.find('{'), close = type.find('}');
  if (open == std::string::npos || close == std::string::npos || close < open) return {};
  std::vector<std::string> choices;
  std::istringstream list(type.substr(open + 1, close - open - 1));
  for (std::string choice; std::getline(list, choice, ',');) choices.push_back(choice);
  return choices;
}

std::optional<Error> unknown_word(const CLI::App& program, const std::vector<std::string>& words) {
  const CLI::App* command = &program;
  std::string path = "stillmap";
  for (const std::string& word : words) {
    if (word.starts_with("--") && word.size() > 2) {
      const std::string name = word.substr(0, word.find('='));
      if (command->get_option_no_throw(name) != nullptr) continue;
      return Error("there is no option '" + name + "'", path,
                   suggestion(name, long_names(*command)) + "; all: " + path + " --help");
    }
    if (command == &program && word.starts_with("-") &&
        command->get_option_no_throw(word) == nullptr && words.back() != word) {
      return Error("the option '" + word + "' stands in front of the command", path,
                   "write it behind: stillmap COMMAND " + word);
    }
    if (word.starts_with("-") || command->get_require_subcommand_min() == 0) continue;
    const CLI::App* subcommand = find_subcommand(*command, word);
    if (subcommand == nullptr) {
      std::vector<std::string> names;
      for (const CLI::App* child : visible_subcommands(*command))
        names.push_back(child->get_name());
      return Error("there is no command '" + word + "'", path, suggestion(word, names));
    }
    command = subcommand;
    path += " " + word;
  }
  return std::nullopt;
}

CalledCommand called_command(const CLI::App& program) {
  CalledCommand called{&program, "stillmap"};
  while (!called.command->get_subcommands().empty()) {
    called.command = called.command->get_subcommands().front();
    called.path += " " + called.command->get_name();
  }
  return called;
}

std::optional<Error> wrong_number(const CLI::App& program, const std::string& problem) {
  // CLI11's texts: "Could not convert: --count = x", "--frames: Value -3 not in range 0
  // to 1.79e308".
  const std::regex conversion("Could not convert: (\\S+) = (.*)");
  const std::regex range("(\\S+): Value (\\S+) not in range .*");
  std::smatch parts;
  const bool is_conversion = std::regex_match(problem, parts, conversion);
  if (!is_conversion && !std::regex_match(problem, parts, range)) return std::nullopt;
  const auto [command, path] = called_command(program);
  const CLI::Option* option = command->get_option_no_throw(parts[1]);
  if (option == nullptr) return std::nullopt;
  const std::string type = option->get_type_name();
  const bool is_whole = type.starts_with("INT") || type.starts_with("UINT");
  std::string expected = is_whole ? "a whole number" : "a number";
  if (type.find("POSITIVE") != std::string::npos)
    expected += " above zero";
  else if (!is_conversion || type.starts_with("UINT"))
    expected += " that is not negative";
  return Error("expects " + expected + ", not '" + parts[2].str() + "'",
               path + ": " + parts[1].str(), "see " + path + " --help");
}

}  // namespace stillmap
