// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/frame_source.hpp"

#include <functional>
#include <memory>
#include <utility>

namespace stillmap {

/// A source of the converted frames of another source, such as halved or rotated ones.
class ConvertedSource : public FrameSource {
 public:
  using Conversion = std::function<RgbdFrame(const RgbdFrame&)>;
  /// @param camera  camera of the converted frames
  ConvertedSource(std::unique_ptr<FrameSource> source, Camera camera, Conversion convert)
      : source_(std::move(source)), camera_(std::move(camera)), convert_(std::move(convert)) {}

  const Camera& camera() const override { return camera_; }
  RgbdFramePtr next() override {
    const RgbdFramePtr frame = source_->next();
    return frame ? std::make_shared<RgbdFrame>(convert_(*frame)) : nullptr;
  }
  void skip_before(double timestamp) override { source_->skip_before(timestamp); }
  std::optional<std::size_t> size() const override { return source_->size(); }
  const std::vector<SkippedFrame>& skipped() const override { return source_->skipped(); }
  std::vector<std::string> notes() const override { return source_->notes(); }
  std::vector<Finding> findings() const override { return source_->findings(); }

 private:
  std::unique_ptr<FrameSource> source_;
  Camera camera_;
  Conversion convert_;
};

}  // namespace stillmap
