// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/journal_entries.hpp"

namespace stillmap {
namespace {

constexpr std::uint8_t kRemoved = 0, kAdded = 1;

void put_key(ByteWriter& out, JournalKey key, std::uint8_t change) {
  out.put(static_cast<std::uint8_t>(key.kind));
  out.put(change);
  out.put(key.id);
}

/// Calls `visit` with the key, the change and the bytes of each addition and removal in a journal.
/// Returns JournalReader::lost() at its end.
template <typename Visit>
std::uint64_t for_each_change(const std::filesystem::path& file, Visit&& visit) {
  JournalReader records(file);
  while (const auto record = records.next()) {
    ByteReader in(*record, file.string(), "the journal is damaged; map the recording again");
    while (in.left() > 0) {
      JournalKey key;
      key.kind = static_cast<JournalKind>(in.get<std::uint8_t>());
      const auto change = in.get<std::uint8_t>();
      key.id = in.get<std::uint64_t>();
      visit(key, change, change == kRemoved ? std::string() : in.get_text());
    }
  }
  return records.lost();
}

}  // namespace

void JournalPart::put(JournalKey key, std::string_view bytes) {
  const std::size_t hash = std::hash<std::string_view>()(bytes);
  const auto [entry, added] = written_.try_emplace(key);
  entry->second.pass = pass_;
  if (!added && entry->second.hash == hash) return;
  entry->second.hash = hash;
  put_key(out_, key, kAdded);
  out_.put_text(bytes);
}

bool JournalPart::keep(JournalKey key) {
  const auto entry = written_.find(key);
  if (entry == written_.end()) return false;
  entry->second.pass = pass_;
  return true;
}

void JournalPart::remove_others(JournalKind kind) {
  std::erase_if(written_, [&](const auto& entry) {
    const auto& [key, written] = entry;
    if (key.kind != kind || written.pass == pass_) return false;
    put_key(out_, key, kRemoved);
    return true;
  });
}

std::string JournalPart::take() {
  ++pass_;
  return out_.take();
}

JournalContent::JournalContent(std::filesystem::path file) : file_(std::move(file)) {
  std::uint64_t position = 0;
  lost_ = for_each_change(file_, [&](JournalKey key, std::uint8_t change, const std::string&) {
    if (change == kRemoved) {
      last_.erase(key);
    } else {
      last_[key] = position++;
    }
  });
}

void JournalContent::for_each(
    const std::function<void(JournalKey, std::string_view)>& visit) const {
  std::uint64_t position = 0;
  for_each_change(file_, [&](JournalKey key, std::uint8_t change, const std::string& bytes) {
    if (change == kRemoved) return;
    const auto last = last_.find(key);
    if (last != last_.end() && last->second == position) visit(key, bytes);
    ++position;
  });
}

void JournalContent::write_to(JournalWriter& writer) const {
  ByteWriter record;
  for_each([&](JournalKey key, std::string_view bytes) {
    put_key(record, key, kAdded);
    record.put_text(bytes);
    if (record.bytes().size() >= kFullRecord) writer.append(record.take());
  });
  if (!record.bytes().empty()) writer.append(record.bytes());
}

}  // namespace stillmap
