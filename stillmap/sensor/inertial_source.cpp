// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/inertial_source.hpp"

#include "stillmap/sensor/sample_buffer.hpp"

#include <utility>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Returns the number of samples and their rate.
template <typename Sample>
std::string count_text(const std::vector<Sample>& samples) {
  const double seconds = samples.back().timestamp - samples.front().timestamp;
  std::string count = fmt::format("{} samples", samples.size());
  if (seconds <= 0) return count;
  return fmt::format("{} at {:.0f} Hz", count, static_cast<double>(samples.size() - 1) / seconds);
}

}  // namespace

InertialSource::InertialSource(std::unique_ptr<FrameSource> source, MotionSamples samples,
                               std::vector<Finding> findings)
    : source_(std::move(source)), samples_(std::move(samples)), findings_(std::move(findings)) {
  for (ImuSample& sample : samples_.imu) sample.timestamp -= camera().imu->time_offset;
}

RgbdFramePtr InertialSource::next() {
  const RgbdFramePtr frame = source_->next();
  if (!frame) return nullptr;
  auto with_samples = std::make_shared<RgbdFrame>(*frame);
  if (!samples_.imu.empty()) with_samples->imu = samples_until(samples_.imu, frame->timestamp);
  if (!samples_.odometry.empty())
    with_samples->odometry = samples_until(samples_.odometry, frame->timestamp);
  return with_samples;
}

std::vector<std::string> InertialSource::notes() const {
  std::vector<std::string> notes = source_->notes();
  if (!samples_.imu.empty())
    notes.push_back(fmt::format("IMU {}: {}", camera().imu->name, count_text(samples_.imu)));
  if (!samples_.odometry.empty()) notes.push_back("wheels: " + count_text(samples_.odometry));
  return notes;
}

std::vector<Finding> InertialSource::findings() const {
  std::vector<Finding> findings = source_->findings();
  findings.insert(findings.end(), findings_.begin(), findings_.end());
  return findings;
}

}  // namespace stillmap
