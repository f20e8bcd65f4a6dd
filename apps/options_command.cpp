// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/print.hpp"
#include "stillmap/config/preset_files.hpp"
#include "stillmap/config/write_options.hpp"

#include <memory>
#include <sstream>
#include <string>

#include "commands.hpp"
#include "terminal.hpp"
#include <fmt/format.h>

namespace stillmap {

void add_options_command(CLI::App& app, int& exit_code) {
  auto markdown = std::make_shared<bool>(false);
  CLI::App* command =
      app.add_subcommand("options", "list all options with unit, range, default and meaning");
  command->add_flag("--markdown", *markdown, "write them as the page docs/options.md");
  command->footer(
      "Examples:\n"
      "  stillmap options\n"
      "  stillmap options > options.yaml && stillmap run my_sequence --config options.yaml");
  command->callback([markdown, &exit_code] {
    write_text(stdout, *markdown ? options_markdown() : options_yaml(Options()));
    exit_code = kSuccess;
  });
}

void add_findings_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand(
      "findings", "list the codes of findings with severity and meaning, as a table in Markdown");
  command->footer("Findings are in summary.json of a run and at the end of its output.");
  command->callback([&exit_code] {
    write_text(stdout, finding_kinds_markdown());
    exit_code = kSuccess;
  });
}

void add_presets_command(CLI::App& app, int& exit_code) {
  auto name = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("presets", "list the presets, or show the file of one");
  command->add_option("name", *name, "preset whose file is shown");
  command->footer(
      "A preset is a YAML file of options that differ from the defaults. Files in the folder that "
      "the environment variable STILLMAP_PRESETS names are presets, too.\n"
      "Examples:\n"
      "  stillmap presets\n"
      "  stillmap presets box-flow > mine.yaml && stillmap run my_sequence --preset mine.yaml");
  command->callback([name, &exit_code] {
    if (name->empty()) {
      std::istringstream lines(presets_text());
      for (std::string line; std::getline(lines, line);)
        print_out("{}\n", fitted(line, help_columns()));
    } else {
      write_text(stdout, find_preset_file(*name).text);
    }
    exit_code = kSuccess;
  });
}

}  // namespace stillmap
