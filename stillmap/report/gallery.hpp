// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/report/run_sink.hpp"

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

namespace stillmap {

/// Collects example frames for the report, spread evenly over the sequence.
class Gallery final : public RunSink {
 public:
  /// @param total_frames  number of frames of the sequence, if known
  explicit Gallery(std::optional<std::size_t> total_frames);

  /// Draws the frame if it is one of the examples.
  void on_frame(SlamSystem& slam) override;
  /// Moves the drawn examples into the record.
  void on_last_frame(RunRecord& record) override { record.gallery = std::move(images_); }

 private:
  std::size_t every_;
  std::vector<CaptionedImage> images_;
};

}  // namespace stillmap
