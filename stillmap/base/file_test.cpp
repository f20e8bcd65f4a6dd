// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/file.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/field_text.hpp"
#include "stillmap/base/test_path.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::string problem_of(const fs::path& file, std::uintmax_t largest) {
  try {
    read_file(file, largest);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(ReadFile, RefusesALargeFileBeforeItTakesMemory) {
  const fs::path file = test::own_path("large");
  std::ofstream(file) << "text";
  EXPECT_EQ(problem_of(file, 4), "");
  fs::resize_file(file, std::uintmax_t{40} << 30);  // A file with a hole takes no space.
  EXPECT_THAT(problem_of(file, kLargestText), HasSubstr("has 40960 MB, at most 256 are read"));
  fs::remove(file);
}

TEST(WriteFile, DoesNotFollowALinkOfTheTemporaryName) {
  const fs::path file = test::own_path("result"), precious = test::own_path("precious");
  std::ofstream(precious) << "mine";
  fs::create_symlink(precious, file.string() + ".part");
  write_file(file, "result");
  EXPECT_EQ(read_file(precious), "mine");
  EXPECT_EQ(read_file(file), "result");
  EXPECT_FALSE(fs::is_symlink(file));
  fs::remove(file);
  fs::remove(precious);
}

TEST(FieldText, HasNeitherLinesNorColumns) {
  EXPECT_EQ(field_text("person\nend_header\r,x"), "person end_header  x");
  EXPECT_EQ(field_text("K\u00fchlschrank"), "K\u00fchlschrank");
}

}  // namespace
}  // namespace stillmap
