// SPDX-License-Identifier: Apache-2.0
// The hidden command `stillmap completion SHELL`: completion of commands, options and listed
// values.
#include "stillmap/base/print.hpp"

#include "command_tree.hpp"
#include "commands.hpp"
#include <fmt/format.h>

namespace stillmap {
namespace {

/// Parts of a completion script that differ between the shells. The patterns of their `case`
/// commands are the same.
struct Shell {
  const char* begin;    ///< Up to the first pattern, which is that of a path and the next word.
  const char* advance;  ///< Command that appends the next word to the path.
  const char* end;
  /// Returns the command that offers the values of an option; file names if it lists none.
  std::string (*offer_values)(const CLI::Option& option);
  /// Returns the command that offers the subcommands and options of a command.
  std::string (*offer_words)(const CLI::App& command);
};

/// Bash completes file names by itself where no listed value matches.
std::string bash_values(const CLI::Option& option) {
  const std::vector<std::string> choices = choices_of(option);
  if (choices.empty()) return "return";
  return fmt::format(R"(COMPREPLY=($(compgen -W "{}" -- "$current")); return)",
                     fmt::join(choices, " "));
}

/// Offers options only once a dash is typed, so that a command without subcommands completes file
/// names.
std::string bash_words(const CLI::App& command) {
  std::vector<std::string> words;
  for (const CLI::App* child : visible_subcommands(command)) words.push_back(child->get_name());
  const bool leaf = words.empty();
  for (const CLI::Option* option : named_options(command)) {
    for (const std::string& name : names_of(*option)) words.push_back(name);
  }
  return fmt::format("{}words=\"{}\"", leaf ? "[[ $current == -* ]] || return 0; " : "",
                     fmt::join(words, " "));
}

constexpr Shell kBash = {
    R"(# bash completion for stillmap, printed by `stillmap completion bash`
_stillmap() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]}
  local command=stillmap words= i
  COMPREPLY=()
  for ((i = 1; i < COMP_CWORD; i++)); do
    case "$command ${COMP_WORDS[i]}" in
)",
    "command+=\" ${COMP_WORDS[i]}\"",
    R"(  COMPREPLY=($(compgen -W "$words" -- "$current"))
}
# Where nothing is offered, bash completes file names.
complete -o default -F _stillmap stillmap
)",
    bash_values, bash_words};

std::string zsh_values(const CLI::Option& option) {
  const std::vector<std::string> choices = choices_of(option);
  if (choices.empty()) return "_files; return";
  return fmt::format("compadd -- {};{} return", fmt::join(choices, " "),
                     takes_file(option) ? " _files;" : "");
}

/// Returns 'NAME:DESCRIPTION' in quotes, an entry of an array for _describe.
std::string zsh_entry(const std::string& name, const std::string& description) {
  std::string text = "'" + name + ":";
  for (const char c : description)
    text += c == '\'' ? "'\\''" : std::string(1, c == '\n' ? ' ' : c);
  return text + "'";
}

std::string zsh_words(const CLI::App& command) {
  std::vector<std::string> subcommands, named;
  for (const CLI::App* child : visible_subcommands(command))
    subcommands.push_back(zsh_entry(child->get_name(), child->get_description()));
  for (const CLI::Option* option : named_options(command)) {
    for (const std::string& name : names_of(*option))
      named.push_back(zsh_entry(name, option->get_description()));
  }
  return fmt::format("subcommands=({}) named=({})", fmt::join(subcommands, " "),
                     fmt::join(named, " "));
}

constexpr Shell kZsh = {
    R"(#compdef stillmap
# zsh completion for stillmap, printed by `stillmap completion zsh`
_stillmap() {
  local current=${words[CURRENT]} previous=${words[CURRENT-1]} command=stillmap word
  local -a subcommands named
  for word in "${(@)words[2,CURRENT-1]}"; do
    case "$command $word" in
)",
    "command+=\" $word\"",
    R"(  if [[ $current == -* ]]; then
    _describe -o option named
  elif (( $#subcommands )); then
    _describe command subcommands
  else
    _files
  fi
}
# zsh loads this file as the body of the function; elsewhere it only defines the function.
if [[ $funcstack[1] == _stillmap ]]; then _stillmap "$@"; fi
)",
    zsh_values, zsh_words};

/// Returns one case per option with a value, by all its names.
std::string value_cases(const CommandNode& command, const Shell& shell) {
  std::string text;
  for (const CLI::Option* option : named_options(*command.app)) {
    if (option->get_items_expected_max() == 0) continue;  // a flag
    const std::string offer = shell.offer_values(*option);
    for (const std::string& name : names_of(*option))
      text += fmt::format("    \"{} {}\") {} ;;\n", command.path, name, offer);
  }
  return text;
}

std::string completion(const CLI::App& program, const Shell& shell) {
  std::string paths, values, words;
  for (const CommandNode& command : visible_commands(program)) {
    if (command.path != "stillmap")
      paths += fmt::format("      \"{}\") {} ;;\n", command.path, shell.advance);
    values += value_cases(command, shell);
    words += fmt::format("    \"{}\") {} ;;\n", command.path, shell.offer_words(*command.app));
  }
  return shell.begin + paths + "    esac\n  done\n  case \"$command $previous\" in\n" + values +
         "  esac\n  case \"$command\" in\n" + words + "  esac\n" + shell.end;
}

}  // namespace

void add_completion_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("completion", "print the completion script of a shell");
  command->require_subcommand(1);
  command->add_subcommand("bash", "for bash")->callback([&app] {
    write_text(stdout, completion(app, kBash));
  });
  command->add_subcommand("zsh", "for zsh")->callback([&app] {
    write_text(stdout, completion(app, kZsh));
  });
  // Hidden: `make install` calls it. Set last, so that errors list its subcommands.
  command->group("");
}

}  // namespace stillmap
