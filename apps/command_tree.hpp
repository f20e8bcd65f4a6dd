// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace stillmap {

/// A command of the program, with its path on the command line.
struct CommandNode {
  std::string path;     ///< "stillmap map info"
  const CLI::App* app;  ///< The command; never null, owned by the program.
};

/// Returns the program itself and all commands that its help lists, each before its subcommands.
std::vector<CommandNode> visible_commands(const CLI::App& program);

/// Returns the subcommands that a command's help lists.
std::vector<const CLI::App*> visible_subcommands(const CLI::App& command);

/// Returns the options and flags of a command that begin with a dash, without hidden ones.
std::vector<const CLI::Option*> named_options(const CLI::App& command);

/// Returns the positional arguments of a command.
std::vector<const CLI::Option*> positional_arguments(const CLI::App& command);

/// Returns the names of an option with their dashes, short ones first: "-h", "--help".
std::vector<std::string> names_of(const CLI::Option& option);

/// Returns the values that an option accepts if they are a closed list; empty otherwise.
std::vector<std::string> choices_of(const CLI::Option& option);

}  // namespace stillmap
