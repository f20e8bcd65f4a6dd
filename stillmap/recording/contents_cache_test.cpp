// SPDX-License-Identifier: Apache-2.0
#include "stillmap/recording/contents_cache.hpp"

#include "stillmap/recording/test_recording.hpp"

#include <chrono>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using test::TestFolder;
using test::TestMessage;
using ::testing::SizeIs;

namespace fs = std::filesystem;

std::vector<TestMessage> messages(int count) {
  std::vector<TestMessage> all;
  for (int i = 0; i < count; ++i)
    all.push_back({"/text", "std_msgs/msg/String", std::string("\4\0\0\0text", 8), 1000 + i});
  return all;
}

// Replaces the bytes of a file by zeros, from a position on, and keeps its version.
void erase_content(const fs::path& file, std::size_t from) {
  const auto changed = fs::last_write_time(file);
  const auto size = fs::file_size(file);
  fs::resize_file(file, from);
  fs::resize_file(file, size);
  fs::last_write_time(file, changed);
}

void make_old(const fs::path& file, int hours) {
  fs::last_write_time(file, fs::file_time_type::clock::now() - std::chrono::hours(hours));
}

TEST(ContentsCache, AFileThatDidNotChangeIsNotScannedAgain) {
  const TestFolder folder;
  for (const char* compression : {"none", "bz2"}) {
    SCOPED_TRACE(compression);
    const auto file = folder.write(std::string(compression) + ".bag",
                                   test::bag_of(messages(6), compression, 3, true));
    make_old(file, 1);
    EXPECT_THAT(open_recording_file(file)->index().messages, SizeIs(6));
    erase_content(file, 4200);
    EXPECT_THAT(open_recording_file(file)->index().messages, SizeIs(6));
    make_old(file, 2);
    EXPECT_THAT(open_recording_file(file)->index().messages, SizeIs(0));
  }
}

TEST(ContentsCache, MessagesOfAKnownFileAreRead) {
  const TestFolder folder;
  const auto written = messages(6);
  for (const auto& file : {folder.write("a.bag", test::bag_of(written, "bz2", 4, true)),
                           folder.write("a.mcap", test::mcap_of(written, "ros1", "zstd", 4, true)),
                           folder.write_sqlite("a.db3", written)}) {
    SCOPED_TRACE(file.string());
    make_old(file, 1);
    for (int time = 0; time < 2; ++time) {
      const auto opened = open_recording_file(file);
      ASSERT_THAT(opened->index().topics, SizeIs(1));
      const auto& entries = opened->index().messages;
      ASSERT_EQ(entries.size(), file.extension() == ".db3" ? entries.size() : written.size());
      for (const MessageEntry& entry : entries)
        EXPECT_EQ(ByteCursor::as_text(opened->read(entry)), written[0].data);
    }
  }
}

TEST(ContentsCache, AFileThatMayStillChangeHasNoVersion) {
  const TestFolder folder;
  const auto file = folder.write("a.bag", "#ROSBAG V2.0\n");
  EXPECT_FALSE(version_of(file));
  make_old(file, 1);
  EXPECT_TRUE(version_of(file));
  folder.write("a.bag-wal", "");
  EXPECT_FALSE(version_of(file));
  EXPECT_FALSE(version_of(folder.path("missing")));
}

}  // namespace
}  // namespace stillmap
