// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/finding.hpp"
#include "stillmap/segment/instance.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// Inference library and device of a network.
struct InferenceInfo {
  std::string backend;  ///< Library: OpenVINO, ONNX Runtime or OpenCV.
  std::string version;  ///< Version of the library.
  std::string device;   ///< tensorrt, cuda, intel-gpu, npu or cpu.
};

/// Detects instances in single frames, by a network or from a folder of masks. Synchronous; one
/// thread at a time per object.
class Detector {
 public:
  virtual ~Detector() = default;
  /// Returns the instances of the frame by descending confidence; deterministic for equal pixels.
  virtual std::vector<Instance> detect(const RgbdFrame& frame) = 0;
  /// Returns one line for logs and the summary: model, input size, back end, device, threads.
  virtual std::string description() const = 0;
  /// Returns library and device of the network; none for a detector that is not a network.
  virtual std::optional<InferenceInfo> inference() const { return std::nullopt; }
  /// Returns whether detection is so fast that the tracker can wait for it in every frame.
  virtual bool immediate() const { return false; }
  /// Returns one line about skipped frames for the summary; empty if there are none.
  virtual std::string skipped() const { return {}; }
  /// Returns the number of frames so far for which there was nothing usable to detect from.
  virtual std::size_t failures() const { return 0; }
  /// Returns why what it detected so far should not be trusted; none if there is no reason.
  virtual std::optional<Finding> finding() const { return std::nullopt; }
  /// Returns whether instances have masks; otherwise they have boxes only.
  virtual bool gives_masks() const { return true; }
  /// Returns the class names by class id.
  virtual const std::vector<std::string>& class_names() const = 0;
};

/// Returns the instances in a mask image, by descending size. Values: 0 is static or unknown; 255
/// is a person (class id 0); every other value is the class "unknown" (class id 1), a moving object
/// without class name. Each connected component (8-neighbors) of one value is one instance;
/// components of fewer than 16 pixels are ignored.
std::vector<Instance> instances_of_mask(const cv::Mat1b& mask);

/// Makes the detector that a text names: a network (a file NAME.onnx) or a folder with one mask per
/// frame. Throws Error that lists the known forms for any other text, and if it cannot be used.
std::unique_ptr<Detector> make_detector(const std::string& text);

}  // namespace stillmap
