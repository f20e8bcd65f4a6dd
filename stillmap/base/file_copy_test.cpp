// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/file_copy.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"

#include <csignal>
#include <string>
#include <sys/resource.h>

#include <gtest/gtest.h>

namespace stillmap {
namespace {
namespace fs = std::filesystem;

class FileCopy : public ::testing::Test {
 protected:
  FileCopy() {
    fs::create_directories(folder_);
    write_file(original_, content_);
  }
  ~FileCopy() override { fs::remove_all(folder_); }

  const fs::path folder_ = test::own_path("file_copy");
  const fs::path original_ = folder_ / "original", copy_ = folder_ / "copy";
  const std::string content_ = std::string(3000000, 'x') + "end";
};

TEST_F(FileCopy, HasTheContent) {
  write_copy(original_, copy_);
  EXPECT_EQ(read_file(copy_), content_);
}

/// Limits the size of files of this process while it lives, as a full disk does.
class SizeLimit {
 public:
  explicit SizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~SizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  SizeLimit(const SizeLimit&) = delete;
  SizeLimit& operator=(const SizeLimit&) = delete;

 private:
  void (*handler_)(int);
  rlimit before_{};
};

TEST_F(FileCopy, ThatDoesNotFitLeavesTheFileThatWasThere) {
  write_file(copy_, "older");
  {
    const SizeLimit limit(2000000);
    EXPECT_THROW(write_copy(original_, copy_), Error);
  }
  EXPECT_EQ(read_file(copy_), "older");
}

}  // namespace
}  // namespace stillmap
