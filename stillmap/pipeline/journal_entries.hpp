// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/bytes.hpp"
#include "stillmap/base/journal_file.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

namespace stillmap {

/// What an entry of a run's journal holds. The values are those of the file.
enum class JournalKind : std::uint8_t {
  kRun = 0,          ///< Sequence, machine and options.
  kCamera = 1,       ///< A map section, by its number.
  kFrame = 2,        ///< FrameRecord, by index.
  kKeyframe = 3,     ///< Numbers and pose, by id.
  kKeypoints = 4,    ///< Keypoints, by id of their keyframe.
  kReplacement = 5,  ///< Replacement of an erased keyframe, by its id.
  kLandmark = 6,     ///< Landmark, by id.
  kEvent = 7,        ///< MapEvent, by its position.
  kView = 8,         ///< View of the dense map, by id.
  kViewPlace = 9,    ///< Its keyframe and relative pose, by the same id.
  kMover = 10,       ///< Identity of a mover, by id.
  kMoverSample = 11  ///< Its place in a frame, by id and frame index.
};

/// Kind and id of an entry.
struct JournalKey {
  JournalKind kind = JournalKind::kRun;
  std::uint64_t id = 0;
  auto operator<=>(const JournalKey&) const = default;
};

struct JournalKeyHash {
  std::size_t operator()(const JournalKey& key) const {
    return std::hash<std::uint64_t>()(key.id * 16 + static_cast<std::uint64_t>(key.kind));
  }
};

/// Size from which a record is full [bytes].
constexpr std::size_t kFullRecord = 8U << 20;

/// Collects the entries of one part of a run that differ from those it returned before.
class JournalPart {
 public:
  /// Adds an entry, unless it was returned before with the same bytes.
  void put(JournalKey key, std::string_view bytes);
  /// Returns whether the entry was returned before, and keeps it; for entries that never change.
  bool keep(JournalKey key);
  /// Removes all entries of the kind for which neither put() nor keep() was called since the last
  /// take().
  void remove_others(JournalKind kind);
  /// Returns whether the next record is so large that new entries should wait for the one after it.
  bool full() const { return out_.bytes().size() >= kFullRecord; }
  /// Returns the record of all additions and removals since the last call; empty without any.
  std::string take();

 private:
  struct Written {
    std::size_t hash = 0;
    std::uint32_t pass = 0;  // number of the pass that put or kept it last
  };
  std::unordered_map<JournalKey, Written, JournalKeyHash> written_;
  std::uint32_t pass_ = 0;
  ByteWriter out_;
};

/// The entries of a journal after all its records, in the order of their last changes. They stay in
/// the file: only one record is in memory at a time.
class JournalContent {
 public:
  /// Throws Error as JournalReader, and for a record that is no list of entries.
  explicit JournalContent(std::filesystem::path file);

  /// Calls `visit` for each entry.
  void for_each(const std::function<void(JournalKey, std::string_view)>& visit) const;
  /// Appends records that have these entries.
  void write_to(JournalWriter& writer) const;
  /// Returns JournalReader::lost() at the end of the records [bytes].
  std::uint64_t lost() const { return lost_; }

 private:
  std::filesystem::path file_;
  // Position in the file of each entry among all additions.
  std::unordered_map<JournalKey, std::uint64_t, JournalKeyHash> last_;
  std::uint64_t lost_ = 0;
};

}  // namespace stillmap
