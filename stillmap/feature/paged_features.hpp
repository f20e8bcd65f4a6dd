// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/page_file.hpp"
#include "stillmap/feature/features.hpp"

#include <memory>

namespace stillmap {

/// Features in the pages of a file.
struct PagedFeatures {
  FeaturesPtr features;  ///< Usable as long as any others; they keep the pages.
  std::shared_ptr<const Pages> pages;
};

/// Returns a copy of features in a file; null pointers if it cannot be written.
PagedFeatures paged(const Features& features, SparePages& file);

}  // namespace stillmap
