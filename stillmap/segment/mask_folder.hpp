// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/detector.hpp"
#include "stillmap/segment/mask_agreement.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// Masks from a folder with one 8-bit gray PNG per frame, of the size of the frames or twice that.
///
/// Values and instances: see instances_of_mask().
///
/// Assignment: if all file names (without extension) are numbers, they are timestamps [s], and a
/// frame takes the nearest within half of the median interval of the masks, 20 ms at most.
/// Otherwise the files in alphabetical order belong to frames 0, 1, 2, ... A frame without a mask,
/// or with a mask that cannot be read or has another size, has no instances and is counted.
class MaskFolder final : public Detector {
 public:
  /// Throws Error if the folder is missing or contains no PNG.
  explicit MaskFolder(const std::filesystem::path& folder);

  std::vector<Instance> detect(const RgbdFrame& frame) override;
  std::string description() const override;
  std::string skipped() const override;
  std::size_t failures() const override { return missing_ + unusable_; }
  std::string doubt() const override;
  const std::vector<std::string>& class_names() const override;

  /// Returns the number of frames without a mask so far.
  std::size_t missing() const { return missing_; }
  /// Returns the number of damaged masks and masks of a wrong size so far.
  std::size_t unusable() const { return unusable_; }

 private:
  struct Entry {
    double stamp = 0;  // Timestamp [s]; unused if the names are not numbers.
    std::filesystem::path file;
  };
  const Entry* find(const RgbdFrame& frame) const;

  std::filesystem::path folder_;
  std::vector<Entry> entries_;  // sorted by timestamp or by name
  bool stamped_ = false;
  double tolerance_ = 0;  // seconds
  std::size_t missing_ = 0, unusable_ = 0, used_ = 0;
  MaskAgreement agreement_;  // of some of the masks
};

}  // namespace stillmap
