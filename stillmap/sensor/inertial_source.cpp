// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/inertial_source.hpp"

#include "stillmap/sensor/imu_buffer.hpp"

#include <utility>

#include <fmt/format.h>

namespace stillmap {

InertialSource::InertialSource(std::unique_ptr<FrameSource> source, std::vector<ImuSample> samples)
    : source_(std::move(source)), samples_(std::move(samples)) {
  for (ImuSample& sample : samples_) sample.timestamp -= camera().imu->time_offset;
}

RgbdFramePtr InertialSource::next() {
  const RgbdFramePtr frame = source_->next();
  if (!frame) return nullptr;
  auto with_samples = std::make_shared<RgbdFrame>(*frame);
  with_samples->imu = samples_until(samples_, frame->timestamp);
  return with_samples;
}

std::vector<std::string> InertialSource::notes() const {
  std::vector<std::string> notes = source_->notes();
  const double seconds = samples_.back().timestamp - samples_.front().timestamp;
  notes.push_back(fmt::format(
      "IMU {}: {} samples{}", camera().imu->name, samples_.size(),
      seconds > 0 ? fmt::format(" at {:.0f} Hz", static_cast<double>(samples_.size() - 1) / seconds)
                  : ""));
  return notes;
}

}  // namespace stillmap
