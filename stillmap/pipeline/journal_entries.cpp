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

std::string record_of(const JournalEntries& entries) {
  ByteWriter out;
  for (const auto& [key, bytes] : entries) {
    put_key(out, key, kAdded);
    out.put_text(bytes);
  }
  return out.take();
}

JournalEntries entries_of(const std::vector<std::string>& records, const std::string& where) {
  JournalEntries entries;
  for (const std::string& record : records) {
    ByteReader in(record, where, "the journal is damaged; map the recording again");
    while (in.left() > 0) {
      JournalKey key;
      key.kind = static_cast<JournalKind>(in.get<std::uint8_t>());
      const auto change = in.get<std::uint8_t>();
      key.id = in.get<std::uint64_t>();
      if (change == kRemoved) {
        entries.erase(key);
      } else {
        entries[key] = in.get_text();
      }
    }
  }
  return entries;
}

}  // namespace stillmap
