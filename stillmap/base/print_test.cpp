// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/print.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

TEST(Fitted, LinesAreBrokenAtBlanksAndContinueTwoCharactersToTheRight) {
  EXPECT_EQ(fitted("stillmap: no such file\n  fix: name another file\n", 18),
            "stillmap: no such\n  file\n  fix: name\n    another file\n");
}

TEST(Fitted, LinesThatFitKeepTheirBlanks) {
  const std::string table = "name   RMSE   mean\na      0.10   0.20\n\n";
  EXPECT_EQ(fitted(table, 18), table);
}

TEST(Fitted, LinesWithANameContinueBelowTheText) {
  EXPECT_EQ(fitted("WARNING  the depth is too small", 21),
            "WARNING  the depth is\n         too small");
  EXPECT_EQ(fitted("WARNING  the depth is too small", 16), "WARNING  the\n  depth is too\n  small")
      << "where little room is left beside the name";
}

TEST(Fitted, WordsThatAreTooLongStandAlone) {
  EXPECT_EQ(fitted("see /a/long/path/of/a/file for it", 10),
            "see\n  /a/long/path/of/a/file\n  for it");
}

TEST(Fitted, ColorsAndUtf8AreCountedAsTheyAreShown) {
  const std::string shown = "\033[1mbold\033[0m \u00e4\u00f6\u00fc";
  EXPECT_EQ(fitted(shown, 8), shown);
  EXPECT_EQ(fitted(shown, 7), "\033[1mbold\033[0m\n  \u00e4\u00f6\u00fc");
}

TEST(Fitted, LinesOfProgressAreKept) {
  EXPECT_EQ(fitted("\rmapping 1 of 20", 8), "\rmapping 1 of 20");
}

}  // namespace
}  // namespace stillmap
