// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <sys/resource.h>

namespace stillmap::test {

/// For tests: returns the memory that the pages of files in a folder take in this process [KiB],
/// also of files that are removed.
inline long resident_kib(const std::filesystem::path& folder) {
  std::ifstream maps("/proc/self/smaps");
  long sum = 0;
  bool counts = false;
  for (std::string line; std::getline(maps, line);) {
    if (line.find('-') < line.find(':')) counts = line.find(folder.string()) != std::string::npos;
    if (counts && line.starts_with("Rss:")) sum += std::stol(line.substr(4));
  }
  return sum;
}

/// For tests: as long as it exists, this process cannot write files larger than `bytes`, as on a
/// full disk.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() { ::setrlimit(RLIMIT_FSIZE, &before_); }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
};

}  // namespace stillmap::test
