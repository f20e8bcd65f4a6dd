// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/cpu.hpp"

namespace stillmap {

CpuPath best_cpu_path() {
#if defined(__x86_64__)
  static const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("popcnt");
  return avx2 ? CpuPath::kAvx2 : CpuPath::kPortable;
#else
  return CpuPath::kPortable;
#endif
}

}  // namespace stillmap
