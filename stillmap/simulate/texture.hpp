// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap::simulate {

/// A periodic image with its mip chain (Williams 1983, Pyramidal parametrics). Texture coordinates:
/// u to the right, v down, one period per unit.
class Texture {
 public:
  struct Level {
    int log2_width = 0, log2_height = 0;
    std::vector<std::uint32_t> texels;  ///< B | G << 8 | R << 16, row by row
  };

  /// @param bgr  8UC3, any size; stretched to powers of two
  explicit Texture(const cv::Mat& bgr);

  const std::vector<Level>& levels() const { return levels_; }
  int width() const { return 1 << levels_.front().log2_width; }
  int height() const { return 1 << levels_.front().log2_height; }

 private:
  std::vector<Level> levels_;
};

/// Faces refer to textures by index.
using Textures = std::vector<Texture>;

}  // namespace stillmap::simulate
