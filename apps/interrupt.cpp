// SPDX-License-Identifier: Apache-2.0
#include "interrupt.hpp"

#include <csignal>

namespace stillmap {
namespace {

volatile std::sig_atomic_t asked_to_end = 0;

extern "C" void remember(int signal) {
  asked_to_end = 1;
  std::signal(signal, SIG_DFL);
}

}  // namespace

void catch_interrupt() {
  std::signal(SIGINT, remember);
  std::signal(SIGTERM, remember);
  // The terminal was closed; nohup lets a run go on then.
  if (std::signal(SIGHUP, remember) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);
}

void survive_failed_outputs() {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
}

bool interrupted() { return asked_to_end != 0; }

}  // namespace stillmap
