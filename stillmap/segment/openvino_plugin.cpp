// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/openvino_plugin.hpp"

#include <dlfcn.h>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr const char* kLibrary = "libstillmap_openvino.so";

template <typename Function>
Function* function_in(void* library, const char* name) {
  return reinterpret_cast<Function*>(dlsym(library, name));
}

/// Returns the last error message of dlopen or dlsym.
std::string loader_problem() {
  const char* problem = dlerror();
  return problem != nullptr ? problem : fmt::format("{} cannot be loaded", kLibrary);
}

}  // namespace

OpenVinoPlugin::OpenVinoPlugin() {
  void* library = dlopen(kLibrary, RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    problem_ = loader_problem();
    return;
  }
  const auto version =
      function_in<decltype(stillmap_openvino_version)>(library, "stillmap_openvino_version");
  const auto engine =
      function_in<decltype(stillmap_openvino_engine)>(library, "stillmap_openvino_engine");
  if (version == nullptr || engine == nullptr) {
    problem_ = loader_problem();
  } else if (const std::string found = version(); found != STILLMAP_VERSION) {
    problem_ =
        fmt::format("{} belongs to Stillmap {}, not to {}", kLibrary, found, STILLMAP_VERSION);
  } else {
    make_engine_ = engine;
  }
}

bool OpenVinoPlugin::supported() {
#ifdef STILLMAP_WITHOUT_OPENVINO
  return false;
#else
  return true;
#endif
}

const OpenVinoPlugin& OpenVinoPlugin::instance() {
  static const OpenVinoPlugin plugin;
  return plugin;
}

std::unique_ptr<InferenceEngine> OpenVinoPlugin::make_engine(const EngineOptions& options) const {
  return std::unique_ptr<InferenceEngine>(loaded() ? make_engine_(&options) : nullptr);
}

}  // namespace stillmap
