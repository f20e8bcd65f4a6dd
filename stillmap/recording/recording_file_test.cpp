// SPDX-License-Identifier: Apache-2.0
#include "stillmap/recording/recording_file.hpp"

#include "stillmap/base/test_error.hpp"
#include "stillmap/recording/recording.hpp"
#include "stillmap/recording/test_recording.hpp"

#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using test::error_of;
using test::Kind;
using test::TestCamera;
using test::TestFolder;
using test::TestMessage;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr std::int64_t kSecond = 1'000'000'000;

// Ten images of two topics and five messages of a type that is only counted.
std::vector<TestMessage> messages(Kind kind) {
  const bool ros1 = kind == Kind::kRos1;
  const TestCamera camera{.kind = kind, .frame = "optical"};
  std::vector<TestMessage> all;
  for (int i = 0; i < 5; ++i) {
    const auto time = (100 + i) * kSecond;
    const std::string pixels(2000 + i, static_cast<char>('a' + i));
    all.push_back({"/color", ros1 ? "sensor_msgs/Image" : "sensor_msgs/msg/Image",
                   camera.image(100 + i, 7, 20, 10, "rgb8", 3, pixels), time});
    all.push_back({"/joints", ros1 ? "sensor_msgs/JointState" : "sensor_msgs/msg/JointState",
                   "joints", time + 1});
    all.push_back({"/depth", ros1 ? "sensor_msgs/Image" : "sensor_msgs/msg/Image",
                   camera.image(100 + i, 9, 20, 10, "16UC1", 2, pixels), time + 2});
  }
  return all;
}

void expect_all_messages(RecordingFile& file, const std::vector<TestMessage>& written) {
  const RecordingIndex& index = file.index();
  EXPECT_THAT(index.warnings, IsEmpty());
  ASSERT_THAT(index.topics, SizeIs(3));
  EXPECT_EQ(index.topics[0].name, "/color");
  EXPECT_EQ(index.topics[0].type, "sensor_msgs/Image");
  EXPECT_EQ(index.topics[1].messages, 5U);
  EXPECT_EQ(index.topics[1].first_time, 100 * kSecond + 1);
  EXPECT_EQ(index.topics[1].last_time, 104 * kSecond + 1);
  ASSERT_THAT(index.messages, SizeIs(10));
  std::size_t next = 0;
  for (const TestMessage& message : written) {
    if (message.topic == "/joints") continue;
    const MessageEntry& entry = index.messages[next++];
    EXPECT_EQ(index.topics[entry.topic].name, message.topic);
    EXPECT_EQ(entry.log_time, message.time);
    EXPECT_EQ(entry.stamp, message.time / kSecond * kSecond + (message.topic == "/color" ? 7 : 9));
    EXPECT_EQ(ByteCursor::as_text(file.read(entry)), message.data);
  }
}

TEST(RecordingFile, ReadsBagsOfEveryCompressionWithAndWithoutIndex) {
  const TestFolder folder;
  const auto written = messages(Kind::kRos1);
  for (const char* compression : {"none", "bz2", "lz4"}) {
    for (const bool index : {false, true}) {
      SCOPED_TRACE(fmt::format("{} {}", compression, index));
      const auto path = folder.write("a.bag", test::bag_of(written, compression, 4, index));
      expect_all_messages(*open_recording_file(path), written);
    }
  }
}

TEST(RecordingFile, ReadsMcapFilesOfEveryCompressionWithAndWithoutChunks) {
  const TestFolder folder;
  for (const Kind kind : {Kind::kLittleCdr, Kind::kBigCdr, Kind::kRos1}) {
    const auto written = messages(kind);
    const std::string encoding = kind == Kind::kRos1 ? "ros1" : "cdr";
    for (const char* compression : {"", "lz4", "zstd"}) {
      for (const std::size_t per_chunk : {0, 1, 4}) {
        for (const bool summary : {false, true}) {
          SCOPED_TRACE(fmt::format("{} '{}' {} {}", encoding, compression, per_chunk, summary));
          const auto path = folder.write(
              "a.mcap", test::mcap_of(written, encoding, compression, per_chunk, summary));
          expect_all_messages(*open_recording_file(path), written);
        }
      }
    }
  }
}

TEST(RecordingFile, ReadsSqliteFilesAndMessagesThatAreCompressed) {
  const TestFolder folder;
  auto written = messages(Kind::kLittleCdr);
  expect_all_messages(*open_recording_file(folder.write_sqlite("a.db3", written)), written);
  auto compressed = written;
  for (TestMessage& message : compressed)
    if (message.topic != "/joints") message.data = test::compressed("zstd", message.data);
  expect_all_messages(*open_recording_file(folder.write_sqlite("b.db3", compressed)), written);
}

