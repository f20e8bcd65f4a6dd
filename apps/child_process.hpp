// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace stillmap {

/// Runs a program with its output in a file. An interrupt of this process is passed on to it.
/// Returns its exit code, or 128 plus the number of the signal that ended it. Throws Error without
/// a process for it; the exit code of a program that cannot be started is 127, as in a shell. The
/// program is killed with this process.
/// @param words  file of the program, and its arguments
int run_program(const std::vector<std::string>& words, const std::filesystem::path& log);

}  // namespace stillmap
