// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>

namespace stillmap {

/// Exit codes of the command.
enum ExitCode { kSuccess = 0, kFailure = 1, kUsage = 2, kInterrupted = 130 };

/// Each adds one command, with its help and examples; the callback leaves its exit code in
/// `exit_code` or throws Error.
void add_run_command(CLI::App& app, int& exit_code);
void add_dense_command(CLI::App& app, int& exit_code);
void add_eval_command(CLI::App& app, int& exit_code);
void add_compare_command(CLI::App& app, int& exit_code);
void add_simulate_command(CLI::App& app, int& exit_code);
void add_demo_command(CLI::App& app, int& exit_code);
void add_doctor_command(CLI::App& app, int& exit_code);
void add_map_command(CLI::App& app, int& exit_code);

}  // namespace stillmap
