// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <unistd.h>

#include <gtest/gtest.h>

namespace stillmap::test {

/// For tests: a path in the temporary folder that is this process's own. Tests run beside each
/// other, each in a process, so those that write the same name spoil each other's files.
inline std::filesystem::path own_path(const std::string& name) {
  return std::filesystem::path(::testing::TempDir()) /
         ("stillmap_" + std::to_string(::getpid()) + "_" + name);
}

}  // namespace stillmap::test