TEST(RecordingFile, TruncatedFilesAreReadAsFarAsTheyGoAndSaySo) {
  const TestFolder folder;
  const auto ros1 = messages(Kind::kRos1), cdr = messages(Kind::kLittleCdr);
  const std::vector<std::string> files{
      test::bag_of(ros1, "none", 4, true),      test::bag_of(ros1, "lz4", 4, true),
      test::bag_of(ros1, "bz2", 1, true),       test::mcap_of(cdr, "cdr", "", 0, true),
      test::mcap_of(cdr, "cdr", "", 4, true),   test::mcap_of(cdr, "cdr", "zstd", 4, true),
      test::mcap_of(cdr, "cdr", "lz4", 4, true)};
  for (std::size_t i = 0; i < files.size(); ++i) {
    SCOPED_TRACE(i);
    const std::size_t header = i < 3 ? 4200 : 100;  // The header of a bag has 4096 bytes.
    const std::size_t end = header + (files[i].size() - header) * 6 / 10;
    const auto file = open_recording_file(folder.write("cut", files[i].substr(0, end)));
    ASSERT_THAT(file->index().warnings, SizeIs(1));
    EXPECT_THAT(file->index().warnings[0], HasSubstr("truncated"));
    EXPECT_GE(file->index().messages.size(), 2U);
    EXPECT_LT(file->index().messages.size(), 10U);
    for (const MessageEntry& entry : file->index().messages) file->read(entry);
  }
  const auto sqlite = folder.write_sqlite("cut.db3", cdr);
  std::filesystem::resize_file(sqlite, std::filesystem::file_size(sqlite) / 4096 / 2 * 4096);
  const auto file = open_recording_file(sqlite);
  ASSERT_THAT(file->index().warnings, SizeIs(1));
  EXPECT_THAT(file->index().warnings[0], HasSubstr("truncated or damaged"));
}

TEST(RecordingFile, OtherFilesAreErrorsThatNameTheFix) {
  const TestFolder folder;
  const auto open = [&](const std::string& bytes) {
    const auto path = folder.write("x", bytes);
    return error_of([&] { open_recording_file(path); });
  };
  EXPECT_THAT(open(""), HasSubstr("is not a recording"));
  EXPECT_THAT(open("PNG"), HasSubstr("is not a recording"));
  EXPECT_THAT(open("#ROSBAG V1.2\n"), HasSubstr("rosbag fix"));
  for (const auto& [name, fix] : {std::pair("a.bag.gz", "gunzip"),
                                  {"a.ZIP", "unpack it and give the folder"},
                                  {"metadata.yaml", "give the folder that contains it"},
                                  {"a.svo2", "docs/cameras.md"}}) {
    const auto path = folder.write(name, "PK");
    EXPECT_THAT(error_of([&] { open_recording_file(path); }), HasSubstr(fix)) << name;
  }
  EXPECT_THAT(open(test::compressed("zstd", "file")),
              HasSubstr("is compressed, and its content is not a recording"));
  EXPECT_THAT(open(test::compressed("zstd", test::compressed("zstd", "file"))),
              HasSubstr("unzstd"));
  EXPECT_THAT(open(test::compressed("zstd", std::string(1 << 22, 'x'))),
              HasSubstr("more than 1000 times"));
  EXPECT_THAT(open("SQLite format 3"), HasSubstr("rosbag2"));
  EXPECT_THAT(error_of([&] { open_recording_file(folder.path("missing")); }),
              HasSubstr("no such file"));
  EXPECT_THAT(error_of([&] { open_recording_file("/dev/zero"); }), HasSubstr("regular file"));
}

TEST(RecordingFile, DeclaredSizesAreCheckedBeforeMemoryIsTaken) {
  const TestFolder folder;
  const auto chunk = [&](std::uint64_t size, const std::string& data) {
    const std::string body = std::string(16, '\0') + test::le(size) + test::le(std::uint32_t{0}) +
                             test::with_length32("zstd") +
                             test::le(static_cast<std::uint64_t>(data.size())) + data;
    return std::string("\x89MCAP0\r\n", 8) + '\x06' +
           test::le(static_cast<std::uint64_t>(body.size())) + body;
  };
  const auto file = open_recording_file(
      folder.write("bomb.mcap", chunk(std::uint64_t{1} << 60, test::compressed("zstd", "x"))));
  EXPECT_THAT(file->index().warnings, ElementsAre(HasSubstr("a chunk is not read")));
  const auto other = open_recording_file(
      folder.write("short.mcap", chunk(kLargestChunk, test::compressed("zstd", "x"))));
  EXPECT_THAT(other->index().warnings, ElementsAre(HasSubstr("a chunk is damaged")));
}

