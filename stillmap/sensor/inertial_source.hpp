// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/motion_sensors.hpp"
#include "stillmap/sensor/frame_source.hpp"

#include <memory>
#include <vector>

namespace stillmap {

/// Samples of an IMU and of wheels that were recorded with frames, by increasing time.
struct MotionSamples {
  std::vector<ImuSample> imu;            ///< With the time stamps of the IMU.
  std::vector<OdometrySample> odometry;  ///< With the time stamps of the images.
  bool empty() const { return imu.empty() && odometry.empty(); }
};

/// A source whose frames contain the samples of an IMU and of wheels that were recorded with them.
class InertialSource : public FrameSource {
 public:
  /// @param source    its camera has an IMU or wheels if there are samples of them
  /// @param findings  about the samples
  InertialSource(std::unique_ptr<FrameSource> source, MotionSamples samples,
                 std::vector<Finding> findings);

  const Camera& camera() const override { return source_->camera(); }
  RgbdFramePtr next() override;
  void skip_before(double timestamp) override { source_->skip_before(timestamp); }
  std::optional<std::size_t> size() const override { return source_->size(); }
  const std::vector<SkippedFrame>& skipped() const override { return source_->skipped(); }
  std::vector<std::string> notes() const override;
  std::vector<Finding> findings() const override;

 private:
  std::unique_ptr<FrameSource> source_;
  MotionSamples samples_;  // by the clock of the images
  std::vector<Finding> findings_;
};

}  // namespace stillmap
