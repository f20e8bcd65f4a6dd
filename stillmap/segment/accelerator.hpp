// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace stillmap {

/// Returns which part of the computer or of its driver the device lacks, such as "no libcuda.so.1
/// (NVIDIA driver)". Empty if all seem present, and for the cpu.
std::string missing_hardware(const std::string& device);

/// Returns the command that installs the driver of a device; empty for the cpu.
std::string driver_advice(const std::string& device);

/// Returns the name of the first NVIDIA GPU; empty if there is none.
std::string nvidia_gpu_name();

}  // namespace stillmap
