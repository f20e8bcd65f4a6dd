// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/inference_engine.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/warning.hpp"
#include "stillmap/segment/opencv_engine.hpp"
#include "stillmap/segment/openvino_plugin.hpp"

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr const char* kInstallOpenVino =
    "run scripts/install_dependencies.sh in the source folder, then build and install again";

/// Returns the first line of a library's message; the others name its source files.
std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

Error cannot_load(const std::string& backend, const EngineOptions& options,
                  const std::exception& reason) {
  return {fmt::format("the {} back end cannot load this network: {}", backend,
                      first_line(reason.what())),
          options.model, export_advice() + ", or choose another back end"};
}

std::unique_ptr<InferenceEngine> start_opencv(const EngineOptions& options) {
  try {
    return make_opencv_engine(options);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& e) {
    throw cannot_load("opencv", options, e);
  }
}

std::unique_ptr<InferenceEngine> start_openvino(const EngineOptions& options) {
  const OpenVinoPlugin& plugin = OpenVinoPlugin::instance();
  if (!plugin.loaded()) {
    throw Error("the OpenVINO back end is not installed: " + plugin.problem(), "network.backend",
                std::string(kInstallOpenVino) + ", or take the back end opencv or auto");
  }
  try {
    return plugin.make_engine(options);
  } catch (const std::exception& e) {
    throw cannot_load("openvino", options, e);
  }
}

void warn_of_missing_openvino() {
  static const bool warned = [] {
    warn(fmt::format(
             "the network runs on OpenCV, which is slower, since OpenVINO cannot be loaded ({})",
             OpenVinoPlugin::instance().problem()),
         kInstallOpenVino);
    return true;
  }();
  (void)warned;
}

/// Starts OpenVINO if it is installed and supports all operators of the network, OpenCV otherwise.
std::unique_ptr<InferenceEngine> start_fastest(const EngineOptions& options) {
  if (!OpenVinoPlugin::instance().loaded()) {
    warn_of_missing_openvino();
    return start_opencv(options);
  }
  try {
    return start_openvino(options);
  } catch (const Error& e) {
    auto engine = start_opencv(options);
    warn(e.problem() + "; it runs on OpenCV, which is slower", export_advice());
    return engine;
  }
}

}  // namespace

std::vector<std::string> available_backends() {
  if (!OpenVinoPlugin::instance().loaded()) return {"opencv"};
  return {"openvino", "opencv"};
}

std::unique_ptr<InferenceEngine> make_engine(const std::string& backend,
                                             const EngineOptions& options) {
  if (backend == "auto") return start_fastest(options);
  if (backend == "openvino") return start_openvino(options);
  if (backend == "opencv") return start_opencv(options);
  throw Error(fmt::format("unknown inference back end \"{}\"", backend), "network.backend",
              "take one of: auto, openvino, opencv");
}

}  // namespace stillmap
