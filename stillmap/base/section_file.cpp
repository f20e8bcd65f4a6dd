// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/section_file.hpp"

#include "stillmap/base/bytes.hpp"
#include "stillmap/base/deflate.hpp"
#include "stillmap/base/error.hpp"

#include <future>
#include <sstream>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr std::size_t kMagic = 8;
constexpr std::size_t kPreamble = 24;  // Size of the header in front of the table [bytes].
constexpr std::size_t kEntry = 24, kChecksum = 4;
constexpr std::uint32_t kMaxSections = 65536;  // Larger numbers are treated as corruption.
constexpr int kLevel = 6;                      // libdeflate's default

std::size_t header_size(std::size_t sections) { return kPreamble + kEntry * sections + kChecksum; }

template <typename T>
T number_at(std::string_view bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

std::string name_of(const std::array<char, 4>& name) { return {name.data(), name.size()}; }

std::uint64_t size_of(std::istream& in) {
  in.seekg(0, std::ios::end);
  const auto size = static_cast<std::uint64_t>(in.tellg());
  in.seekg(0);
  return size;
}

}  // namespace

SectionWriter::SectionWriter(const SectionFormat& format, std::ostream& out, std::size_t count)
    : format_(format), out_(out), count_(count) {
  static_assert(sizeof(Entry) == kEntry);
  if (count > kMaxSections) {
    throw Error(fmt::format("{} sections are too many for a {}", count, format.name), "",
                "save a smaller one");
  }
  const std::string later(header_size(count), '\0');
  out.write(later.data(), static_cast<std::streamsize>(later.size()));
}

void SectionWriter::add(std::span<const Section> sections) {
  if (!out_) return;
  std::vector<std::future<std::string>> compressed;
  for (const Section& section : sections)
    compressed.push_back(
        std::async(std::launch::async, [&] { return deflated(section.bytes, kLevel); }));
  for (std::size_t i = 0; i < sections.size(); ++i) {
    const std::string packed = compressed[i].get();
    table_.push_back({sections[i].name, crc32(packed), packed.size(), sections[i].bytes.size()});
    out_.write(packed.data(), static_cast<std::streamsize>(packed.size()));
  }
}

void SectionWriter::finish() {
  if (!out_) return;
  if (table_.size() != count_) throw std::logic_error("another number of sections was announced");
  std::uint64_t size = header_size(count_);
  for (const Entry& entry : table_) size += entry.packed;
  ByteWriter header;
  header.put_list(std::span(format_.magic).first(kMagic));
  header.put(format_.version);
  header.put(static_cast<std::uint32_t>(count_));
  header.put(size);
  header.put_list(std::span<const Entry>(table_));
  header.put(crc32(header.bytes()));
  out_.seekp(0);
  out_.write(header.bytes().data(), static_cast<std::streamsize>(header.bytes().size()));
  out_.seekp(0, std::ios::end);
}

SectionReader::SectionReader(const SectionFormat& format, std::istream& in, std::string where)
    : format_(format), in_(in), where_(std::move(where)), size_(size_of(in)) {
  const std::string preamble = read(std::min<std::uint64_t>(size_, kPreamble));
  check_kind(preamble);
  read_table(preamble);
}

void SectionReader::fail(const std::string& problem) const {
  throw Error(problem, where_, fmt::format("copy the file again, or {}", format_.remake));
}

void SectionReader::fail_short(std::uint64_t wanted) const {
  fail(fmt::format("is truncated: {} of {} bytes are present", size_, wanted));
}

std::string SectionReader::read(std::uint64_t size) {
  std::string bytes(size, '\0');
  in_.read(bytes.data(), static_cast<std::streamsize>(size));
  if (static_cast<std::uint64_t>(in_.gcount()) != size) fail("cannot be read");
  return bytes;
}

void SectionReader::check_kind(std::string_view preamble) const {
  const auto magic = preamble.substr(0, kMagic);
  if (!format_.magic.starts_with(magic) || magic.empty()) {
    throw Error(fmt::format("is not a {} of this program", format_.name), where_,
                fmt::format("give another file, or {}", format_.remake));
  }
  if (size_ < kPreamble) fail_short(kPreamble);
  const auto version = number_at<std::uint32_t>(preamble, kMagic);
  const std::uint32_t oldest = format_.oldest == 0 ? format_.version : format_.oldest;
  if (version >= oldest && version <= format_.version) return;
  const std::string read = oldest == format_.version
                               ? fmt::format("version {}", oldest)
                               : fmt::format("versions {} to {}", oldest, format_.version);
  throw Error(
      fmt::format("is a {} of version {}, and this program reads {}", format_.name, version, read),
      where_, fmt::format("use the program that wrote it, or {}", format_.remake));
}

void SectionReader::read_table(std::string_view preamble) {
  version_ = number_at<std::uint32_t>(preamble, kMagic);
  const auto size = number_at<std::uint64_t>(preamble, 16);
  if (size_ < size) fail_short(size);
  const auto count = number_at<std::uint32_t>(preamble, 12);
  if (count > kMaxSections || size_ < header_size(count))
    fail("is corrupt: the checksum of its header is wrong");
  const std::string rest = read(header_size(count) - kPreamble);
  const std::string_view table = std::string_view(rest).substr(0, kEntry * count);
  if (crc32(table, crc32(preamble)) != number_at<std::uint32_t>(rest, table.size()))
    fail("is corrupt: the checksum of its header is wrong");
  if (size_ > size) fail(fmt::format("has {} bytes too many", size_ - size));
  table_.resize(count);
  if (count > 0) std::memcpy(table_.data(), table.data(), table.size());
  at_ = header_size(count);
  std::uint64_t left = size_ - at_;
  for (const auto& entry : table_) {
    if (entry.packed > left) fail("declares more data than it contains");
    left -= entry.packed;
  }
  if (left != 0) fail("contains more data than it declares");
}

std::optional<Section> SectionReader::next() {
  if (read_ == table_.size()) return std::nullopt;
  const auto& entry = table_[read_++];
  const std::string packed = read(entry.packed);
  if (crc32(packed) != entry.checksum) {
    fail(fmt::format("is corrupt: the checksum of section {} (bytes {} to {}) is wrong",
                     name_of(entry.name), at_, at_ + packed.size()));
  }
  at_ += entry.packed;
  if (entry.plain > largest_inflated(entry.packed)) fail("declares more data than it contains");
  auto plain = inflated(packed, entry.plain);
  if (!plain) fail(fmt::format("cannot be decompressed: section {}", name_of(entry.name)));
  return Section{entry.name, std::move(*plain)};
}

std::string pack_sections(const SectionFormat& format, const std::vector<Section>& sections) {
  std::ostringstream out;
  SectionWriter writer(format, out, sections.size());
  for (const Section& section : sections) writer.add(section);
  writer.finish();
  return out.str();
}

std::vector<Section> unpack_sections(const SectionFormat& format, std::string_view bytes,
                                     const std::string& where) {
  std::istringstream in{std::string(bytes)};
  SectionReader reader(format, in, where);
  std::vector<Section> sections;
  while (auto section = reader.next()) sections.push_back(std::move(*section));
  return sections;
}

}  // namespace stillmap
