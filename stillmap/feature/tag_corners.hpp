// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/features.hpp"
#include "stillmap/tag/tag_detector.hpp"

#include <compare>
#include <cstdint>
#include <optional>
#include <span>

#include <opencv2/core.hpp>

namespace stillmap {

/// A corner of an AprilTag.
struct TagCorner {
  TagName tag;
  std::uint8_t corner = 0;  ///< Index in Tag::corners.
  auto operator<=>(const TagCorner&) const = default;
};

/// Returns the descriptor of keypoints at a corner of a tag: the same in all images, and about 128
/// bits from other descriptors. So whatever compares descriptors recognizes the corner.
Descriptor descriptor_of(const TagCorner& corner);
/// Returns the corner of a tag that a descriptor stands for, if it does.
std::optional<TagCorner> tag_corner_of(const Descriptor& descriptor);

/// Returns features with further keypoints, of level 0, at the corners of tags, four in a row for
/// each tag, with the depths of the plane that fits all depths within the tag: single readings
/// would turn it by several degrees. Tags with an ignored corner, or one outside the image, are
/// left out.
/// @param depth, ignored  images, as for OrbExtractor::extract()
Features with_tag_corners(Features features, std::span<const Tag> tags, const cv::Mat& depth,
                          const cv::Mat& ignored);

}  // namespace stillmap
