// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>
#include <unistd.h>

#include <gtest/gtest.h>

namespace stillmap::test {

/// For tests: a new folder in the temporary folder, removed when the process that made it exits.
/// Its name is no process number alone: numbers return, and a killed test leaves its files.
class OwnFolder {
 public:
  OwnFolder()
      : path_((std::filesystem::path(::testing::TempDir()) / "stillmap_XXXXXX").string()),
        process_(::getpid()) {
    if (::mkdtemp(path_.data()) == nullptr) throw std::runtime_error("cannot create " + path_);
  }
  OwnFolder(const OwnFolder&) = delete;
  OwnFolder& operator=(const OwnFolder&) = delete;
  ~OwnFolder() {
    std::error_code ignored;
    if (::getpid() == process_) std::filesystem::remove_all(path_, ignored);
  }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  pid_t process_;
};

/// For tests: returns a path in a folder of this process.
inline std::filesystem::path own_path(const std::string& name) {
  static const OwnFolder folder;
  return std::filesystem::path(folder.path()) / name;
}

}  // namespace stillmap::test
