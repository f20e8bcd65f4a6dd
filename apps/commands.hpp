// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/finding.hpp"
#include "stillmap/report/run_folder.hpp"

#include <span>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace stillmap {

/// Exit codes of the command.
enum ExitCode {
  kSuccess = 0,
  kFailure = 1,   ///< No result, or not all files could be written.
  kUsage = 2,     ///< The arguments are wrong.
  kDoubtful = 3,  ///< All files were written, but the results should not be trusted.
  kInterrupted = 130
};

/// Each function adds one command, with its help and examples; the callback sets `exit_code` or
/// throws Error.
void add_run_command(CLI::App& app, int& exit_code);
void add_batch_command(CLI::App& app, int& exit_code);
void add_recover_command(CLI::App& app, int& exit_code);
void add_dense_command(CLI::App& app, int& exit_code);
void add_eval_command(CLI::App& app, int& exit_code);
void add_compare_command(CLI::App& app, int& exit_code);
void add_simulate_command(CLI::App& app, int& exit_code);
void add_demo_command(CLI::App& app, int& exit_code);
void add_warn_command(CLI::App& app, int& exit_code);
void add_view_command(CLI::App& app, int& exit_code);
void add_calibrate_command(CLI::App& app, int& exit_code);
void add_doctor_command(CLI::App& app, int& exit_code);
void add_info_command(CLI::App& app, int& exit_code);
void add_record_command(CLI::App& app, int& exit_code);
void add_map_command(CLI::App& app, int& exit_code);
void add_options_command(CLI::App& app, int& exit_code);
void add_findings_command(CLI::App& app, int& exit_code);
void add_presets_command(CLI::App& app, int& exit_code);

/// Prints notes, and the reasons not to trust a result. Returns the exit code that follows.
int print_findings(std::span<const Finding> findings);

/// Adds --mesh, --planner and the options of the floor to a command.
void add_dense_options(CLI::App& command, DenseOutputs& outputs);
/// Returns a line with the files of a part of a run, for the help of a command.
std::string files_help(const std::string& condition, RunPart part);
/// Returns the lines with the files that are made of the dense map in addition to its cloud.
std::string dense_files_help();
/// Adds --quiet to a command that shows its progress.
void add_quiet_option(CLI::App& command);
/// Adds --force to a command that writes a folder of results.
void add_force_option(CLI::App& command, bool& force);
/// Each function adds a hidden command that prints a file which `make install` installs with the
/// program. It reads the commands of `app`, which must outlive the call of parse().
void add_man_command(CLI::App& app);
void add_completion_command(CLI::App& app);

}  // namespace stillmap
