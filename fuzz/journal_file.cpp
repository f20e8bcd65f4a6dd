// SPDX-License-Identifier: Apache-2.0
// Files of compressed records, checksums corrected.
#include "stillmap/base/journal_file.hpp"

#include "stillmap/base/bytes.hpp"
#include "stillmap/base/deflate.hpp"

#include <cstring>

#include "fuzz/fuzz_target.hpp"

namespace {

using namespace stillmap;

constexpr std::size_t kHeader = 12, kNumbers = 16;  // [bytes]

/// Returns the file with the right checksum of each record, as far as its numbers can be followed.
std::string with_checksums(std::string file) {
  for (std::size_t at = kHeader; at + kNumbers + 4 <= file.size();) {
    std::uint64_t packed = 0;
    std::memcpy(&packed, &file[at], sizeof packed);
    const std::size_t begin = at + kNumbers + 4;
    if (packed > file.size() - begin) break;
    const std::uint32_t checksum =
        crc32(file.substr(at, kNumbers) + file.substr(begin, static_cast<std::size_t>(packed)));
    std::memcpy(&file[at + kNumbers], &checksum, sizeof checksum);
    at = begin + static_cast<std::size_t>(packed);
  }
  return file;
}

}  // namespace

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  const auto file = file_with("", "seed.journal");
  JournalWriter writer(file);
  writer.append("a first record");
  writer.append(std::string(300, 'x'));
  return {content_of(file)};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto file =
      fuzz::file_with(with_checksums(std::string(fuzz::text_of(data, size))), "input.journal");
  fuzz::parse([&] {
    JournalReader reader(file);
    while (reader.next()) {
    }
  });
  return 0;
}
