// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/imu.hpp"

#include <vector>

namespace stillmap {

/// Returns the samples of the last second before a time, up to the first one after it.
/// @param samples  by increasing time
std::vector<ImuSample> samples_until(const std::vector<ImuSample>& samples, double timestamp);

/// The newest samples of an IMU that is read while the frames come.
class ImuBuffer {
 public:
  /// Adds a sample, which may come after later ones; one of a time that is there is left out.
  /// Samples that are ten seconds older than the newest are forgotten.
  void add(const ImuSample& sample);
  const std::vector<ImuSample>& samples() const { return samples_; }

 private:
  std::vector<ImuSample> samples_;  // by increasing time
};

}  // namespace stillmap
