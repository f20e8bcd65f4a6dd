// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/inference_engine.hpp"

#include "stillmap/base/error.hpp"

#include <spdlog/spdlog.h>

namespace stillmap {
namespace {

std::unique_ptr<InferenceEngine> start(const std::string& backend, const EngineOptions& options) {
  if (backend == "openvino") return engines::make_openvino(options);
  if (backend == "onnxruntime") return engines::make_onnxruntime(options);
  if (backend == "opencv") return engines::make_opencv(options);
  return nullptr;
}

std::string joined(const std::vector<std::string>& words) {
  return fmt::format("{}", fmt::join(words, ", "));
}

/// The first line of a library's message: the rest is its source lines.
std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

std::unique_ptr<InferenceEngine> start_named(const std::string& backend,
                                             const EngineOptions& options) {
  try {
    return start(backend, options);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& e) {
    throw Error(
        fmt::format("the {} back end cannot load this network: {}", backend, first_line(e.what())),
        options.model, export_advice() + ", or choose another back end");
  }
}

std::unique_ptr<InferenceEngine> start_first(const EngineOptions& options) {
  const auto backends = available_backends();
  for (const auto& backend : backends) {
    try {
      return start_named(backend, options);
    } catch (const Error& e) {
      if (backend == backends.back()) throw;
      spdlog::warn("{}; trying the next back end", e.problem());
    }
  }
  return nullptr;
}

}  // namespace

std::vector<std::string> available_backends() {
  std::vector<std::string> names;
  if (engines::has_openvino()) names.emplace_back("openvino");
  if (engines::has_onnxruntime()) names.emplace_back("onnxruntime");
  names.emplace_back("opencv");
  return names;
}

std::unique_ptr<InferenceEngine> make_engine(const std::string& backend,
                                             const EngineOptions& options) {
  auto engine = backend == "auto" ? start_first(options) : start_named(backend, options);
  if (!engine) {
    throw Error(fmt::format("this build has no inference back end \"{}\"", backend), "",
                "take one of: auto, " + joined(available_backends()));
  }
  return engine;
}

}  // namespace stillmap
