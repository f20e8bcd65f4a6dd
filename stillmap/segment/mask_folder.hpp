// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/detector.hpp"
#include "stillmap/segment/mask_agreement.hpp"

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// Masks from a folder with one gray PNG per frame: see read_mask().
///
/// Values and instances: see instances_of_mask().
///
/// Assignment: a frame whose image has a name takes the mask with the same name, or with the same
/// number or time in its name (rgb/frame_12.jpg and mask/000012_mask.png). Otherwise, if the names
/// of all masks are times [s], a frame takes the nearest mask within half of the median interval of
/// the masks, at most 20 ms; whole numbers count as times only for frames without names. Otherwise
/// the files in alphabetical order belong to frames 0, 1, 2, ... A frame without a usable mask has
/// no instances and is counted.
class MaskFolder final : public Detector {
 public:
  /// Throws Error if the folder is missing or contains no PNG.
  explicit MaskFolder(const std::filesystem::path& folder);

  std::vector<Instance> detect(const RgbdFrame& frame) override;
  std::string description() const override;
  std::string skipped() const override;
  std::size_t failures() const override { return missing_ + unusable_; }
  std::optional<Finding> finding() const override;
  const std::vector<std::string>& class_names() const override;

  /// Returns the number of frames without a mask so far.
  std::size_t missing() const { return missing_; }
  /// Returns the number of unusable masks so far.
  std::size_t unusable() const { return unusable_; }

 private:
  struct Entry {
    double stamp = 0;  // Timestamp [s]; unused if not all names are times.
    std::filesystem::path file;
  };
  const std::filesystem::path* find(const RgbdFrame& frame) const;
  const std::filesystem::path* nearest_in_time(double timestamp) const;

  std::filesystem::path folder_;
  std::vector<Entry> entries_;  // sorted by timestamp or by name
  std::map<std::string, std::filesystem::path> by_name_;
  std::map<double, std::filesystem::path> by_number_;
  bool counts_frames_ = false;  // whether names contain frame numbers
  bool stamped_ = false;
  double tolerance_ = 0;  // seconds
  std::size_t missing_ = 0, unusable_ = 0, used_ = 0;
  std::string first_problem_;
  MaskAgreement agreement_;  // of some of the masks
};

}  // namespace stillmap
