// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/detector.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// Masks made offline: a folder with one 8-bit gray PNG per frame, of the frames' size or twice
/// that.
///
/// Values: 0 is what stands still (or nothing known); every other value is one class: 255 a person,
/// all others "unknown", a thing that moves but has no name. Each connected piece (8-neighbors) of
/// one value is one instance.
///
/// Which mask is whose: if all file names (without extension) are numbers, they are timestamps in
/// seconds, and a frame takes the nearest within half of the masks' median interval (or, where
/// there is only one mask, 20 ms). Otherwise the files in alphabetic order belong to frames 0, 1, 2
/// ... A frame without a mask gets no instances, and is counted. So is one whose mask cannot be
/// read or has another size.
class MaskFolder final : public Detector {
 public:
  /// Throws Error if the folder is missing or has no PNG in it.
  explicit MaskFolder(const std::filesystem::path& folder);

  std::vector<Instance> detect(const RgbdFrame& frame) override;
  std::string description() const override;
  std::string skipped() const override;
  const std::vector<std::string>& class_names() const override;

  std::size_t missing() const { return missing_; }  ///< frames that had no mask, so far
  std::size_t unusable() const {
    return unusable_;
  }  ///< masks that were broken or of a wrong size, so far

 private:
  struct Entry {
    double stamp = 0;  // seconds; unused where the names are no numbers
    std::filesystem::path file;
  };
  const Entry* find(const RgbdFrame& frame) const;

  std::filesystem::path folder_;
  std::vector<Entry> entries_;  // by stamp, or by name
  bool stamped_ = false;
  double tolerance_ = 0;  // seconds
  std::size_t missing_ = 0, unusable_ = 0;
};

/// The instances that a mask image with MaskFolder's values shows, by falling size; specks of fewer
/// than `smallest` pixels left out.
std::vector<Instance> instances_of_mask(const cv::Mat1b& mask, int smallest = 16);

}  // namespace stillmap
