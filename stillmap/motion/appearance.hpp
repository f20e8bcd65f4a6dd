// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <optional>

#include <opencv2/core.hpp>

namespace stillmap {

/// Colors of an object, as one histogram of its upper and one of its lower part (shirt and
/// trousers), summed over all its detections. The bins are hue at two levels of saturation, and
/// brightness for gray pixels.
class Appearance {
 public:
  enum class Part { kUpper, kLower };

  /// Adds one pixel of a part.
  void add(Part part, const cv::Vec3b& bgr);
  /// Adds all pixels of another appearance of the same object.
  void add(const Appearance& other);

  /// Returns the distance of two appearances [0..1]: the mean over the parts that both show of
  /// sqrt(1 - sum sqrt(a_i b_i)) (Bhattacharyya; Comaniciu, Ramesh, Meer, Kernel-Based Object
  /// Tracking, PAMI 2003, eq. 6); none if they have no part in common.
  std::optional<double> distance(const Appearance& other) const;

 private:
  static constexpr std::size_t kHues = 12, kGrays = 4, kBins = 2 * kHues + kGrays;
  using Histogram = std::array<double, kBins>;  // number of pixels per bin

  static std::size_t bin_of(const cv::Vec3b& bgr);

  std::array<Histogram, 2> parts_ = {};
};

}  // namespace stillmap
