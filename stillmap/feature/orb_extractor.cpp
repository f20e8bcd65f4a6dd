// SPDX-License-Identifier: Apache-2.0

#include "stillmap/feature/orb_extractor.hpp"

#include <cstring>
namespace stillmap {
OrbExtractor::OrbExtractor(const OrbOptions& o)
    : orb_(cv::ORB::create(o.keypoints, static_cast<float>(o.scale_factor), o.levels, 19, 0, 2,
                           cv::ORB::HARRIS_SCORE, 31, 10)) {}
Features OrbExtractor::extract(const cv::Mat& grey, const cv::Mat& depth) {
  std::vector<cv::KeyPoint> kps;
  cv::Mat desc;
  orb_->detectAndCompute(grey, cv::noArray(), kps, desc);
  Features f;
  f.keypoints.resize(kps.size());
  f.descriptors.resize(kps.size());
  for (std::size_t i = 0; i < kps.size(); ++i) {
    auto& k = f.keypoints[i];
    k.u = kps[i].pt.x;
    k.v = kps[i].pt.y;
    k.angle = static_cast<float>(kps[i].angle * M_PI / 180);
    k.level = static_cast<std::uint8_t>(kps[i].octave);
    k.response = kps[i].response;
    if (!depth.empty()) k.depth = depth.at<float>(cvRound(k.v), cvRound(k.u));
    std::memcpy(f.descriptors[i].data(), desc.ptr(static_cast<int>(i)), 32);
  }
  f.grid = KeypointGrid(f.keypoints, grey.cols, grey.rows);
  return f;
}
}  // namespace stillmap
