// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/paged_features.hpp"

#include <cstddef>
#include <memory_resource>
#include <utility>

namespace stillmap {
namespace {

/// Features in the memory of pages.
struct Stored {
  Stored(const Features& other, std::shared_ptr<Pages> where)
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

PagedFeatures paged(const Features& features, SparePages& file) {
  PagedFeatures result;
  file.write([&](PageFile& pages) {
    const auto stored =
        std::make_shared<Stored>(features, pages.reserve(features.bytes() + kAlignment));
    result = {FeaturesPtr(stored, &stored->features), stored->pages};
  });
  return result;
}

}  // namespace stillmap
