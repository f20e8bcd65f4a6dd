// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/page_file.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/test_memory.hpp"
#include "stillmap/base/test_path.hpp"

#include <sys/stat.h>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

std::string_view text(const Pages& pages) {
  return {reinterpret_cast<const char*>(pages.data()), pages.size()};
}

std::shared_ptr<const Pages> stored(PageFile& file, const std::vector<std::string_view>& parts) {
  return file.store(parts);
}

/// Returns the space on the disk of all open files in a folder [bytes].
long disk_bytes(const std::filesystem::path& folder) {
  long sum = 0;
  for (const auto& open : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code closed;
    const std::string file = std::filesystem::read_symlink(open, closed).string();
    struct stat status {};
    if (!file.starts_with(folder.string()) || ::stat(open.path().c_str(), &status) != 0) continue;
    sum += 512 * status.st_blocks;
  }
  return sum;
}

class PageFileTest : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove_all(folder_); }
  const std::filesystem::path folder_ = test::own_path("pages");
};

TEST_F(PageFileTest, GivesBackWhatWasStored) {
  PageFile file(folder_);
  const std::string large(100000, 'x');
  const auto first = stored(file, {"a", large, "", "b"});
  const auto second = stored(file, {"second"});
  EXPECT_EQ(text(*first), "a" + large + "b");
  EXPECT_EQ(text(*second), "second");
  first->drop();
  EXPECT_EQ(text(*first), "a" + large + "b") << "read again";
}

TEST_F(PageFileTest, BytesCanBeWrittenLater) {
  PageFile file(folder_);
  const auto first = file.reserve(5000), second = file.reserve(1);
  std::fill_n(first->data(), 5000, std::byte{'x'});
  second->data()[0] = std::byte{'y'};
  first->drop();
  EXPECT_EQ(text(*first), std::string(5000, 'x')) << "read again";
  EXPECT_EQ(text(*second), "y");
}

TEST_F(PageFileTest, LeavesNothingInTheFolder) {
  PageFile file(folder_);
  const auto pages = stored(file, {"some bytes"});
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(PageFileTest, PagesOutliveTheFile) {
  auto file = std::make_unique<PageFile>(folder_);
  const auto pages = stored(*file, {"some bytes"});
  file.reset();
  EXPECT_EQ(text(*pages), "some bytes");
}

TEST_F(PageFileTest, TakesMemoryOnlyWhileItIsUsed) {
  PageFile file(folder_);
  const std::string large(1 << 20, 'x');
  const auto pages = stored(file, {large});
  EXPECT_EQ(test::resident_kib(folder_), 0);
  EXPECT_EQ(text(*pages), large);
  EXPECT_EQ(test::resident_kib(folder_), 1024);
  pages->drop();
  EXPECT_EQ(test::resident_kib(folder_), 0);
}

TEST_F(PageFileTest, FreesTheDiskWithThePages) {
  PageFile file(folder_);
  const std::string large(1 << 20, 'x');
  auto kept = stored(file, {"kept"});
  auto pages = stored(file, {large});
  EXPECT_GE(disk_bytes(folder_), 1 << 20);
  pages.reset();
  EXPECT_LE(disk_bytes(folder_), 1 << 16);
  EXPECT_EQ(text(*kept), "kept");
  EXPECT_EQ(text(*stored(file, {"more"})), "more");
}

TEST_F(PageFileTest, OnAFullDiskTheRestStaysUsable) {
  PageFile file(folder_);
  const auto before = stored(file, {"before"});
  {
    const test::FullDisk full(50000);
    EXPECT_THROW(stored(file, {std::string(100000, 'x')}), Error);
  }
  EXPECT_EQ(text(*before), "before");
  EXPECT_EQ(text(*stored(file, {"after"})), "after");
}

TEST_F(PageFileTest, AFolderThatCannotBeWrittenIsAnError) {
  EXPECT_THROW(PageFile("/proc/no/such/folder"), Error);
}

}  // namespace
}  // namespace stillmap
