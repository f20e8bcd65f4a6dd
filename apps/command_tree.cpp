// SPDX-License-Identifier: Apache-2.0
#include "command_tree.hpp"

#include <sstream>

namespace stillmap {
namespace {

void append(const std::string& path, const CLI::App& app, std::vector<CommandNode>& nodes) {
  nodes.push_back({path, &app});
  for (const CLI::App* child : visible_subcommands(app))
    append(path + " " + child->get_name(), *child, nodes);
}

}  // namespace

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

}  // namespace stillmap
