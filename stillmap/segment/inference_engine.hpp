// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/error.hpp"
#include "stillmap/segment/onnx_info.hpp"

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace stillmap {

/// A view of a dense, row-major float tensor.
struct TensorView {
  std::vector<std::int64_t> shape;
  std::span<const float> values;  ///< Product of `shape` values.
};

/// Library and device of an engine, for logs and the summary.
struct EngineName {
  std::string library;  ///< "OpenVINO", ...
  std::string version;  ///< Version of the library.
  std::string place;    ///< Device as a phrase: "on the CPU", ...

  std::string text() const { return library + " " + version + " " + place; }
};

/// Returns the number of values of a tensor.
template <typename Shape>
std::size_t count_of(const Shape& shape) {
  std::size_t count = 1;
  for (const auto size : shape) count *= static_cast<std::size_t>(size);
  return count;
}

/// Runs one network on one image. Synchronous; one thread at a time per object. Equal inputs give
/// equal outputs on the same device, in every run and for any number of threads.
class InferenceEngine {
 public:
  virtual ~InferenceEngine() = default;
  /// 1 x 3 x height x width, or 1 x height x width x 3.
  virtual std::array<int, 4> input_shape() const = 0;
  /// Returns the input, the product of input_shape() values, to be written before each run(). It is
  /// in the memory from which the device reads fastest.
  virtual std::span<float> input() = 0;
  /// Runs the network on the values of input().
  /// @return the outputs in the order of the file, 64-bit integers as floats; valid until the next
  /// call
  virtual std::vector<TensorView> run() = 0;
  virtual EngineName name() const = 0;
};

/// Returns the line of an inference library's message that names the cause; the others name its
/// source files.
std::string cause_in(const std::string& message);

/// Network file, device and number of threads of an engine.
struct EngineOptions {
  std::string model;                 ///< Path of the .onnx file.
  std::string input;                 ///< Name of the input.
  std::array<int, 4> input_shape{};  ///< As InferenceEngine::input_shape(), all positive.
  /// Sizes of the dynamic dimensions of the input by their names in the file.
  std::map<std::string, int> dynamic_dimensions;
  std::vector<std::string> outputs;  ///< Names of the outputs in the order of the file.
  std::string device = "cpu";        ///< tensorrt, cuda, intel-gpu, npu, cpu, or auto.
  int threads = 1;                   ///< Number of threads of the network (CPU).
};

/// An engine, and the reason for its device.
struct ChosenEngine {
  std::unique_ptr<InferenceEngine> engine;
  std::string device;  ///< The device on which it runs; not auto.
  std::string reason;  ///< What faster devices lack; empty if the device was asked for by name.
};

/// Returns the back ends that are installed, the fastest on the CPU first: "openvino",
/// "onnxruntime", and always "opencv".
std::vector<std::string> available_backends();

/// Returns a warning with its fix if a faster back end could be installed; none otherwise.
/// @param engine       name of the engine in use, which is not OpenVINO
/// @param has_openvino whether this build can use OpenVINO
std::optional<Error> slower_engine(const std::string& engine, bool has_openvino);

/// Starts an engine and runs it once if it is not on the CPU.
///
/// The device auto takes the first one that runs the network, in the order of
/// EngineOptions::device; a computer with a GPU but without the libraries for it gets a warning.
/// The back end auto takes the first of available_backends() that runs the network, with a warning
/// if that is not OpenVINO, which is the fastest on the CPU. Throws Error if the back end or the
/// device is unknown, if one that is asked for by name lacks a library or hardware, or if the
/// network does not load.
ChosenEngine choose_engine(const std::string& backend, const EngineOptions& options);

}  // namespace stillmap
