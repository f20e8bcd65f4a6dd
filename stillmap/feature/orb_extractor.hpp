// SPDX-License-Identifier: Apache-2.0

#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/feature/features.hpp"

#include <opencv2/features2d.hpp>

namespace stillmap {
struct OrbOptions {
  int keypoints = 1000;
  int levels = 8;
  double scale_factor = 1.2;
  STILLMAP_FIELDS(keypoints, levels, scale_factor)
};
class OrbExtractor {
 public:
  explicit OrbExtractor(const OrbOptions& options);
  Features extract(const cv::Mat& grey, const cv::Mat& depth);

 private:
  cv::Ptr<cv::ORB> orb_;
};
}  // namespace stillmap
