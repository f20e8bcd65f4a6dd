// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Run-time dispatch between two builds of the same hot loop. A loop is written once, as a template
/// on the vector type or as plain code for the vectorizer, marked STILLMAP_KERNEL, and instantiated
/// in two small functions: one for the base instruction set, one marked STILLMAP_TARGET_AVX2. Both
/// compute in integers, so both give the same bits.
#define STILLMAP_ALWAYS_INLINE __attribute__((always_inline))
#define STILLMAP_KERNEL inline STILLMAP_ALWAYS_INLINE
#if defined(__x86_64__)
#define STILLMAP_TARGET_AVX2 __attribute__((target("avx2,popcnt")))
#else
#define STILLMAP_TARGET_AVX2
#endif

namespace stillmap {

/// Build of the hot loops to run. The results do not depend on it.
enum class CpuPath {
  kPortable,  ///< Instruction set of the whole program.
  kAvx2,      ///< AVX2 and POPCNT.
};

/// Returns the fastest path that this CPU supports; determined once.
CpuPath best_cpu_path();

}  // namespace stillmap
