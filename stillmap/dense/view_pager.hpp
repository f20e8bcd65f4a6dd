// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/page_file.hpp"
#include "stillmap/dense/dense_view.hpp"

#include <cstdint>
#include <utility>

namespace stillmap {

/// Moves the pixels of views into a temporary file. They stay usable as before, but take memory
/// only while they are used, up to DenseView::drop_pages().
class ViewPager {
 public:
  explicit ViewPager(MemoryLimit memory) : file_(std::move(memory), "the dense map") {}

  std::uint64_t limit() const { return file_.limit(); }
  /// Returns whether the pixels of the view are in the file now.
  bool page_out(DenseView& view);

 private:
  SparePages file_;
};

}  // namespace stillmap
