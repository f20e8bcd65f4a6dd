// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/onnx_info.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace stillmap {

/// A view of a dense, row-major float tensor.
struct TensorView {
  std::vector<std::int64_t> shape;
  std::span<const float> values;  ///< Product of `shape` values.
};

/// Runs one network on one image. Synchronous; one thread at a time per object. Equal inputs give
/// equal outputs, in every run and for any number of threads.
class InferenceEngine {
 public:
  virtual ~InferenceEngine() = default;
  /// 1 x 3 x height x width.
  virtual std::array<int, 4> input_shape() const = 0;
  /// Runs the network. `input` holds the product of input_shape() values.
  /// @return the outputs in the order of the file; valid until the next call
  virtual std::vector<TensorView> run(std::span<const float> input) = 0;
  /// Returns the back end and its version for logs: "OpenVINO 2026.4", "OpenCV 4.6.0", ...
  virtual std::string name() const = 0;
};

/// Network file and number of threads of an engine.
struct EngineOptions {
  std::string model;                 ///< Path of the .onnx file.
  std::array<int, 4> input_shape{};  ///< Shape 1 x 3 x height x width, all positive.
  std::vector<std::string> outputs;  ///< Names of the outputs in the order of the file.
  int threads = 1;                   ///< Number of threads of the network.
};

/// Returns the available back ends, fastest first: "openvino" if its plug-in is installed, and
/// "opencv".
std::vector<std::string> available_backends();

/// Starts an engine. `backend` is "openvino", "opencv", or "auto": OpenVINO if its plug-in is
/// installed and loads the network, otherwise OpenCV with a warning. Throws Error if the back end
/// is unknown, if it is "openvino" and a library is missing, or if the network does not load.
std::unique_ptr<InferenceEngine> make_engine(const std::string& backend,
                                             const EngineOptions& options);

}  // namespace stillmap
