// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// A folder with one 8-bit PNG per frame, named by its timestamp in seconds ("1000.033333.png"):
/// masks, instance numbers or speeds.
class StampedImages {
 public:
  /// Throws Error if the folder contains no such PNG.
  explicit StampedImages(const std::filesystem::path& folder);
  /// Returns the image nearest in time, within 10 ms, 8UC1; empty if there is none. Throws Error
  /// for a file that is not an image.
  cv::Mat at(double timestamp) const;

 private:
  std::vector<std::pair<double, std::filesystem::path>> files_;  // by stamp
};

}  // namespace stillmap
