// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/instance.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <string>
#include <vector>

namespace stillmap {

/// Finds instances in single frames: a network, or a folder of masks made offline. Synchronous; one
/// thread at a time per object.
class Detector {
 public:
  virtual ~Detector() = default;
  /// Instances of the frame, by falling confidence; deterministic for equal pixels.
  virtual std::vector<Instance> detect(const RgbdFrame& frame) = 0;
  /// One line for logs and the summary: model, back end, input size, threads.
  virtual std::string description() const = 0;
  /// What was left out so far, in one line for the summary; empty if nothing was.
  virtual std::string skipped() const { return {}; }
  /// Class names by class id.
  virtual const std::vector<std::string>& class_names() const = 0;
};

}  // namespace stillmap
