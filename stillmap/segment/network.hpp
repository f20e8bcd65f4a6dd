// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/detector.hpp"
#include "stillmap/segment/inference_engine.hpp"
#include "stillmap/segment/letterbox.hpp"
#include "stillmap/segment/segment_options.hpp"

#include <string>
#include <vector>

namespace stillmap {

/// Name of an output with class numbers, the only one that may hold integers.
inline constexpr const char* kLabels = "labels";

/// A network file on one of the back ends, with an image as its only input. What its outputs mean
/// is up to the detectors.
class Network {
 public:
  /// Loads `options.model` and runs it once. Throws Error if the file is missing, not a network, or
  /// made for another task; if the back end is not available; or if an option is invalid.
  explicit Network(const SegmentOptions& options);

  const SegmentOptions& options() const { return options_; }
  /// Returns the size of the network's input [pixels].
  cv::Size input_size() const;
  /// Returns whether the input is 1 x height x width x 3.
  bool channels_last() const { return channels_last_; }
  /// Returns the class names of the metadata; none if there are none.
  const std::vector<std::string>& class_names() const { return class_names_; }
  /// Returns the names of the outputs in the order of the file.
  const std::vector<std::string>& output_names() const { return output_names_; }
  /// Returns the shapes of the outputs in a real run, since back ends and dynamic files differ from
  /// the declared ones.
  std::vector<std::vector<std::int64_t>> output_shapes() const;
  /// Returns the outputs of the last run, of the constructor's if there was no other.
  const std::vector<TensorView>& outputs() const { return outputs_; }
  /// Runs the network on an 8UC3 BGR image; throws Error for other images.
  const std::vector<TensorView>& run_on(const cv::Mat& color, const Letterbox& letterbox,
                                        const PixelFormat& format);

  InferenceInfo inference() const;
  /// Returns whether the device is so fast that the tracker can wait for it in every frame.
  bool immediate() const { return engine_.device == "tensorrt" || engine_.device == "cuda"; }
  /// Returns one line for logs and the summary. `kind` is what an instance has: masks or boxes.
  std::string description(const std::string& kind, std::size_t classes) const;

 private:
  void run_once();

  SegmentOptions options_;
  bool channels_last_ = false;
  std::vector<std::string> class_names_;
  std::vector<std::string> output_names_;
  ChosenEngine engine_;
  std::vector<TensorView> outputs_;
};

}  // namespace stillmap