TEST(Recording, JoinsTheFilesOfAFolderInTheirOrder) {
  const TestFolder folder;
  const auto written = messages(Kind::kLittleCdr);
  folder.write("rec_10.mcap",
               test::mcap_of({written.begin() + 6, written.end()}, "cdr", "", 0, true));
  folder.write("rec_9.mcap",
               test::mcap_of({written.begin(), written.begin() + 6}, "cdr", "", 0, true));
  ASSERT_TRUE(is_recording(folder.path("")));
  Recording recording(folder.path(""));
  ASSERT_THAT(recording.messages(), SizeIs(10));
  EXPECT_EQ(recording.topics()[*recording.find_topic("/joints")].messages, 5U);
  EXPECT_NEAR(recording.duration(), 4, 1e-6);
  for (std::size_t i = 1; i < 10; ++i)
    EXPECT_LT(recording.messages()[i - 1].log_time, recording.messages()[i].log_time);
  EXPECT_EQ(ByteCursor::as_text(recording.read(recording.messages().back())), written.back().data);
}

std::string content_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(Recording, FilesThatAreCompressedAsAWholeAreRead) {
  const TestFolder folder;
  const auto written = messages(Kind::kLittleCdr);
  const auto plain = folder.write_sqlite("rec_0.db3", written);
  folder.write("rec_0.db3.zstd", test::compressed("zstd", content_of(plain)));
  EXPECT_THAT(Recording(folder.path("")).messages(), SizeIs(10));  // not both
  std::filesystem::remove(plain);
  ASSERT_TRUE(is_recording(folder.path("")));
  expect_all_messages(*open_recording_file(folder.path("rec_0.db3.zstd")), written);
  const std::string bytes = test::mcap_of(written, "cdr", "", 0, true);
  folder.write("rec_1.mcap.zstd", test::compressed("zstd", bytes));
  Recording both(folder.path(""));
  ASSERT_THAT(both.messages(), SizeIs(20));
  EXPECT_EQ(ByteCursor::as_text(both.read(both.messages().back())), written.back().data);
}

TEST(Recording, ACompressedFileOfATruncatedOneIsReadAsFarAsItGoes) {
  const TestFolder folder;
  const auto written = messages(Kind::kLittleCdr);
  const std::string bytes = test::mcap_of(written, "cdr", "", 0, false);
  const std::string half = test::compressed("zstd", bytes.substr(0, bytes.size() / 2));
  const auto file = open_recording_file(folder.write("cut.mcap.zstd", half));
  EXPECT_THAT(file->index().warnings, ElementsAre(HasSubstr("truncated")));
  EXPECT_GE(file->index().messages.size(), 2U);
}

TEST(Recording, FilesThatMetadataListsAndTheFolderLacksAreTold) {
  const TestFolder folder;
  const auto written = messages(Kind::kLittleCdr);
  folder.write("rec_0.mcap", test::mcap_of(written, "cdr", "", 0, true));
  const std::string head = "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n";
  folder.write("metadata.yaml", head + "    - rec_0.mcap.zstd\n  files:\n    - path: x\n");
  EXPECT_THAT(Recording(folder.path("")).warnings(), IsEmpty());
  folder.write("metadata.yaml", head + "    - rec/rec_0.mcap\n    - \"rec_1.mcap\"\n");
  EXPECT_THAT(Recording(folder.path("")).warnings(),
              ElementsAre(::testing::AllOf(HasSubstr("lacks 1 of 2 files"),
                                           HasSubstr("metadata.yaml lists rec_1.mcap"))));
}

TEST(Recording, SecondsAreTheNumbersThatTextWithTheSameDigitsGives) {
  EXPECT_EQ(seconds_of(1305031102175304000), 1305031102.175304);
  EXPECT_EQ(seconds_of(1341846434710184123), std::strtod("1341846434.710184123", nullptr));
  EXPECT_EQ(seconds_of(-1500000000), -1.5);
  std::mt19937_64 random(3);
  for (int i = 0; i < 10000; ++i) {
    const auto ns = static_cast<std::int64_t>(random() % (2'000'000'000 * std::uint64_t{kSecond}));
    const auto text = fmt::format("{}.{:09}", ns / kSecond, ns % kSecond);
    EXPECT_EQ(seconds_of(ns), std::strtod(text.c_str(), nullptr)) << text;
  }
}

}  // namespace
}  // namespace stillmap
