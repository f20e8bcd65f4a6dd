// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/page_file.hpp"
#include "stillmap/map/map.hpp"

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <utility>

namespace stillmap {

/// Moves the features of keyframes that were not used for the longest time into a temporary file.
/// They stay usable as before, and the map does not depend on it. What remains in memory of such a
/// keyframe are its landmarks and weights, 12 of some 85 bytes per keypoint.
class KeyframePager {
 public:
  explicit KeyframePager(MemoryLimit memory) : file_(std::move(memory), "the map") {}

  /// Marks keyframes as used now, the last of them first, and moves the features of others to the
  /// file until those in memory fit the limit. Gives back the memory of all features in the file
  /// that were read meanwhile, unless they are among those in use.
  void use(Map& map, std::span<const KeyframeId> used);

  /// Replaces the features of a keyframe: see Map::set_features(). It counts as used now.
  void replace(Map& map, KeyframeId id, FeaturesPtr features);

  /// Returns the size of the features in memory [bytes].
  std::size_t bytes_in_memory() const { return bytes_in_memory_; }
  /// Returns the number of keyframes whose features are in the file only.
  std::size_t paged_out() const { return kept_.size() - in_memory_.size(); }

 private:
  struct Kept {
    std::uint64_t last_use = 0;
    std::size_t bytes = 0;
    std::shared_ptr<const Pages> pages;  // null: not in the file yet
  };

  void mark(const Map& map, KeyframeId id);
  bool page_out(Map& map, KeyframeId id, Kept& kept);
  void forget_erased(const Map& map);

  SparePages file_;
  std::uint64_t uses_ = 0;
  std::size_t bytes_in_memory_ = 0;
  std::map<KeyframeId, Kept> kept_;
  std::set<std::pair<std::uint64_t, KeyframeId>> in_memory_;  // by last use
};

}  // namespace stillmap
