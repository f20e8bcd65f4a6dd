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

/// A dense float tensor that lives elsewhere; row-major.
struct TensorView {
  std::vector<std::int64_t> shape;
  std::span<const float> values;  ///< product of `shape` of them
};

/// Runs one network on one image-like input. Synchronous; one thread at a time per object. Outputs
/// are equal for equal inputs, run after run and for any number of threads.
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

/// What an engine needs to start.
struct EngineOptions {
  std::string model;                 ///< .onnx file
  std::array<int, 4> input_shape{};  ///< 1 x 3 x height x width, all positive
  std::vector<std::string> outputs;  ///< names, in the order of the file
  int threads = 1;
};

/// The back ends that this build has, best first: "openvino", "onnxruntime", "opencv".
std::vector<std::string> available_backends();

/// Starts an engine. `backend` is one of available_backends(), or "auto" for the first of them that
/// loads the network. Throws Error if the back end is unknown or not in this build, or if the
/// network does not load.
std::unique_ptr<InferenceEngine> make_engine(const std::string& backend,
                                             const EngineOptions& options);

namespace engines {
/// The single back ends; null where this build lacks it. Each throws its library's exceptions, or
/// Error.
std::unique_ptr<InferenceEngine> make_openvino(const EngineOptions& options);
std::unique_ptr<InferenceEngine> make_onnxruntime(const EngineOptions& options);
std::unique_ptr<InferenceEngine> make_opencv(const EngineOptions& options);
bool has_openvino();
bool has_onnxruntime();
}  // namespace engines

}  // namespace stillmap
