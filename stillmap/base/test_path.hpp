// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <unistd.h>

#include <gtest/gtest.h>

namespace stillmap::test {

/// For tests: returns a path in the temporary folder that is unique to this process. Tests run in
/// parallel processes, so equal names would collide.
inline std::filesystem::path own_path(const std::string& name) {
  return std::filesystem::path(::testing::TempDir()) /
         ("stillmap_" + std::to_string(::getpid()) + "_" + name);
}

}  // namespace stillmap::test
