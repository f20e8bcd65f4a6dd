// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cstddef>
#include <limits>
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

/// Samples that came after the frame whose pose they should have supported.
struct LateSamples {
  std::size_t added = 0, late = 0;
  double longest = 0;  ///< Time between the latest sample and that frame [s].
};

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
    count(sample.timestamp);
    const double oldest = samples_.back().timestamp - kKept;
    // Half of the samples at a time, so that moving the others costs little.
    if (samples_[samples_.size() / 2].timestamp < oldest)
      samples_.erase(samples_.begin(),
                     std::lower_bound(samples_.begin(), samples_.end(), oldest, is_earlier));
  }
  /// Returns samples_until() the time of a frame. Earlier samples that are added from now on are
  /// late.
  std::vector<Sample> take_until(double timestamp) {
    taken_until_ = timestamp;
    return samples_until(samples_, timestamp);
  }
  const std::vector<Sample>& samples() const { return samples_; }
  const LateSamples& late() const { return late_; }

 private:
  void count(double timestamp) {
    ++late_.added;
    if (timestamp > taken_until_) return;
    ++late_.late;
    late_.longest = std::max(late_.longest, taken_until_ - timestamp);
  }

  std::vector<Sample> samples_;  // by increasing time
  double taken_until_ = -std::numeric_limits<double>::infinity();
  LateSamples late_;
};

}  // namespace stillmap
