// SPDX-License-Identifier: Apache-2.0
// The hidden command `stillmap completion bash`: completion of commands, options and listed values.
#include "command_tree.hpp"
#include "commands.hpp"
#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr const char* kFunctionBegin =
    R"(# bash completion for stillmap, printed by `stillmap completion bash`
_stillmap() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]}
  local command=stillmap words= i
  COMPREPLY=()
  for ((i = 1; i < COMP_CWORD; i++)); do
    case "$command ${COMP_WORDS[i]}" in
)";

constexpr const char* kFunctionEnd = R"(  COMPREPLY=($(compgen -W "$words" -- "$current"))
}
# Where nothing is offered, bash completes file names.
complete -o default -F _stillmap stillmap
)";

/// Returns one case per command; it appends the command's name to the path that leads to it.
std::string path_cases(const std::vector<CommandNode>& commands) {
  std::string text;
  for (const CommandNode& command : commands) {
    if (command.path != "stillmap")
      text += fmt::format("      \"{}\") command+=\" ${{COMP_WORDS[i]}}\" ;;\n", command.path);
  }
  return text;
}

/// Returns one case per option with a value; it offers the listed values, or leaves it to files.
std::string value_cases(const CommandNode& command) {
  std::string text;
  for (const CLI::Option* option : named_options(*command.app)) {
    if (option->get_type_size() == 0) continue;
    const auto choices = choices_of(*option);
    for (const std::string& name : names_of(*option)) {
      text += fmt::format("    \"{} {}\") ", command.path, name);
      text += choices.empty()
                  ? "return ;;\n"
                  : fmt::format("COMPREPLY=($(compgen -W \"{}\" -- \"$current\")); return ;;\n",
                                fmt::join(choices, " "));
    }
  }
  return text;
}

/// Returns the case that lists subcommands and options; options only once a dash is typed, so that
/// a command without subcommands completes file names.
std::string word_case(const CommandNode& command) {
  std::vector<std::string> words;
  for (const CLI::App* child : visible_subcommands(*command.app))
    words.push_back(child->get_name());
  const bool leaf = words.empty();
  for (const CLI::Option* option : named_options(*command.app)) {
    for (const std::string& name : names_of(*option)) words.push_back(name);
  }
  return fmt::format("    \"{}\") {}words=\"{}\" ;;\n", command.path,
                     leaf ? "[[ $current == -* ]] || return 0; " : "", fmt::join(words, " "));
}

std::string bash_completion(const CLI::App& program) {
  const auto commands = visible_commands(program);
  std::string values, words;
  for (const CommandNode& command : commands) {
    values += value_cases(command);
    words += word_case(command);
  }
  return kFunctionBegin + path_cases(commands) +
         "    esac\n  done\n  case \"$command $previous\" in\n" + values +
         "  esac\n  case \"$command\" in\n" + words + "  esac\n" + kFunctionEnd;
}

}  // namespace

void add_completion_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("completion", "print the completion script of a shell");
  command->group("");  // hidden: `make install` calls it
  command->require_subcommand(1);
  command->add_subcommand("bash", "for bash")->callback([&app] {
    fmt::print("{}", bash_completion(app));
  });
}

}  // namespace stillmap
