// SPDX-License-Identifier: Apache-2.0
#include "stillmap/map/keyframe_pager.hpp"

#include <memory_resource>
#include <ranges>

namespace stillmap {
namespace {

/// Features in the memory of pages.
struct PagedFeatures {
  PagedFeatures(const Features& other, std::shared_ptr<Pages> where)
      : pages(std::move(where)),
        memory(pages->data(), pages->size(), std::pmr::null_memory_resource()),
        features(other, &memory) {}

  std::shared_ptr<Pages> pages;
  std::pmr::monotonic_buffer_resource memory;
  Features features;  // last, since it uses the memory
};

/// Room for the alignment of the four lists of a frame's features [bytes].
constexpr std::size_t kAlignment = 4 * alignof(std::max_align_t);

}  // namespace

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
  return file_.write([&](PageFile& file) {
    const auto paged = std::make_shared<PagedFeatures>(*map.at(id).features,
                                                       file.reserve(kept.bytes + kAlignment));
    kept.pages = paged->pages;
    map.set_features(id, FeaturesPtr(paged, &paged->features));
  });
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
