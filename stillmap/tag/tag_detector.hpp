// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <compare>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Returns the names of the families of AprilTags (Olson, AprilTag: A robust and flexible visual
/// fiducial system, ICRA 2011; Wang and Olson, IROS 2016).
const std::vector<std::string>& tag_family_names();

/// What is written on a tag.
struct TagName {
  std::uint8_t family = 0;  ///< Index of its family in tag_family_names().
  std::uint32_t id = 0;     ///< Number within its family.
  auto operator<=>(const TagName&) const = default;
};

/// A tag in an image.
struct Tag {
  TagName name;
  /// Corners of its black border [pixels], counterclockwise in the image of an upright tag, from
  /// the lower left one. The center of the first pixel is at (0, 0).
  std::array<cv::Point2f, 4> corners;
};

/// Finds the tags of one family by the library AprilTag. Use one object per thread. The result
/// depends on the image only.
class TagDetector {
 public:
  /// @param family  one of tag_family_names(); throws Error for others
  explicit TagDetector(const std::string& family);
  TagDetector(TagDetector&&) noexcept;
  ~TagDetector();

  /// Returns the tags, ordered by their ids. Of several tags with the same id none is returned,
  /// since they could not be told apart.
  /// @param gray  8UC1, any size
  std::vector<Tag> detect(const cv::Mat& gray) const;

 private:
  struct Library;
  std::unique_ptr<Library> library_;
};

/// Returns the image of a tag, one pixel per cell, with its white margin, 8UC1. Throws Error for an
/// unknown family or if the family has no such tag.
cv::Mat tag_image(const std::string& family, std::uint32_t id);

/// Returns the part of tag_image() within the corners that TagDetector finds [pixels].
cv::Rect tag_border(const std::string& family);

}  // namespace stillmap
