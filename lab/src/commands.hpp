// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>

namespace stillmap::lab {

/// Each function adds one subcommand with its help; its callback does the work and prints the
/// figures, or throws Error.
void add_brief_pattern_command(CLI::App& app);
void add_detect_command(CLI::App& app);
void add_kidnap_command(CLI::App& app);
void add_large_map_command(CLI::App& app);
void add_loop_cost_command(CLI::App& app);
void add_loop_precision_command(CLI::App& app);
void add_long_run_command(CLI::App& app);
void add_masks_command(CLI::App& app);
void add_merge_scale_command(CLI::App& app);
void add_occlusion_command(CLI::App& app);
void add_place_recall_command(CLI::App& app);
void add_read_command(CLI::App& app);
void add_speeds_command(CLI::App& app);
void add_vocabulary_command(CLI::App& app);

}  // namespace stillmap::lab
