// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

#include <opencv2/core.hpp>

namespace stillmap {

/// A mask, or the problem in words that follow a file name ("is in color").
struct MaskRead {
  cv::Mat1b mask;       ///< Values: see instances_of_mask(). Empty if there is a problem.
  std::string problem;  ///< Empty if there is no problem.
};

/// Reads the mask of a frame from a PNG file. Besides 8 bits of gray it takes what can only mean
/// the same: three equal channels or a palette of grays, an opaque alpha channel, and 16 bits whose
/// values are below 256 or are those of 8 bits stretched over 16. A larger mask of the same aspect
/// ratio, up to eight times, is reduced to the size of the frame.
MaskRead read_mask(const std::filesystem::path& file, cv::Size frame);

}  // namespace stillmap
