// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/unicode.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace std::string_literals;

TEST(AsUtf8, ByteOrderMarksAreRemoved) {
  EXPECT_EQ(as_utf8("\xEF\xBB\xBF#"), "#");
  EXPECT_EQ(as_utf8("1 rgb/\xC3\xA9.png"), "1 rgb/\xC3\xA9.png");
  EXPECT_EQ(as_utf8(""), "");
}

TEST(AsUtf8, LinesThatEndWithCarriageReturnsAloneAreLines) {
  EXPECT_EQ(as_utf8("a\rb\r"), "a\nb\n");
  EXPECT_EQ(as_utf8("a\r\nb\r\n"), "a\r\nb\r\n");
}

TEST(AsUtf8, Utf16OfBothByteOrdersIsConverted) {
  const std::string expected = "1 \xC3\xA9\xE2\x82\xAC\xF0\x9F\x98\x80";  // one to four bytes
  EXPECT_EQ(as_utf8("\xFF\xFE"
                    "1\0 \0\xE9\0\xAC\x20\x3D\xD8\x00\xDE"s),
            expected);
  EXPECT_EQ(as_utf8("\xFE\xFF"
                    "\0001\0 \0\xE9\x20\xAC\xD8\x3D\xDE\x00"s),
            expected);
}

TEST(AsUtf8, HalvesOfSurrogatesAndOddBytesAreReplaced) {
  EXPECT_EQ(as_utf8("\xFF\xFE\x3D\xD8"
                    "1\0x"s),
            "\xEF\xBF\xBD"
            "1");
  EXPECT_EQ(as_utf8("\xFF\xFE\x00\xDE"s), "\xEF\xBF\xBD");
}

}  // namespace
}  // namespace stillmap
