// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

#include <opencv2/core.hpp>

namespace stillmap {

/// A mask, or the problem as a text that follows the file name ("has colors").
struct MaskRead {
  cv::Mat1b mask;       ///< Values: see instances_of_mask(). Empty if there is a problem.
  std::string problem;  ///< Empty if there is no problem.
};

/// Reads the mask of a frame from a PNG file. Besides 8-bit gray it accepts equivalent formats:
/// three equal channels, a palette of grays, an opaque alpha channel, and 16-bit values that are
/// below 256 or 8-bit values scaled by 257. One color on black is another moving object, as the
/// value 128. A mask of the same aspect ratio, from a quarter of the width up to eight times, is
/// scaled to the size of the frame by nearest neighbor.
MaskRead read_mask(const std::filesystem::path& file, cv::Size frame);

}  // namespace stillmap
