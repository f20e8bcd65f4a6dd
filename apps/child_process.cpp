// SPDX-License-Identifier: Apache-2.0
#include "child_process.hpp"

#include "stillmap/base/error.hpp"

#include <chrono>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include "interrupt.hpp"

namespace stillmap {
namespace {

constexpr std::chrono::milliseconds kPause(20);  // between two looks at a program

/// Starts a program, in a process group of its own, so that a terminal does not interrupt it, too.
pid_t start(const std::vector<std::string>& words, const std::filesystem::path& log) {
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                   0644);
  posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  pid_t process = 0;
  const int failure =
      ::posix_spawn(&process, arguments[0], &files, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  if (failure != 0)
    throw Error(std::string("cannot be started: ") + std::strerror(failure), words.front(),
                "check " + log.string());
  return process;
}

/// Returns the status of a process when it has ended; interrupts it once this process was.
int status_of(pid_t process) {
  int status = 0;
  bool passed_on = false;
  while (::waitpid(process, &status, WNOHANG) == 0) {
    if (interrupted() && !passed_on) {
      ::kill(process, SIGINT);
      passed_on = true;
    }
    std::this_thread::sleep_for(kPause);
  }
  return status;
}

}  // namespace

int run_program(const std::vector<std::string>& words, const std::filesystem::path& log) {
  const int status = status_of(start(words, log));
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

}  // namespace stillmap
