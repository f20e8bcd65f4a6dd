// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/journal_file.hpp"

#include "stillmap/base/bytes.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"

#include <span>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<std::string> read_journal(const std::filesystem::path& file) {
  JournalReader reader(file);
  std::vector<std::string> records;
  while (auto record = reader.next()) records.push_back(std::move(*record));
  return records;
}

class JournalFile : public ::testing::Test {
 protected:
  void SetUp() override {
    JournalWriter writer(file_);
    for (const std::string& record : {first_, second_}) writer.append(record);
  }
  void TearDown() override { std::filesystem::remove(file_); }
  std::vector<std::string> read(const std::string& bytes) const {
    write_file(file_, bytes);
    return read_journal(file_);
  }

  const std::filesystem::path file_ = test::own_path("run.journal");
  const std::string first_ = "first record", second_ = std::string(100000, 'x') + "end";
};

TEST_F(JournalFile, HasAllRecords) {
  EXPECT_TRUE(is_journal(file_));
  EXPECT_THAT(read_journal(file_), ElementsAre(first_, second_));
}

TEST_F(JournalFile, HasTheFirstRecordWhereverTheSecondIsTruncated) {
  const std::string whole = read_file(file_);
  JournalWriter(file_).append(first_);
  const std::size_t first_end = std::filesystem::file_size(file_);
  for (std::size_t size = first_end; size < whole.size(); ++size)
    EXPECT_THAT(read(whole.substr(0, size)), ElementsAre(first_)) << size;
  EXPECT_THAT(read(whole.substr(0, first_end - 1)), IsEmpty());
}

TEST_F(JournalFile, EndsBeforeAnAlteredByte) {
  const std::string whole = read_file(file_);
  for (std::size_t at = 12; at < whole.size(); ++at) {
    std::string altered = whole;
    altered[at] = static_cast<char>(altered[at] ^ 0x10);
    EXPECT_LT(read(altered).size(), 2U) << at;
  }
}

/// Returns JournalReader::lost() at the end of a file with these bytes.
std::uint64_t lost_of(const std::filesystem::path& file, const std::string& bytes) {
  write_file(file, bytes);
  JournalReader reader(file);
  while (reader.next()) continue;
  return reader.lost();
}

TEST_F(JournalFile, TellsTheBytesBehindAnAlteredRecordButNotATruncatedOne) {
  const std::string whole = read_file(file_);
  EXPECT_EQ(lost_of(file_, whole), 0U);
  EXPECT_EQ(lost_of(file_, whole.substr(0, whole.size() - 1)), 0U);
  std::string altered = whole;
  altered[12 + 20] = static_cast<char>(altered[12 + 20] ^ 0x10);  // first byte of the first record
  EXPECT_EQ(lost_of(file_, altered), whole.size() - 12);
}

TEST_F(JournalFile, IsReplacedByOtherRecordsAndGoesOn) {
  JournalWriter writer(file_);
  writer.append(second_);
  const std::uint64_t before = writer.size();
  writer.replace_all([](JournalWriter& next) {
    next.append("one");
    next.append("two");
  });
  writer.append("three");
  EXPECT_THAT(read_journal(file_), ElementsAre("one", "two", "three"));
  EXPECT_LT(writer.size(), before);
  EXPECT_EQ(writer.size(), std::filesystem::file_size(file_));
  EXPECT_FALSE(std::filesystem::exists(file_.string() + ".part"));
}

TEST_F(JournalFile, OfAnotherKindOrVersionIsRefused) {
  EXPECT_THROW(read("STILLMAP, but no journal"), Error);
  EXPECT_THROW(read(""), Error);
  for (const std::uint32_t version : {kJournalVersion - 1, kJournalVersion + 1}) {
    ByteWriter out;
    out.put_list(std::span(kJournalMagic));
    out.put(version);
    EXPECT_THROW(read(out.take()), Error) << version;
  }
  EXPECT_FALSE(is_journal("no/such/file"));
}

TEST(JournalWriter, TellsThatAFileCannotBeWritten) {
  EXPECT_THROW(JournalWriter("no/such/folder/run.journal"), Error);
  EXPECT_THROW(JournalWriter("/dev/full"), Error);
}

}  // namespace
}  // namespace stillmap
