// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/journal_file.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

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

TEST_F(JournalFile, IsReplacedByOneRecordAndGoesOn) {
  JournalWriter writer(file_);
  writer.append(second_);
  const std::uint64_t before = writer.size();
  writer.replace_all("one");
  writer.append("two");
  EXPECT_THAT(read_journal(file_), ElementsAre("one", "two"));
  EXPECT_LT(writer.size(), before);
  EXPECT_EQ(writer.size(), std::filesystem::file_size(file_));
  EXPECT_FALSE(std::filesystem::exists(file_.string() + ".part"));
}

TEST_F(JournalFile, OfAnotherKindOrVersionIsRefused) {
  EXPECT_THROW(read("STILLMAP, but no journal"), Error);
  EXPECT_THROW(read(""), Error);
  const std::string newer = std::string(kJournalMagic) + std::string("\2\0\0\0", 4);
  EXPECT_THROW(read(newer), Error);
  EXPECT_FALSE(is_journal("no/such/file"));
}

TEST(JournalWriter, TellsThatAFileCannotBeWritten) {
  EXPECT_THROW(JournalWriter("no/such/folder/run.journal"), Error);
  EXPECT_THROW(JournalWriter("/dev/full"), Error);
}

}  // namespace
}  // namespace stillmap
