// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/section_file.hpp"

#include "stillmap/base/bytes.hpp"
#include "stillmap/base/error.hpp"

#include <libdeflate.h>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using ::testing::HasSubstr;

constexpr SectionFormat kFormat{"TESTFILE", 3, "test file", "make one anew"};

std::vector<Section> sections() {
  std::string noise;
  for (unsigned i = 0; i < 300; ++i) noise.push_back(static_cast<char>(i * i * 2654435761U >> 13));
  return {{{'H', 'E', 'A', 'D'}, noise},
          {{'N', 'O', 'N', 'E'}, ""},
          {{'L', 'O', 'N', 'G'}, std::string(5000, 'x')}};
}

/// Returns the error message for these bytes; empty if they are valid.
std::string error_of(const std::string& bytes) {
  try {
    unpack_sections(kFormat, bytes, "some.file");
  } catch (const Error& e) {
    EXPECT_EQ(e.where(), "some.file");
    EXPECT_FALSE(e.fix().empty());
    return e.what();
  }
  return "";
}

TEST(SectionFile, RoundTripKeepsAllSections) {
  const std::string bytes = pack_sections(kFormat, sections());
  EXPECT_EQ(unpack_sections(kFormat, bytes, ""), sections());
  EXPECT_EQ(bytes, pack_sections(kFormat, sections())) << "the same input gives the same bytes";
  EXPECT_LT(bytes.size(), 600U) << "5300 bytes with much repetition";
  EXPECT_TRUE(unpack_sections(kFormat, pack_sections(kFormat, {}), "").empty());
}

TEST(SectionFile, EveryAlteredByteIsAnError) {
  const std::string bytes = pack_sections(kFormat, sections());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    for (const int bits : {0x01, 0x80, 0xff}) {
      std::string altered = bytes;
      altered[i] = static_cast<char>(altered[i] ^ bits);
      EXPECT_NE(error_of(altered), "") << "byte " << i;
    }
  }
}

TEST(SectionFile, EveryWrongLengthIsAnError) {
  const std::string bytes = pack_sections(kFormat, sections());
  EXPECT_THAT(error_of(""), HasSubstr("not a test file"));
  for (std::size_t size = 1; size < bytes.size(); ++size) {
    EXPECT_THAT(error_of(bytes.substr(0, size)), HasSubstr("truncated")) << size;
  }
  EXPECT_THAT(error_of(bytes + "!"), HasSubstr("1 bytes too many"));
}

TEST(SectionFile, OtherKindsAndVersionsAreErrors) {
  EXPECT_THAT(error_of("ply\nformat binary"), HasSubstr("is not a test file of this program"));
  SectionFormat newer = kFormat;
  newer.version = 4;
  EXPECT_THAT(error_of(pack_sections(newer, sections())),
              HasSubstr("version 4, and this program reads version 3"));
}

TEST(SectionFile, OlderVersionsAreReadDownToTheOldest) {
  SectionFormat format = kFormat;
  format.version = 5;
  format.oldest = 3;
  EXPECT_EQ(unpack_sections(format, pack_sections(kFormat, sections()), ""), sections());
  format.oldest = 4;
  EXPECT_THROW(unpack_sections(format, pack_sections(kFormat, sections()), ""), Error);
}

TEST(SectionFile, IsWrittenAndReadSectionBySection) {
  std::stringstream file;
  SectionWriter writer(kFormat, file, sections().size());
  for (const Section& section : sections()) writer.add(section);
  writer.finish();
  EXPECT_EQ(file.str(), pack_sections(kFormat, sections()));
  SectionReader reader(kFormat, file, "some.file");
  EXPECT_EQ(reader.version(), kFormat.version);
  for (const Section& section : sections()) EXPECT_EQ(reader.next(), section);
  EXPECT_EQ(reader.next(), std::nullopt);
}

TEST(SectionFile, AlteredPartsAreNamed) {
  std::string bytes = pack_sections(kFormat, sections());
  bytes.back() = static_cast<char>(bytes.back() ^ 1);
  EXPECT_THAT(error_of(bytes), HasSubstr("section LONG"));
  bytes[30] = static_cast<char>(bytes[30] ^ 1);
  EXPECT_THAT(error_of(bytes), HasSubstr("header"));
}

TEST(Bytes, RoundTripInAnyOrder) {
  const std::vector<double> numbers = {1.5, -2.25, 1e300};
  ByteWriter out;
  out.put<std::uint16_t>(7);
  out.put_text("seven");
  out.put_list(std::span<const double>(numbers));
  out.put_planes(std::span<const double>(numbers));
  const std::string& bytes = out.bytes();
  ByteReader in(bytes, "", "");
  EXPECT_EQ(in.get<std::uint16_t>(), 7);
  EXPECT_EQ(in.get_text(), "seven");
  EXPECT_EQ(in.get_list<double>(3), numbers);
  EXPECT_EQ(in.get_planes<double>(3), numbers);
  EXPECT_NO_THROW(in.expect_end());
}

TEST(Bytes, ReadingBeyondTheEndIsAnError) {
  const std::string bytes(10, '\x7f');
  ByteReader in(bytes, "file", "fix");
  EXPECT_THROW(in.get_list<double>(2), Error);
  EXPECT_THROW(in.get_planes<double>(std::size_t{1} << 61), Error)
      << "eight times this count overflows to 0";
  EXPECT_THROW(in.get_text(), Error);
  EXPECT_THROW(in.expect_end(), Error);
}

/// Returns a file of one section of these compressed bytes that declares a plain size.
std::string declaring(const std::string& packed, std::uint64_t plain) {
  ByteWriter out;
  out.put_list(std::span(kFormat.magic));
  out.put(kFormat.version);
  out.put(std::uint32_t{1});
  out.put(std::uint64_t{24 + 24 + 4 + packed.size()});
  out.put_list(std::span<const char>("BOMB", 4));
  out.put(libdeflate_crc32(0, packed.data(), packed.size()));
  out.put(std::uint64_t{packed.size()});
  out.put(plain);
  out.put(libdeflate_crc32(0, out.bytes().data(), out.bytes().size()));
  return out.bytes() + packed;
}

TEST(SectionFile, ASmallFileTakesLittleMemory) {
  // Two million zeros become two kilobytes; they are stored instead, so that they can be read.
  const std::vector<Section> zeros{{{'Z', 'E', 'R', 'O'}, std::string(2'000'000, '\0')}};
  const std::string stored = pack_sections(kFormat, zeros);
  EXPECT_GT(stored.size(), 2'000'000U);
  EXPECT_EQ(unpack_sections(kFormat, stored, ""), zeros);
  const std::string packed(1000, 'x');
  EXPECT_THAT(error_of(declaring(packed, 1'000'000)), HasSubstr("declares more data"));
  EXPECT_THAT(error_of(declaring(packed, 10'000)), HasSubstr("cannot be decompressed"));
}

}  // namespace
}  // namespace stillmap
