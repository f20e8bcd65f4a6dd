// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/network.hpp"

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace stillmap {

/// What all detectors with a network share.
class NetworkDetector : public Detector {
 public:
  std::string description() const override {
    return network_.description(gives_masks() ? "masks" : "boxes", class_names_.size());
  }
  std::optional<InferenceInfo> inference() const override { return network_.inference(); }
  bool immediate() const override { return network_.immediate(); }
  const std::vector<std::string>& class_names() const override { return class_names_; }

 protected:
  /// Takes the class names of the metadata; there may be none.
  explicit NetworkDetector(Network network)
      : network_(std::move(network)), class_names_(network_.class_names()) {}

  Network network_;
  std::vector<std::string> class_names_;
};

}  // namespace stillmap
