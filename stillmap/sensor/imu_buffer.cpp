// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/imu_buffer.hpp"

#include <algorithm>

namespace stillmap {
namespace {

bool is_earlier(const ImuSample& sample, double time) { return sample.timestamp < time; }

}  // namespace

std::vector<ImuSample> samples_until(const std::vector<ImuSample>& samples, double timestamp) {
  constexpr double kWindow = 1;  // [s]
  const auto begin =
      std::lower_bound(samples.begin(), samples.end(), timestamp - kWindow, is_earlier);
  auto end = std::lower_bound(begin, samples.end(), timestamp, is_earlier);
  if (end != samples.end()) ++end;
  return {begin, end};
}

void ImuBuffer::add(const ImuSample& sample) {
  constexpr double kKept = 10;  // [s]
  const auto at = std::lower_bound(samples_.begin(), samples_.end(), sample.timestamp, is_earlier);
  if (at != samples_.end() && at->timestamp == sample.timestamp) return;
  samples_.insert(at, sample);
  const double oldest = samples_.back().timestamp - kKept;
  // Half of the samples at a time, so that moving the others costs little.
  if (samples_[samples_.size() / 2].timestamp < oldest)
    samples_.erase(samples_.begin(),
                   std::lower_bound(samples_.begin(), samples_.end(), oldest, is_earlier));
}

}  // namespace stillmap
