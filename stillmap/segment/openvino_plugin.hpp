// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/inference_engine.hpp"

#include <memory>
#include <string>

// The functions that libstillmap_openvino.so exports (plugin/openvino_engine.cpp).
extern "C" {
/// Returns the version of Stillmap that the plug-in was built with.
__attribute__((visibility("default"))) const char* stillmap_openvino_version();
/// Returns a new engine that the caller deletes. Throws OpenVINO's exceptions.
__attribute__((visibility("default"))) stillmap::InferenceEngine* stillmap_openvino_engine(
    const stillmap::EngineOptions* options);
}

namespace stillmap {

/// The OpenVINO back end as a plug-in, so that the command also starts where OpenVINO is missing.
/// The dynamic loader looks for libstillmap_openvino.so in the run path of the program: the build
/// folder, or PREFIX/lib/stillmap of an installed command. Once loaded, it stays loaded.
class OpenVinoPlugin {
 public:
  /// Loads the plug-in at the first call. Thread-safe.
  static const OpenVinoPlugin& instance();

  bool loaded() const { return make_engine_ != nullptr; }
  /// Returns the reason of the dynamic loader, which names the missing library; empty if loaded.
  const std::string& problem() const { return problem_; }
  /// Returns whether this build can load OpenVINO if it is installed; the Python package cannot.
  static bool supported();
  /// Starts an engine; null if the plug-in is not loaded. Throws OpenVINO's exceptions.
  std::unique_ptr<InferenceEngine> make_engine(const EngineOptions& options) const;

 private:
  OpenVinoPlugin();

  decltype(&stillmap_openvino_engine) make_engine_ = nullptr;
  std::string problem_;
};

}  // namespace stillmap
