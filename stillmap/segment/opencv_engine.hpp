// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/inference_engine.hpp"

#include <memory>

namespace stillmap {

/// Starts OpenCV's network runner, which is slower than OpenVINO but always available. Throws Error
/// or OpenCV's exceptions if the network does not load.
std::unique_ptr<InferenceEngine> make_opencv_engine(const EngineOptions& options);

}  // namespace stillmap
