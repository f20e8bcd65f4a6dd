// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/error.hpp"

#include <optional>
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

/// Type of an option that takes a name of a list or a file: "{a,b} or FILE".
std::string names_or_file(const std::vector<std::string>& names);

/// Returns whether the option takes the name of a file as well as those of its list.
bool takes_file(const CLI::Option& option);

/// Returns the values that the type of an option lists; empty if it lists none.
std::vector<std::string> choices_of(const CLI::Option& option);

/// Names what the options and arguments of all commands take that have no type of their own: FILE,
/// DIR, and others. Throws std::logic_error for one whose name is in no table.
void name_value_types(CLI::App& program);

/// Returns the message for the first word of a command line that is no command or option where one
/// is expected, with the nearest known names; none if there is no such word.
std::optional<Error> unknown_word(const CLI::App& program, const std::vector<std::string>& words);

/// A command and its words, such as "stillmap map info".
struct CalledCommand {
  const CLI::App* command = nullptr;
  std::string path;
};

/// Returns the command that a parsed command line called; the program itself without one.
CalledCommand called_command(const CLI::App& program);

/// Returns the message for a value that is no number, or a negative one, with the wanted type; none
/// if CLI11's message is of something else.
std::optional<Error> wrong_number(const CLI::App& program, const std::string& problem);

}  // namespace stillmap
