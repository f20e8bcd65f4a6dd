// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace stillmap {

/// "AMD EPYC, 2 cores": what a timing was measured on.
std::string machine_description();

/// The most memory this process has held so far [MiB].
double peak_memory_mib();

/// Since this process was started, loading its libraries included [seconds]; 0 where the system
/// does not tell.
double seconds_since_start();

/// What all threads of this process have computed so far [milliseconds].
double process_cpu_ms();

}  // namespace stillmap
