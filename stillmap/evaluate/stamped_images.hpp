// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// A folder of 8-bit PNGs whose names are stamps in seconds ("1000.033333.png"), one per frame:
/// masks, instance numbers, speeds.
class StampedImages {
 public:
  /// Throws Error where the folder holds no such PNG.
  explicit StampedImages(const std::filesystem::path& folder);
  /// The image nearest in time, within 10 ms, 8UC1; empty where there is none. Throws Error for a
  /// file that is no image.
  cv::Mat at(double timestamp) const;

 private:
  std::vector<std::pair<double, std::filesystem::path>> files_;  // by stamp
};

}  // namespace stillmap
