// SPDX-License-Identifier: Apache-2.0
#include "stillmap/tag/tag_detector.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagCircle21h7.h>
#include <apriltag/tagStandard41h12.h>
#include <apriltag/tagStandard52h13.h>
#include <cstdlib>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace stillmap {
namespace {

/// Largest number of wrong bits that are corrected; with more, other things are taken for tags.
constexpr int kCorrectedBits = 1;

/// Images of a smaller side can show no tag, and the library cannot read them [pixels].
constexpr int kSmallestSide = 16;

struct FamilyFunctions {
  const char* name;
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

constexpr FamilyFunctions kFamilies[] = {
    {"tag36h11", tag36h11_create, tag36h11_destroy},
    {"tag25h9", tag25h9_create, tag25h9_destroy},
    {"tag16h5", tag16h5_create, tag16h5_destroy},
    {"tag36h10", tag36h10_create, tag36h10_destroy},
    {"tagStandard41h12", tagStandard41h12_create, tagStandard41h12_destroy},
    {"tagStandard52h13", tagStandard52h13_create, tagStandard52h13_destroy},
    {"tagCircle21h7", tagCircle21h7_create, tagCircle21h7_destroy}};

const FamilyFunctions& family_of(const std::string& name) {
  const auto* found = std::ranges::find(kFamilies, name, &FamilyFunctions::name);
  if (found == std::end(kFamilies)) {
    throw Error("is not a family of AprilTags", name,
                fmt::format("use one of {}", fmt::join(tag_family_names(), ", ")));
  }
  return *found;
}

using FamilyPtr = std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)>;

FamilyPtr make_family(const std::string& name) {
  const FamilyFunctions& functions = family_of(name);
  return {functions.create(), functions.destroy};
}

}  // namespace

const std::vector<std::string>& tag_family_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const FamilyFunctions& family : kFamilies) all.emplace_back(family.name);
    return all;
  }();
  return names;
}

struct TagDetector::Library {
  FamilyPtr family;
  std::unique_ptr<apriltag_detector_t, void (*)(apriltag_detector_t*)> detector{
      apriltag_detector_create(), apriltag_detector_destroy};

  std::uint8_t number;  // of the family

  explicit Library(const std::string& name)
      : family(make_family(name)),
        number(static_cast<std::uint8_t>(&family_of(name) - std::begin(kFamilies))) {
    apriltag_detector_add_family_bits(detector.get(), family.get(), kCorrectedBits);
  }
};

TagDetector::TagDetector(const std::string& family) : library_(std::make_unique<Library>(family)) {}
TagDetector::TagDetector(TagDetector&&) noexcept = default;
TagDetector::~TagDetector() = default;

std::vector<Tag> TagDetector::detect(const cv::Mat& gray) const {
  if (std::min(gray.rows, gray.cols) < kSmallestSide) return {};
  image_u8_t image{gray.cols, gray.rows, static_cast<std::int32_t>(gray.step), gray.data};
  const std::unique_ptr<zarray_t, void (*)(zarray_t*)> found{
      apriltag_detector_detect(library_->detector.get(), &image), apriltag_detections_destroy};
  std::vector<Tag> tags;
  for (int i = 0; i < zarray_size(found.get()); ++i) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(found.get(), i, static_cast<void*>(&detection));
    Tag& tag = tags.emplace_back();
    tag.name = {library_->number, static_cast<std::uint32_t>(detection->id)};
    // The library's first pixel has its center at (0.5, 0.5).
    for (int k = 0; k < 4; ++k) {
      tag.corners[k] = {static_cast<float>(detection->p[k][0] - 0.5),
                        static_cast<float>(detection->p[k][1] - 0.5)};
    }
  }
  std::ranges::stable_sort(tags, {}, &Tag::name);
  std::vector<Tag> unique;
  for (const Tag& tag : tags) {
    if (std::ranges::count(tags, tag.name, &Tag::name) == 1) unique.push_back(tag);
  }
  return unique;
}

cv::Mat tag_image(const std::string& family, std::uint32_t id) {
  const FamilyPtr made = make_family(family);
  if (id >= made->ncodes) {
    throw Error(fmt::format("has no tag {}", id), family,
                fmt::format("use 0 to {}", made->ncodes - 1));
  }
  image_u8_t* drawn = apriltag_to_image(made.get(), static_cast<int>(id));
  const auto stride = static_cast<std::size_t>(drawn->stride);
  cv::Mat image = cv::Mat(drawn->height, drawn->width, CV_8UC1, drawn->buf, stride).clone();
  // What image_u8_destroy() does, which the library does not export.
  std::free(drawn->buf);
  std::free(drawn);
  return image;
}

cv::Rect tag_border(const std::string& family) {
  const FamilyPtr made = make_family(family);
  const int margin = (made->total_width - made->width_at_border) / 2;
  return {margin, margin, made->width_at_border, made->width_at_border};
}

}  // namespace stillmap
