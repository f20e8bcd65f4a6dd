// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/frame_source.hpp"

#include <memory>

namespace stillmap {

/// For computers with little time: pictures of half the width and height, a quarter of the work.
/// Odd last rows and columns are left out.

/// The ideal pinhole that sees them: pixel (u, v) covers pixels 2u, 2u + 1 and 2v, 2v + 1 of the
/// recorded one, so its center lies at (2u + 0.5, 2v + 0.5).
Camera halved(const Camera& camera);

/// Color and gray: the mean of four pixels. Depth: the mean of those of the four readings that lie
/// within 3 % of the nearest, so of one surface; 0 where there is none.
RgbdFrame halved(const RgbdFrame& frame);

/// What another source hands out, halved.
class HalvedSource : public FrameSource {
 public:
  /// Throws Error if the camera's pictures are too small to be halved: under 128 x 96.
  explicit HalvedSource(std::unique_ptr<FrameSource> whole);

  const Camera& camera() const override { return camera_; }
  RgbdFramePtr next() override;
  std::optional<std::size_t> size() const override { return whole_->size(); }
  const std::vector<SkippedFrame>& skipped() const override { return whole_->skipped(); }

 private:
  std::unique_ptr<FrameSource> whole_;
  Camera camera_;
};

}  // namespace stillmap
