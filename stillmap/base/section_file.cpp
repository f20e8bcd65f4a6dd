// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/section_file.hpp"

#include "stillmap/base/bytes.hpp"
#include "stillmap/base/deflate.hpp"
#include "stillmap/base/error.hpp"

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr std::size_t kMagic = 8;
constexpr std::size_t kPreamble = 24;       // Size of the header in front of the table [bytes].
constexpr std::uint32_t kMaxSections = 64;  // Larger numbers are treated as corruption.
constexpr int kLevel = 6;                   // libdeflate's default

/// Table entry of a section.
struct Entry {
  std::array<char, 4> name = {};
  std::uint32_t checksum = 0;
  std::uint64_t packed = 0, plain = 0;
};
static_assert(sizeof(Entry) == 24);

std::string name_of(const Entry& entry) { return {entry.name.data(), entry.name.size()}; }

/// Parser of the file, front to back.
class Unpacker {
 public:
  Unpacker(const SectionFormat& format, std::string_view bytes, const std::string& where)
      : format_(format), bytes_(bytes), where_(where) {}

  std::vector<Section> run() {
    check_kind();
    const std::vector<Entry> table = read_table();
    std::vector<Section> sections;
    for (const Entry& entry : table) {
      sections.push_back({entry.name, unpack(entry, bytes_.substr(at_, entry.packed))});
      at_ += entry.packed;
    }
    return sections;
  }

 private:
  [[noreturn]] void fail(const std::string& problem) const {
    throw Error(problem, where_, fmt::format("copy the file again, or {}", format_.remake));
  }
  [[noreturn]] void fail_short(std::uint64_t wanted) const {
    fail(fmt::format("is truncated: {} of {} bytes are present", bytes_.size(), wanted));
  }

  template <typename T>
  T number_at(std::size_t offset) const {
    T value;
    std::memcpy(&value, bytes_.data() + offset, sizeof value);
    return value;
  }

  void check_kind() const {
    const auto magic = bytes_.substr(0, kMagic);
    if (!format_.magic.starts_with(magic) || magic.empty()) {
      throw Error(fmt::format("is not a {} of this program", format_.name), where_,
                  fmt::format("give another file, or {}", format_.remake));
    }
    if (bytes_.size() < kPreamble) fail_short(kPreamble);
    const auto version = number_at<std::uint32_t>(kMagic);
    if (version == format_.version) return;
    throw Error(fmt::format("is a {} of version {}, and this program reads version {}",
                            format_.name, version, format_.version),
                where_, fmt::format("use the program that wrote it, or {}", format_.remake));
  }

  std::vector<Entry> read_table() {
    const auto size = number_at<std::uint64_t>(16);
    if (bytes_.size() < size) fail_short(size);
    const auto count = number_at<std::uint32_t>(12);
    const std::size_t end = kPreamble + sizeof(Entry) * std::min(count, kMaxSections + 1);
    if (count > kMaxSections || bytes_.size() < end + 4 ||
        crc32(bytes_.substr(0, end)) != number_at<std::uint32_t>(end)) {
      fail("is corrupt: the checksum of its header is wrong");
    }
    if (bytes_.size() > size) fail(fmt::format("has {} bytes too many", bytes_.size() - size));
    std::vector<Entry> table(count);
    if (count > 0) std::memcpy(table.data(), bytes_.data() + kPreamble, end - kPreamble);
    at_ = end + 4;
    std::uint64_t left = bytes_.size() - at_;
    for (const Entry& entry : table) {
      if (entry.packed > left) fail("declares more data than it contains");
      left -= entry.packed;
    }
    if (left != 0) fail("contains more data than it declares");
    return table;
  }

  std::string unpack(const Entry& entry, std::string_view packed) const {
    if (crc32(packed) != entry.checksum) {
      fail(fmt::format("is corrupt: the checksum of section {} (bytes {} to {}) is wrong",
                       name_of(entry), at_, at_ + packed.size()));
    }
    if (entry.plain > largest_inflated(entry.packed)) fail("declares more data than it contains");
    auto plain = inflated(packed, entry.plain);
    if (!plain) fail(fmt::format("cannot be decompressed: section {}", name_of(entry)));
    return std::move(*plain);
  }

  const SectionFormat& format_;
  std::string_view bytes_;
  const std::string& where_;
  std::size_t at_ = 0;  // Position of the first section that is not decompressed yet.
};

}  // namespace

std::string pack_sections(const SectionFormat& format, std::vector<Section> sections) {
  std::vector<Entry> table;
  std::string body;
  for (Section& section : sections) {
    const std::string plain = std::move(section.bytes);
    const std::string packed = deflated(plain, kLevel);
    table.push_back({section.name, crc32(packed), packed.size(), plain.size()});
    body += packed;
  }
  ByteWriter out;
  out.put_list(std::span(format.magic).first(kMagic));
  out.put(format.version);
  out.put(static_cast<std::uint32_t>(table.size()));
  out.put(std::uint64_t{kPreamble + sizeof(Entry) * table.size() + 4 + body.size()});
  out.put_list(std::span<const Entry>(table));
  out.put(crc32(out.bytes()));
  return out.bytes() + body;
}

std::vector<Section> unpack_sections(const SectionFormat& format, std::string_view bytes,
                                     const std::string& where) {
  return Unpacker(format, bytes, where).run();
}

}  // namespace stillmap
