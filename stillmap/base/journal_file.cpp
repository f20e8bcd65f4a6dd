// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/journal_file.hpp"

#include "stillmap/base/bytes.hpp"
#include "stillmap/base/deflate.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"

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

void JournalWriter::replace_all(std::string_view record) {
  JournalWriter next(file_.string() + ".part");
  next.append(record);
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
  std::error_code failed;
  if (!std::filesystem::is_regular_file(file, failed)) return false;  // a pipe may have no end
  std::array<char, kJournalMagic.size()> magic = {};
  std::ifstream in(file, std::ios::binary);
  in.read(magic.data(), magic.size());
  return in && std::string_view(magic.data(), magic.size()) == kJournalMagic;
}

std::vector<std::string> read_journal(const std::filesystem::path& file) {
  const std::string content = read_file(file);
  std::string_view left = content;
  const std::size_t header = kJournalMagic.size() + sizeof kJournalVersion;
  if (left.size() < header || !left.starts_with(kJournalMagic)) {
    throw Error("is not the journal of a run", file.string(),
                "give the folder of a run that did not end");
  }
  if (number_at<std::uint32_t>(left, kJournalMagic.size()) != kJournalVersion) {
    throw Error("is a journal of another version", file.string(), "use the program that wrote it");
  }
  left.remove_prefix(header);
  std::vector<std::string> records;
  while (left.size() >= kRecordHeader) {
    const auto packed_size = number_at<std::uint64_t>(left, 0);
    const auto plain_size = number_at<std::uint64_t>(left, sizeof(std::uint64_t));
    if (packed_size > left.size() - kRecordHeader) break;  // truncated
    const std::string_view packed = left.substr(kRecordHeader, packed_size);
    if (left.substr(0, kRecordHeader) != record_header(packed, plain_size)) break;
    auto record = inflated(packed, plain_size);
    if (!record) break;
    records.push_back(std::move(*record));
    left.remove_prefix(kRecordHeader + packed_size);
  }
  return records;
}

}  // namespace stillmap
