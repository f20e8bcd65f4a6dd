// SPDX-License-Identifier: Apache-2.0
#include "stillmap/map/keyframe_pager.hpp"

#include "stillmap/feature/paged_features.hpp"

#include <ranges>
#include <utility>

namespace stillmap {
void KeyframePager::use(Map& map, std::span<const KeyframeId> used) {
  for (const KeyframeId id : used | std::views::reverse) mark(map, id);
  forget_erased(map);
  while (bytes_in_memory_ > file_.limit() && !in_memory_.empty()) {
    const KeyframeId oldest = in_memory_.begin()->second;
    Kept& kept = kept_.at(oldest);
    if (!page_out(map, oldest, kept)) break;
    bytes_in_memory_ -= kept.bytes;
    in_memory_.erase(in_memory_.begin());
  }
  for (const auto& [id, kept] : kept_) {
    if (!in_memory_.contains({kept.last_use, id})) kept.pages->drop();
  }
}

void KeyframePager::replace(Map& map, KeyframeId id, FeaturesPtr features) {
  const auto found = kept_.find(id);
  if (found != kept_.end()) {
    if (in_memory_.erase({found->second.last_use, id}) > 0) bytes_in_memory_ -= found->second.bytes;
    kept_.erase(found);
  }
  map.set_features(id, std::move(features));
  use(map, std::span(&id, 1));
}

void KeyframePager::mark(const Map& map, KeyframeId id) {
  const Keyframe* keyframe = map.find(id);
  if (keyframe == nullptr) return;
  Kept& kept = kept_[id];
  kept.bytes = keyframe->features->bytes();
  if (in_memory_.erase({kept.last_use, id}) == 0) bytes_in_memory_ += kept.bytes;
  kept.last_use = ++uses_;
  in_memory_.insert({kept.last_use, id});
}

/// Returns whether the features are in the file now.
bool KeyframePager::page_out(Map& map, KeyframeId id, Kept& kept) {
  if (kept.pages) return true;
  PagedFeatures stored = paged(*map.at(id).features, file_);
  if (!stored.features) return false;
  kept.pages = std::move(stored.pages);
  map.set_features(id, std::move(stored.features));
  return true;
}

void KeyframePager::forget_erased(const Map& map) {
  std::erase_if(kept_, [&](const auto& entry) {
    const auto& [id, kept] = entry;
    if (map.find(id) != nullptr) return false;
    if (in_memory_.erase({kept.last_use, id}) > 0) bytes_in_memory_ -= kept.bytes;
    return true;
  });
}

}  // namespace stillmap
