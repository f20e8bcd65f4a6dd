// SPDX-License-Identifier: Apache-2.0
// A substitute for libcuda.so.1, NVIDIA's driver, with one GPU, for tests on computers without one.
#include <cstring>

// NOLINTBEGIN(readability-identifier-naming): the names are those of the CUDA Driver API.
extern "C" {

__attribute__((visibility("default"))) int cuInit(unsigned) { return 0; }

__attribute__((visibility("default"))) int cuDeviceGetCount(int* count) {
  *count = 1;
  return 0;
}

__attribute__((visibility("default"))) int cuDeviceGetName(char* name, int length, int) {
  std::strncpy(name, "Fake GPU", static_cast<unsigned>(length));
  return 0;
}
}
// NOLINTEND(readability-identifier-naming)
