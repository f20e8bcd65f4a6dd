// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace stillmap {

/// Returns the processor and the number of cores: "AMD EPYC, 2 cores".
std::string machine_description();

/// Returns the peak memory of this process so far [MiB].
double peak_memory_mib();

/// Returns the time since the start of this process, including the loading of libraries [s]; 0 if
/// the system does not provide it.
double seconds_since_start();

/// Returns the CPU time of all threads of this process so far [ms].
double process_cpu_ms();

}  // namespace stillmap
