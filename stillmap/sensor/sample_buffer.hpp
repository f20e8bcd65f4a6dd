// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <vector>

namespace stillmap {

/// Returns the samples of the last second before a time, up to the first one after it.
/// @param samples  ImuSample or OdometrySample, by increasing time
template <typename Sample>
std::vector<Sample> samples_until(const std::vector<Sample>& samples, double timestamp) {
  constexpr double kWindow = 1;  // [s]
  const auto is_earlier = [](const Sample& s, double time) { return s.timestamp < time; };
  const auto begin =
      std::lower_bound(samples.begin(), samples.end(), timestamp - kWindow, is_earlier);
  auto end = std::lower_bound(begin, samples.end(), timestamp, is_earlier);
  if (end != samples.end()) ++end;
  return {begin, end};
}

/// The newest samples of an IMU or of wheels that are read while the frames come.
template <typename Sample>
class SampleBuffer {
 public:
  /// Adds a sample, which may come after later ones; one of a time that is there is left out.
  /// Samples that are ten seconds older than the newest are forgotten.
  void add(const Sample& sample) {
    constexpr double kKept = 10;  // [s]
    const auto is_earlier = [](const Sample& s, double time) { return s.timestamp < time; };
    const auto at =
        std::lower_bound(samples_.begin(), samples_.end(), sample.timestamp, is_earlier);
    if (at != samples_.end() && at->timestamp == sample.timestamp) return;
    samples_.insert(at, sample);
    const double oldest = samples_.back().timestamp - kKept;
    // Half of the samples at a time, so that moving the others costs little.
    if (samples_[samples_.size() / 2].timestamp < oldest)
      samples_.erase(samples_.begin(),
                     std::lower_bound(samples_.begin(), samples_.end(), oldest, is_earlier));
  }
  const std::vector<Sample>& samples() const { return samples_; }

 private:
  std::vector<Sample> samples_;  // by increasing time
};

}  // namespace stillmap
