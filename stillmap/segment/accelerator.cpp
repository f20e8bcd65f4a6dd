// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/accelerator.hpp"

#include <array>
#include <dlfcn.h>
#include <filesystem>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// The first GPU as NVIDIA's driver describes it, or the reason why there is none.
struct NvidiaGpu {
  std::string name, problem;
};

template <typename... Arguments>
bool succeeds(void* library, const char* function, Arguments... arguments) {
  const auto address = reinterpret_cast<int (*)(Arguments...)>(dlsym(library, function));
  return address != nullptr && address(arguments...) == 0;
}

/// Asks the library of the driver (CUDA Driver API, whose functions return 0 for success).
NvidiaGpu find_nvidia_gpu() {
  void* driver = dlopen("libcuda.so.1", RTLD_NOW | RTLD_LOCAL);
  if (driver == nullptr) return {"", "no libcuda.so.1 (NVIDIA driver)"};
  int count = 0;
  std::array<char, 256> name{};
  if (!succeeds(driver, "cuInit", 0U) || !succeeds(driver, "cuDeviceGetCount", &count) ||
      count == 0 ||
      !succeeds(driver, "cuDeviceGetName", name.data(), static_cast<int>(name.size()) - 1, 0))
    return {"", "no GPU that the NVIDIA driver finds"};
  return {name.data(), ""};
}

const NvidiaGpu& nvidia_gpu() {
  static const NvidiaGpu gpu = find_nvidia_gpu();
  return gpu;
}

/// Returns the missing one of a folder of device files and the library that drivers are found with.
std::string missing_of(const char* folder, const char* library, const char* device) {
  if (!std::filesystem::exists(folder)) return fmt::format("no {} ({})", folder, device);
  if (dlopen(library, RTLD_LAZY | RTLD_LOCAL) == nullptr)
    return fmt::format("no {} ({} driver)", library, device);
  return {};
}

}  // namespace

std::string missing_hardware(const std::string& device) {
  if (device == "tensorrt" || device == "cuda") return nvidia_gpu().problem;
  if (device == "intel-gpu") return missing_of("/dev/dri", "libOpenCL.so.1", "Intel GPU");
  if (device == "npu") return missing_of("/dev/accel", "libze_loader.so.1", "NPU");
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
