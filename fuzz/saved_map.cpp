// SPDX-License-Identifier: Apache-2.0
// The sections of saved maps, not compressed: name (4 bytes), size (4) and content of each.
#include "stillmap/pipeline/saved_map.hpp"

#include "stillmap/base/bytes.hpp"
#include "stillmap/map/map_file.hpp"

#include "fuzz/fuzz_target.hpp"
#include "fuzz/small_map.hpp"

namespace {

using namespace stillmap;

std::vector<Section> sections_in(std::string_view input) {
  std::vector<Section> sections;
  ByteReader in(input, "input", "");
  while (in.left() >= 8) {
    Section section{in.get<std::array<char, 4>>(), {}};
    const auto size = std::min<std::size_t>(in.get<std::uint32_t>(), in.left());
    const std::vector<char> content = in.get_list<char>(size);
    section.bytes.assign(content.begin(), content.end());
    sections.push_back(std::move(section));
  }
  return sections;
}

}  // namespace

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  const SavedMap saved{"fuzz", small_map().content(), {small_view()}};
  ByteWriter out;
  for (const Section& section : unpack_sections(kMapFormat, saved_map_bytes(saved), "seed")) {
    out.put(section.name);
    out.put_text(section.bytes);
  }
  return {out.bytes()};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  auto sections = sections_in(fuzz::text_of(data, size));
  if (sections.size() > 64) return 0;
  const std::string file = pack_sections(kMapFormat, sections);
  fuzz::parse([&] {
    // A map that was read is written such that it is read again, and can be extended.
    const SavedMap saved = saved_map_from_bytes(file, "input");
    const std::string written = saved_map_bytes(saved);
    if (saved_map_bytes(saved_map_from_bytes(written, "copy")) != written) std::abort();
    const Map map(saved.map);
    if (map.keyframe_count() != saved.map.keyframes.size()) std::abort();
  });
  return 0;
}
