// SPDX-License-Identifier: Apache-2.0
// The hidden command `stillmap man`: the manual page, made from the help texts of all commands.
#include "stillmap/base/print.hpp"

#include <sstream>

#include "command_tree.hpp"
#include "commands.hpp"
#include "terminal.hpp"
#include <fmt/format.h>

namespace stillmap {
namespace {

/// Returns the text with the characters escaped that have a meaning for roff.
std::string roff(const std::string& text) {
  std::string escaped;
  bool line_begins = true;
  for (const char c : text) {
    if (line_begins && (c == '.' || c == '\'')) escaped += "\\&";
    if (c == '\\') {
      escaped += "\\e";
    } else if (c == '-') {
      escaped += "\\-";
    } else {
      escaped += c;
    }
    line_begins = c == '\n';
  }
  return escaped;
}

std::string bold(const std::string& text) { return "\\fB" + roff(text) + "\\fR"; }
std::string italic(const std::string& text) { return "\\fI" + roff(text) + "\\fR"; }

/// Returns the text with places after its commas where a line may be broken.
std::string breakable(const std::string& text) {
  std::string broken;
  for (const char c : text) {
    broken += c;
    if (c == ',') broken += "\\:";
  }
  return broken;
}

/// Returns the options line of a command: "stillmap run [OPTIONS] [sequence]".
std::string synopsis(const CommandNode& command) {
  std::string line = bold(command.path) + " [OPTIONS]";
  for (const CLI::Option* argument : positional_arguments(*command.app)) {
    const std::string name = italic(argument->get_name(true));
    line += argument->get_required() ? " " + name : " [" + name + "]";
  }
  if (!visible_subcommands(*command.app).empty()) line += " " + italic("COMMAND");
  return line;
}

std::string entry(const std::string& tag, const CLI::Option& option) {
  std::string text = ".TP\n" + tag + "\n" + roff(option.get_description()) + "\n";
  if (!option.get_default_str().empty())
    text += "(default: " + roff(option.get_default_str()) + ")\n";
  return text;
}

std::string entry(const CLI::Option& option) {
  if (!option.nonpositional()) return entry(italic(option.get_name(true)), option);
  std::string tag;
  for (const std::string& name : names_of(option)) tag += (tag.empty() ? "" : ", ") + bold(name);
  if (option.get_type_size() != 0) tag += " " + breakable(italic(value_type(option)));
  return entry(tag, option);
}

/// Returns the closing text of a command's help: indented lines as they are, others as paragraphs.
std::string closing_text(const std::string& footer) {
  std::string page;
  bool indented = false;
  std::istringstream lines(footer);
  for (std::string line; std::getline(lines, line);) {
    const bool indent = line.starts_with("  ");
    if (indent != indented) page += indent ? ".nf\n" : ".fi\n";
    if (!indent && !line.empty()) page += ".PP\n";
    if (!line.empty()) page += roff(line) + "\n";
    indented = indent;
  }
  return page + (indented ? ".fi\n" : "");
}

std::string section_of(const CommandNode& command, const std::string& common_footer) {
  std::string page =
      ".SS " + synopsis(command) + "\n" + roff(command.app->get_description()) + "\n";
  for (const CLI::Option* argument : positional_arguments(*command.app)) page += entry(*argument);
  for (const CLI::Option* option : named_options(*command.app)) page += entry(*option);
  const std::string footer = command.app->get_footer();
  return footer == common_footer ? page : page + closing_text(footer);
}

std::string man_page(const CLI::App& program) {
  std::string page = fmt::format(
      ".TH STILLMAP 1 \"\" \"Stillmap {}\" \"User Commands\"\n"
      ".SH NAME\nstillmap \\- RGB\\-D SLAM in dynamic scenes\n"
      ".SH SYNOPSIS\n\\fBstillmap\\fR \\fICOMMAND\\fR [OPTIONS]\n"
      ".SH DESCRIPTION\n{}\n.SH COMMANDS\n",
      STILLMAP_VERSION, roff(program.get_description()));
  for (const CommandNode& command : visible_commands(program))
    page += section_of(command, program.get_footer());
  return page +
         ".SH EXIT STATUS\n"
         ".TP\n0\nThe command succeeded.\n"
         ".TP\n1\nThe command failed; the message names the cause and the fix.\n"
         ".TP\n2\nThe command line is wrong.\n"
         ".TP\n3\nAll files were written, but the result should not be trusted; the message says "
         "why.\n"
         ".TP\n130\nThe command was interrupted; the results so far are saved.\n"
         ".SH FILES\n"
         ".TP\n\\fIPREFIX\\fR/lib/stillmap\n"
         "The plug\\-in for OpenVINO with OpenVINO's libraries. Without them networks run on "
         "ONNX Runtime, if it is installed, or OpenCV.\n"
         ".SH ENVIRONMENT\n"
         ".TP\n\\fBSTILLMAP_ONNXRUNTIME\\fR\n"
         "The library of ONNX Runtime or its folder; without it pip's and the system's is used.\n"
         ".TP\n\\fBSTILLMAP_PRESETS\\fR\n"
         "A folder with further presets.\n";
}

}  // namespace

void add_man_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("man", "print the manual page in roff");
  command->group("");  // hidden: `make install` calls it
  command->callback([&app] { write_text(stdout, man_page(app)); });
}

}  // namespace stillmap
