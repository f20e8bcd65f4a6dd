// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace stillmap {

/// Returns the hardware or driver that is missing for the device (EngineOptions::device), such as
/// "no libcuda.so.1 (NVIDIA driver)". Empty if nothing is known to be missing, and for cpu.
std::string missing_hardware(const std::string& device);

/// Returns how to install the driver of the device, as a phrase for the fix of an Error; empty for
/// cpu.
std::string driver_advice(const std::string& device);

/// Returns the name of the first NVIDIA GPU as its driver reports it; empty if there is none.
std::string nvidia_gpu_name();

}  // namespace stillmap
