// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/imu.hpp"
#include "stillmap/sensor/frame_source.hpp"

#include <memory>
#include <vector>

namespace stillmap {

/// A source whose frames contain the samples of an IMU that were recorded with them.
class InertialSource : public FrameSource {
 public:
  /// @param source   its camera has an IMU
  /// @param samples  with the time stamps of the IMU
  InertialSource(std::unique_ptr<FrameSource> source, std::vector<ImuSample> samples);

  const Camera& camera() const override { return source_->camera(); }
  RgbdFramePtr next() override;
  void skip_before(double timestamp) override { source_->skip_before(timestamp); }
  std::optional<std::size_t> size() const override { return source_->size(); }
  const std::vector<SkippedFrame>& skipped() const override { return source_->skipped(); }
  std::vector<std::string> notes() const override;

 private:
  std::unique_ptr<FrameSource> source_;
  std::vector<ImuSample> samples_;  // by the clock of the images
};

}  // namespace stillmap
