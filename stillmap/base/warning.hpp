// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace stillmap {

/// Prints to standard error a problem that does not stop the program, and its remedy:
/// "stillmap: warning: PROBLEM" and "  fix: FIX", as Error is printed.
/// @param fix what the user can do about it; may be empty
void warn(const std::string& problem, const std::string& fix);

}  // namespace stillmap
