// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/stage.hpp"

#if defined(__linux__)
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>
#endif

namespace stillmap {

void lower_priority(ThreadPriority priority) {
  if (priority == ThreadPriority::kNone) return;
#if defined(__linux__)
  // On Linux the nice value belongs to the thread and not, as in POSIX, to the process. The
  // priority is relative to the nice value that the thread inherits.
  const pid_t thread = gettid();
  const auto id = static_cast<id_t>(thread);
  setpriority(PRIO_PROCESS, id, getpriority(PRIO_PROCESS, id) + static_cast<int>(priority));
  if (priority == ThreadPriority::kIdle) {
    const sched_param none{};
    sched_setscheduler(thread, SCHED_IDLE, &none);
  }
#endif
}

}  // namespace stillmap
