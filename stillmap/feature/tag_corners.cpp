// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/tag_corners.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace stillmap {
namespace {

/// Upper bits of the number of a corner, by which it is told from other numbers.
constexpr std::uint64_t kMark = 0x7a65;
constexpr int kMarkShift = 48, kFamilyShift = 40, kIdShift = 8;

/// The finalizer of SplitMix64 (Steele, Lea, Flood: Fast splittable pseudorandom number generators,
/// OOPSLA 2014), a permutation of the 64-bit numbers.
constexpr std::uint64_t mixed(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
  x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
  return x ^ (x >> 31);
}

/// The inverse of mixed().
constexpr std::uint64_t unmixed(std::uint64_t x) {
  x = (x ^ (x >> 31) ^ (x >> 62)) * 0x319642b2d24d8ec3;
  x = (x ^ (x >> 27) ^ (x >> 54)) * 0x96de1b173f119089;
  return x ^ (x >> 30) ^ (x >> 60);
}
static_assert(unmixed(mixed(0x0123456789abcdef)) == 0x0123456789abcdef);

bool is_ignored(const cv::Mat& ignored, const cv::Point2f& p) {
  return !ignored.empty() && ignored.at<std::uint8_t>(cvRound(p.y), cvRound(p.x)) != 0;
}

bool contains(const cv::Mat& image, const cv::Point2f& p) {
  return cvRound(p.x) >= 0 && cvRound(p.x) < image.cols && cvRound(p.y) >= 0 &&
         cvRound(p.y) < image.rows;
}

}  // namespace

Descriptor descriptor_of(const TagCorner& corner) {
  const std::uint64_t number =
      kMark << kMarkShift | static_cast<std::uint64_t>(corner.tag.family) << kFamilyShift |
      static_cast<std::uint64_t>(corner.tag.id) << kIdShift | corner.corner;
  constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15;  // that of SplitMix64
  return {mixed(number), mixed(number + kStep), mixed(number + 2 * kStep),
          mixed(number + 3 * kStep)};
}

std::optional<TagCorner> tag_corner_of(const Descriptor& descriptor) {
  const std::uint64_t number = unmixed(descriptor[0]);
  if (number >> kMarkShift != kMark) return std::nullopt;
  const TagCorner corner{{static_cast<std::uint8_t>(number >> kFamilyShift),
                          static_cast<std::uint32_t>(number >> kIdShift)},
                         static_cast<std::uint8_t>(number)};
  if (corner.corner > 3 || descriptor_of(corner) != descriptor) return std::nullopt;
  return corner;
}

Features with_tag_corners(Features features, std::span<const Tag> tags, const cv::Mat& depth,
                          const cv::Mat& ignored, const DepthEdge& edge) {
  if (tags.empty()) return features;
  for (const Tag& tag : tags) {
    const bool visible = std::ranges::all_of(tag.corners, [&](const cv::Point2f& p) {
      return contains(depth, p) && !is_ignored(ignored, p);
    });
    if (!visible) continue;
    const cv::Point2f bottom = tag.corners[1] - tag.corners[0];
    for (std::uint8_t i = 0; i < std::size(tag.corners); ++i) {
      const cv::Point2f& p = tag.corners[i];
      features.keypoints.push_back({.u = p.x,
                                    .v = p.y,
                                    .angle = std::atan2(bottom.y, bottom.x),
                                    .depth = depth_at(depth, p.x, p.y, edge)});
      features.descriptors.push_back(descriptor_of({tag.name, i}));
    }
  }
  features.grid = KeypointGrid(features.keypoints, depth.cols, depth.rows);
  return features;
}

}  // namespace stillmap
