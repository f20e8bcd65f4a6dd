// SPDX-License-Identifier: Apache-2.0
// Files of compressed sections, such as saved maps. Their checksums are corrected, since no varied
// input would pass them.
#include "stillmap/base/section_file.hpp"

#include <cstring>
#include <libdeflate.h>

#include "fuzz/fuzz_target.hpp"

namespace {

constexpr stillmap::SectionFormat kFormat{"FUZZFILE", 1, "test file", "make it again"};

template <typename T>
T get(const std::string& bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

template <typename T>
void set(std::string& bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

/// Corrects size and checksums of the file: the layout is in section_file.hpp.
void set_checksums(std::string& file) {
  constexpr std::size_t kPreamble = 24, kEntry = 24;  // bytes
  if (file.size() < kPreamble + 4) return;
  set<std::uint64_t>(file, 16, file.size());
  const std::size_t table_end = kPreamble + kEntry * get<std::uint32_t>(file, 12);
  if (table_end > file.size() - 4) return;
  std::size_t at = table_end + 4;
  for (std::size_t entry = kPreamble; entry < table_end; entry += kEntry) {
    const auto packed = get<std::uint64_t>(file, entry + 8);
    if (packed > file.size() - at) break;
    set(file, entry + 4, libdeflate_crc32(0, file.data() + at, packed));
    at += packed;
  }
  set(file, table_end, libdeflate_crc32(0, file.data(), table_end));
}

}  // namespace

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  return {pack_sections(kFormat, {{{'A', 'B', 'C', 'D'}, "text text text text"},
                                  {{'E', 'F', 'G', 'H'}, std::string(3000, 'x')}}),
          pack_sections(kFormat, {})};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace stillmap;
  std::string file(fuzz::text_of(data, size));
  set_checksums(file);
  fuzz::parse([&] { unpack_sections(kFormat, file, "input"); });
  return 0;
}
