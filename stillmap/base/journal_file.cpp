// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/journal_file.hpp"

#include "stillmap/base/bytes.hpp"
#include "stillmap/base/deflate.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>

namespace stillmap {
namespace {

constexpr int kFastest = 1;  // level of compression, for a thread beside the tracker
constexpr std::size_t kSizes = 2 * sizeof(std::uint64_t);  // [bytes]
constexpr std::size_t kRecordHeader = kSizes + sizeof(std::uint32_t);

/// Returns the two sizes at the beginning of a record, followed by their checksum.
std::string record_header(std::string_view packed, std::size_t plain) {
  ByteWriter header;
  header.put(std::uint64_t{packed.size()});
  header.put(std::uint64_t{plain});
  header.put(crc32(packed, crc32(header.bytes())));
  return header.take();
}

template <typename T>
T number_at(std::string_view bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

}  // namespace

JournalWriter::JournalWriter(std::filesystem::path file)
    : file_(std::move(file)), out_(file_, std::ios::binary | std::ios::trunc) {
  ByteWriter header;
  header.put_list(std::span(kJournalMagic));
  header.put(kJournalVersion);
  write(header.bytes());
}

void JournalWriter::append(std::string_view record) {
  const std::string packed = deflated(record, kFastest);
  write(record_header(packed, record.size()).append(packed));
}

void JournalWriter::replace_all(const std::function<void(JournalWriter&)>& write) {
  JournalWriter next(file_.string() + ".part");
  write(next);
  std::error_code failed;
  std::filesystem::rename(next.file_, file_, failed);
  if (failed) {
    throw Error("cannot be replaced (" + failed.message() + ")", file_.string(),
                "check that the folder is writable");
  }
  next.file_ = file_;
  *this = std::move(next);
}

void JournalWriter::write(std::string_view bytes) {
  size_ += bytes.size();
  if (out_) out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size())).flush();
  if (out_) return;
  throw Error(std::string("cannot be written (") + std::strerror(errno) + ")", file_.string(),
              "check that the folder is writable, and that the disk is not full");
}

bool is_journal(const std::filesystem::path& file) {
  if (!is_file(file)) return false;  // a pipe may have no end
  std::array<char, kJournalMagic.size()> magic = {};
  std::ifstream in(file, std::ios::binary);
  in.read(magic.data(), magic.size());
  return in && std::string_view(magic.data(), magic.size()) == kJournalMagic;
}

JournalReader::JournalReader(const std::filesystem::path& file)
    : in_(open_file(file)), left_(std::filesystem::file_size(file)) {
  const std::string header = read(kJournalMagic.size() + sizeof kJournalVersion);
  if (header.size() < kJournalMagic.size() + sizeof kJournalVersion ||
      !header.starts_with(kJournalMagic)) {
    throw Error("is not the journal of a run", file.string(),
                "give the folder of a run that did not end");
  }
  if (number_at<std::uint32_t>(header, kJournalMagic.size()) != kJournalVersion) {
    throw Error("is a journal of another version", file.string(), "use the program that wrote it");
  }
}

std::string JournalReader::read(std::uint64_t size) {
  std::string bytes(std::min(size, left_), '\0');
  in_.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(in_.gcount()));
  left_ -= bytes.size();
  return bytes;
}

std::optional<std::string> JournalReader::next() {
  const std::uint64_t before = left_;
  const std::string header = read(kRecordHeader);
  if (header.size() == kRecordHeader) {
    const auto packed_size = number_at<std::uint64_t>(header, 0);
    const auto plain_size = number_at<std::uint64_t>(header, sizeof(std::uint64_t));
    const bool whole = packed_size <= left_;
    const std::string packed = whole ? read(packed_size) : "";
    if (packed.size() == packed_size && header == record_header(packed, plain_size)) {
      if (auto record = inflated(packed, plain_size)) return record;
    }
    if (whole) lost_ = before;
  }
  left_ = 0;
  return std::nullopt;
}

}  // namespace stillmap
