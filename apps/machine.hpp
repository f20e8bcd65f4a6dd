// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace stillmap {

/// "AMD EPYC, 2 cores": what a timing was measured on.
std::string machine_description();

/// The most memory this process has held so far [MiB].
double peak_memory_mib();

}  // namespace stillmap
