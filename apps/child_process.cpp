// SPDX-License-Identifier: Apache-2.0
#include "child_process.hpp"

#include "stillmap/base/error.hpp"

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include "interrupt.hpp"

namespace stillmap {
namespace {

constexpr std::chrono::milliseconds kPause(20);  // between two looks at a program

constexpr int kNotStarted = 127;  // the exit code, as of a shell

/// Starts a program, in a process group of its own, so that a terminal does not interrupt it, too.
/// It is killed when the calling thread ends, such as when this process is killed.
pid_t start(const std::vector<std::string>& words, const std::filesystem::path& log) {
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const pid_t parent = ::getpid();
  const pid_t process = ::fork();
  if (process < 0)
    throw Error(std::string("cannot be started: ") + std::strerror(errno), words.front(),
                "close other programs");
  if (process > 0) return process;
  // Other threads are gone, so only calls that are safe in signal handlers are allowed.
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const int in = ::open("/dev/null", O_RDONLY);
  const int out = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  const bool ready = ::getppid() == parent && ::dup2(in, STDIN_FILENO) >= 0 &&
                     ::dup2(out, STDOUT_FILENO) >= 0 && ::dup2(out, STDERR_FILENO) >= 0;
  if (ready) ::execve(arguments[0], arguments.data(), environ);
  ::_exit(kNotStarted);
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
