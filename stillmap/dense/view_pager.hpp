// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/page_file.hpp"
#include "stillmap/dense/dense_view.hpp"

#include <cstdint>
#include <optional>
#include <utility>

namespace stillmap {

/// Moves the pixels of views into a temporary file. They stay usable as before, but take memory
/// only while they are used, up to DenseView::drop_pages().
class ViewPager {
 public:
  explicit ViewPager(MemoryLimit memory) : memory_(std::move(memory)) {}

  std::uint64_t limit() const { return memory_.limit; }
  /// Returns whether the pixels of the view are in the file now. Once they cannot be written (disk
  /// full), the user is warned, and all further views stay in memory.
  bool page_out(DenseView& view);

 private:
  MemoryLimit memory_;
  std::optional<PageFile> file_;  // created when it is needed
  bool failed_ = false;
};

}  // namespace stillmap
