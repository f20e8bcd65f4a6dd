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

/// A dense, row-major float tensor in memory of somebody else.
struct TensorView {
  std::vector<std::int64_t> shape;
  std::span<const float> values;  ///< as many as the product of `shape`
};

/// Runs one network on one image. Synchronous; an object serves one thread at a time. Outputs are
/// equal for equal inputs, in every run and for any number of threads.
class InferenceEngine {
 public:
  virtual ~InferenceEngine() = default;
  /// 1 x 3 x height x width.
  virtual std::array<int, 4> input_shape() const = 0;
  /// Runs the network. `input` holds the product of input_shape() values.
  /// @return the outputs in the order of the file; valid until the next call
  virtual std::vector<TensorView> run(std::span<const float> input) = 0;
  /// Back end and version, for logs: "OpenVINO 2026.4", "OpenCV 4.6.0", ...
  virtual std::string name() const = 0;
};

/// The network that an engine loads, and the threads it may use.
struct EngineOptions {
  std::string model;                 ///< the .onnx file
  std::array<int, 4> input_shape{};  ///< 1 x 3 x height x width, all positive
  std::vector<std::string> outputs;  ///< names of the outputs in the order of the file
  int threads = 1;                   ///< threads of the network
};

/// Returns the back ends that can be loaded, fastest first: "openvino" if its plug-in is there, and
/// "opencv".
std::vector<std::string> available_backends();

/// Starts an engine. `backend` is "openvino", "opencv", or "auto": OpenVINO if its plug-in is there
/// and loads the network, else OpenCV with a warning that says why. Throws Error if the back end is
/// unknown, if it is "openvino" and a library is missing, or if the network does not load.
std::unique_ptr<InferenceEngine> make_engine(const std::string& backend,
                                             const EngineOptions& options);

}  // namespace stillmap
