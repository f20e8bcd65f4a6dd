// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/inference_engine.hpp"
#include "stillmap/segment/onnxruntime_library.hpp"

#include <memory>

namespace stillmap {

/// Loads the network into ONNX Runtime on the device cpu, cuda or tensorrt. Throws Error that names
/// the missing library and the command that installs it if the device cannot be used, and
/// std::runtime_error if the network does not load. `library` must outlive the engine.
std::unique_ptr<InferenceEngine> make_onnxruntime_engine(
    const EngineOptions& options,
    const OnnxRuntimeLibrary& library = OnnxRuntimeLibrary::instance());

}  // namespace stillmap
