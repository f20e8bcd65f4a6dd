// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/frame_source.hpp"

#include <memory>

namespace stillmap {

/// Returns the ideal pinhole camera of images reduced to half their width and height, for slow
/// computers. Pixel (u, v) covers pixels 2u, 2u + 1 and 2v, 2v + 1 of the full image, so its center
/// is at (2u + 0.5, 2v + 0.5). An odd last row or column is dropped. Throws Error if the images are
/// too small: less than 128 x 96 pixels.
Camera halved(const Camera& camera);

/// Returns the halved frame. Color and gray: mean of four pixels. Depth: mean of those of the four
/// readings within 3 % of the nearest, hence of one surface; 0 without a reading.
RgbdFrame halved(const RgbdFrame& frame);

/// A source of the halved frames of another source.
class HalvedSource : public FrameSource {
 public:
  /// Throws Error if the camera's images are too small to be halved.
  explicit HalvedSource(std::unique_ptr<FrameSource> whole);

  const Camera& camera() const override { return camera_; }
  RgbdFramePtr next() override;
  void skip_before(double timestamp) override { whole_->skip_before(timestamp); }
  std::optional<std::size_t> size() const override { return whole_->size(); }
  const std::vector<SkippedFrame>& skipped() const override { return whole_->skipped(); }
  std::vector<std::string> notes() const override { return whole_->notes(); }

 private:
  std::unique_ptr<FrameSource> whole_;
  Camera camera_;
};

}  // namespace stillmap
