// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/inference_engine.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/warning.hpp"
#include "stillmap/segment/accelerator.hpp"
#include "stillmap/segment/onnxruntime_engine.hpp"
#include "stillmap/segment/opencv_engine.hpp"
#include "stillmap/segment/openvino_plugin.hpp"

#include <algorithm>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace stillmap {
namespace {

constexpr const char* kInstallOpenVino =
    "run scripts/install_dependencies.sh in the source folder, then build and install again";
constexpr const char* kInstallOnnxRuntime =
    "pip install onnxruntime, in the active environment or the one with this program";

using EnginePtr = std::unique_ptr<InferenceEngine>;
using Names = std::vector<std::string>;

/// A device and the back ends that run networks on it, the fastest first.
struct Device {
  std::string name;
  Names backends;
};

/// Returns the devices, the fastest first.
const std::vector<Device>& devices() {
  static const std::vector<Device> all = {{"tensorrt", {"onnxruntime"}},
                                          {"cuda", {"onnxruntime"}},
                                          {"intel-gpu", {"openvino"}},
                                          {"npu", {"openvino"}},
                                          {"cpu", {"openvino", "onnxruntime", "opencv"}}};
  return all;
}

bool contains(const Names& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Returns the error about a network, or about a device whose driver is then the usual cause.
Error cannot_load(const std::string& backend, const EngineOptions& options,
                  const std::exception& reason) {
  const bool cpu = options.device == "cpu";
  const std::string place = cpu ? "" : " on the device " + options.device;
  Names dynamic;
  for (const auto& [name, size] : options.dynamic_dimensions) dynamic.push_back(name);
  const std::string sizes =
      dynamic.empty() ? ""
                      : fmt::format(", whose sizes are dynamic ({})", fmt::join(dynamic, ", "));
  return {fmt::format("the {} back end cannot load this network{}{}: {}", backend, sizes, place,
                      cause_in(reason.what())),
          options.model,
          (backend == "opencv" ? kInstallOnnxRuntime + std::string(" (it loads more networks); or ")
                               : "") +
              (cpu ? export_advice() : driver_advice(options.device)) +
              (dynamic.empty() ? "" : ", without dynamic=True") + ", or choose another " +
              (cpu ? "back end" : "device")};
}

EnginePtr start_openvino(const EngineOptions& options) {
  const OpenVinoPlugin& plugin = OpenVinoPlugin::instance();
  if (!plugin.loaded() && !OpenVinoPlugin::supported()) {
    throw Error("this build of Stillmap has no OpenVINO back end", "network.backend",
                std::string(kInstallOnnxRuntime) + ", and take the back end onnxruntime or auto");
  }
  if (!plugin.loaded()) {
    throw Error("the OpenVINO back end is not installed: " + plugin.problem(), "network.backend",
                std::string(kInstallOpenVino) + ", or take the back end opencv or auto");
  }
  return plugin.make_engine(options);
}

EnginePtr start_backend(const std::string& backend, const EngineOptions& options) {
  try {
    if (backend == "openvino") return start_openvino(options);
    if (backend == "onnxruntime") return make_onnxruntime_engine(options);
    return make_opencv_engine(options);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& e) {
    throw cannot_load(backend, options, e);
  }
}

bool installed(const std::string& backend) {
  if (backend == "openvino") return OpenVinoPlugin::instance().loaded();
  return backend == "opencv" || OnnxRuntimeLibrary::instance().loaded();
}

void warn_of_slower_engine(const std::string& engine) {
  static const bool warned = [&] {
    const auto slower = slower_engine(engine, OpenVinoPlugin::supported());
    if (slower) warn(slower->problem(), slower->fix());
    return true;
  }();
  (void)warned;
}

/// Starts the fastest back end that is installed and supports all operators of the network. If none
/// does, throws the Error of the fastest one.
EnginePtr start_on_cpu(const EngineOptions& options) {
  std::optional<Error> first;
  for (const std::string& backend : devices().back().backends) {
    if (!installed(backend)) continue;
    try {
      EnginePtr engine = start_backend(backend, options);
      if (!installed("openvino")) warn_of_slower_engine(engine->name().text());
      if (first)
        warn(fmt::format("{}; it runs on {}", first->problem(), engine->name().text()),
             export_advice());
      return engine;
    } catch (const Error& e) {
      if (!first) first = e;
    }
  }
  throw Error(*first);  // OpenCV is always installed
}

/// Runs the network once, since accelerators finish loading in the first run.
void warm_up(const std::string& backend, const EngineOptions& options, InferenceEngine& engine) {
  try {
    std::ranges::fill(engine.input(), 0.0F);
    engine.run();
  } catch (const std::exception& e) {
    throw cannot_load(backend, options, e);
  }
}

EnginePtr start_on_accelerator(const std::string& backend, const EngineOptions& options) {
  if (const auto problem = missing_hardware(options.device); !problem.empty()) {
    throw Error(fmt::format("the device {} is missing: {}", options.device, problem),
                "network.device",
                driver_advice(options.device) + ", or take the device cpu or auto");
  }
  EnginePtr engine = start_backend(backend, options);
  warm_up(backend, options, *engine);
  return engine;
}

/// Starts a device that was asked for by name.
EnginePtr start_device(const Device& device, const std::string& backend,
                       const EngineOptions& options) {
  if (backend != "auto" && !contains(device.backends, backend)) {
    throw Error(fmt::format("the back end {} does not run on the device {}", backend, device.name),
                "network.backend, network.device",
                "take the back end auto or " + device.backends.front());
  }
  if (device.name != "cpu")
    return start_on_accelerator(backend == "auto" ? device.backends.front() : backend, options);
  return backend == "auto" ? start_on_cpu(options) : start_backend(backend, options);
}

/// Starts the fastest device that runs the network.
ChosenEngine start_fastest(const std::string& backend, EngineOptions options) {
  Names missing;
  for (const Device& device : devices()) {
    if (backend != "auto" && !contains(device.backends, backend)) continue;
    options.device = device.name;
    std::string problem = missing_hardware(device.name);
    if (problem.empty()) {
      try {
        EnginePtr engine = start_device(device, backend, options);
        return {std::move(engine), device.name, fmt::format("{}", fmt::join(missing, ", "))};
      } catch (const Error& e) {
        if (device.name == "cpu") throw;
        if (device.name == "cuda") warn(e.problem() + "; the network runs elsewhere", e.fix());
        problem = e.problem();
      }
    }
    if (!contains(missing, problem)) missing.push_back(problem);
  }
  return {};
}

/// Returns the text behind the last occurrence of `mark`, up to the end of its line; empty if it
/// does not occur.
std::string line_behind(const std::string& mark, const std::string& text) {
  const auto found = text.rfind(mark);
  if (found == std::string::npos) return {};
  const auto start = found + mark.size();
  return text.substr(start, text.find('\n', start) - start);
}

}  // namespace

std::optional<Error> slower_engine(const std::string& engine, bool has_openvino) {
  if (has_openvino) {
    return Error(
        fmt::format(
            "the network runs on {}, since OpenVINO, which is faster, cannot be loaded ({})",
            engine, OpenVinoPlugin::instance().problem()),
        "", kInstallOpenVino);
  }
  if (engine.starts_with("ONNX Runtime")) return std::nullopt;
  return Error(
      fmt::format(
          "the network runs on {}, since ONNX Runtime, which is faster, cannot be loaded ({})",
          engine, OnnxRuntimeLibrary::instance().problem()),
      "", kInstallOnnxRuntime);
}

std::string cause_in(const std::string& message) {
  std::string text = message;
  text.erase(text.find_last_not_of(" \n>") + 1);
  if (text.starts_with("Exception from")) {  // OpenVINO; the lines before name its source files
    const std::string summary = line_behind("Summary:\n-- ", text);
    return summary.empty() ? line_behind("\n", text) : summary;
  }
  if (const std::string found = line_behind("error: ", text); text.starts_with("OpenCV("))
    return found;
  return text.substr(0, text.find('\n'));
}

std::vector<std::string> available_backends() {
  Names names;
  for (const std::string& backend : devices().back().backends) {
    if (installed(backend)) names.push_back(backend);
  }
  return names;
}

ChosenEngine choose_engine(const std::string& backend, const EngineOptions& options) {
  const Names& known = devices().back().backends;
  if (backend != "auto" && !contains(known, backend)) {
    throw Error(fmt::format("unknown inference back end \"{}\"", backend), "network.backend",
                fmt::format("take one of: auto, {}", fmt::join(known, ", ")));
  }
  if (options.device == "auto") return start_fastest(backend, options);
  for (const Device& device : devices()) {
    if (device.name == options.device)
      return {start_device(device, backend, options), device.name, ""};
  }
  throw Error(fmt::format("unknown device \"{}\"", options.device), "network.device",
              "take one of: auto, tensorrt, cuda, intel-gpu, npu, cpu");
}

}  // namespace stillmap
