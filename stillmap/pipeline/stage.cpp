// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/stage.hpp"

#if defined(__linux__)
#include <sys/resource.h>
#include <unistd.h>
#endif

namespace stillmap {

void stand_back(Niceness niceness) {
  if (niceness == Niceness::kNone) return;
#if defined(__linux__)
  // Linux counts a thread as a process here, in spite of POSIX; and added to what the whole has.
  const auto thread = static_cast<id_t>(gettid());
  setpriority(PRIO_PROCESS, thread, getpriority(PRIO_PROCESS, thread) + static_cast<int>(niceness));
#endif
}

}  // namespace stillmap
