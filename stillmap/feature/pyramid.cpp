// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/pyramid.hpp"

#include "stillmap/base/trace.hpp"

#include <cmath>

namespace stillmap {

void ImagePyramid::build(const cv::Mat& image, const PyramidShape& shape, int min_side) {
  const TraceScope scope("pyramid");
  images_.resize(shape.levels);
  shrinkers_.resize(shape.levels, Shrinker(path_));
  images_[0] = image;
  levels_ = 0;
  for (int level = 0; level < shape.levels; ++level) {
    const double scale = shape.scale(level);
    const cv::Size size(static_cast<int>(std::lround(image.cols / scale)),
                        static_cast<int>(std::lround(image.rows / scale)));
    if (size.width < min_side || size.height < min_side) break;
    if (level > 0) shrinkers_[level](images_[level - 1], size, images_[level]);
    levels_ = level + 1;
  }
}

cv::Point2f ImagePyramid::to_full_size(cv::Point2f p, int level) const {
  const float sx = static_cast<float>(images_[0].cols) / static_cast<float>(images_[level].cols);
  const float sy = static_cast<float>(images_[0].rows) / static_cast<float>(images_[level].rows);
  return {(p.x + 0.5F) * sx - 0.5F, (p.y + 0.5F) * sy - 0.5F};
}

}  // namespace stillmap
