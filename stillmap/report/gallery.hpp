// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/report/captioned_image.hpp"
#include "stillmap/track/tracker.hpp"

#include <cstddef>
#include <optional>
#include <vector>

namespace stillmap {

/// Collects example frames for the report, spread evenly over the sequence.
class Gallery {
 public:
  /// @param total_frames  number of frames of the sequence, if known
  explicit Gallery(std::optional<std::size_t> total_frames);

  /// Draws the frame if it is one of the examples.
  void record(const TrackedFrame& tracked);
  /// Returns the drawn examples, once.
  std::vector<CaptionedImage> take() { return std::move(images_); }

 private:
  std::size_t every_;
  std::vector<CaptionedImage> images_;
};

}  // namespace stillmap
