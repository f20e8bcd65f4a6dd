// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/error.hpp"
#include "stillmap/segment/detector.hpp"

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// Wraps a detector so that a failure does not end the run: the frame has no instances. Failures
/// are exceptions, boxes that are not within the image, and masks that are not 8UC1 of the size of
/// their box. The first failure is reported by warn(), all are counted.
class TolerantDetector final : public Detector {
 public:
  explicit TolerantDetector(std::unique_ptr<Detector> detector) : detector_(std::move(detector)) {}

  std::vector<Instance> detect(const RgbdFrame& frame) override;
  std::string description() const override { return detector_->description(); }
  std::optional<InferenceInfo> inference() const override { return detector_->inference(); }
  bool immediate() const override { return detector_->immediate(); }
  std::string skipped() const override;
  std::size_t failures() const override { return detector_->failures() + failed_; }
  std::optional<Finding> finding() const override { return detector_->finding(); }
  bool gives_masks() const override { return detector_->gives_masks(); }
  const std::vector<std::string>& class_names() const override { return detector_->class_names(); }

 private:
  void count(const Error& failure, std::size_t frame);

  const std::unique_ptr<Detector> detector_;
  std::size_t frames_ = 0, failed_ = 0;
  std::string first_failure_;
};

}  // namespace stillmap
