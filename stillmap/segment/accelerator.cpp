// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/accelerator.hpp"

#include <array>
#include <dlfcn.h>
#include <filesystem>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// The first NVIDIA GPU.
struct NvidiaGpu {
  std::string name;     ///< Name from the driver; empty if there is no GPU.
  std::string problem;  ///< Reason why there is no GPU; empty if there is one.
};

/// Calls a function of a library by its name. Returns whether it exists and returned 0.

template <typename... Arguments>
bool succeeds(void* library, const char* function, Arguments... arguments) {
  const auto address = reinterpret_cast<int (*)(Arguments...)>(dlsym(library, function));
  return address != nullptr && address(arguments...) == 0;
}

/// Queries the driver's library (CUDA Driver API, whose functions return 0 for success).
NvidiaGpu find_nvidia_gpu() {
  void* driver = dlopen("libcuda.so.1", RTLD_NOW | RTLD_LOCAL);
  if (driver == nullptr) return {"", "no libcuda.so.1 (NVIDIA driver)"};
  int count = 0;
  std::array<char, 256> name{};
  if (!succeeds(driver, "cuInit", 0U) || !succeeds(driver, "cuDeviceGetCount", &count) ||
      count == 0 ||
      !succeeds(driver, "cuDeviceGetName", name.data(), static_cast<int>(name.size()) - 1, 0))
    return {"", "the NVIDIA driver finds no GPU"};
  return {name.data(), ""};
}

const NvidiaGpu& nvidia_gpu() {
  static const NvidiaGpu gpu = find_nvidia_gpu();
  return gpu;
}

/// Returns what is missing: the folder of the device files, or the library that loads the driver.
/// Empty if both exist.
std::string missing_part(const char* folder, const char* library, const char* device) {
  if (!std::filesystem::exists(folder)) return fmt::format("no {} ({})", folder, device);
  if (dlopen(library, RTLD_LAZY | RTLD_LOCAL) == nullptr)
    return fmt::format("no {} ({} driver)", library, device);
  return {};
}

}  // namespace

std::string missing_hardware(const std::string& device) {
  if (device == "tensorrt" || device == "cuda") return nvidia_gpu().problem;
  if (device == "intel-gpu") return missing_part("/dev/dri", "libOpenCL.so.1", "Intel GPU");
  if (device == "npu") return missing_part("/dev/accel", "libze_loader.so.1", "NPU");
  return {};
}

std::string driver_advice(const std::string& device) {
  if (device == "tensorrt" || device == "cuda") {
    return "install NVIDIA's driver (Ubuntu: `sudo ubuntu-drivers install`, Debian: `sudo apt-get "
           "install nvidia-driver`) until `nvidia-smi` lists the GPU";
  }
  if (device == "intel-gpu")
    return "run `sudo apt-get install intel-opencl-icd ocl-icd-libopencl1`, Intel's GPU driver";
  if (device == "npu") {
    return "install the driver, `sudo apt-get install ./*.deb` with the files of "
           "github.com/intel/linux-npu-driver/releases";
  }
  return {};
}

std::string nvidia_gpu_name() { return nvidia_gpu().name; }

}  // namespace stillmap
