// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/onnxruntime_engine.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/warning.hpp"
#include "stillmap/segment/accelerator.hpp"

#include <stdexcept>
#include <utility>

#include <fmt/format.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

constexpr const char* kInstallCpu = "run `pip install onnxruntime`";
constexpr const char* kInstallCuda = R"(run `pip install "onnxruntime-gpu[cuda,cudnn]"`)";
constexpr const char* kInstallTensorRt =
    R"(run `pip install "onnxruntime-gpu[cuda,cudnn]" "tensorrt-cu13<11"`)";

const char* install_advice(const std::string& device) {
  if (device == "tensorrt") return kInstallTensorRt;
  return device == "cuda" ? kInstallCuda : kInstallCpu;
}

constexpr const char* kCudaFailure = "CUDA failure";

/// Returns how to get a library that runs on the device. An installed package has no effect while
/// the environment variable names another library.
std::string library_advice(const std::string& device) {
  const std::string given = given_onnxruntime().string();
  if (given.empty()) return install_advice(device);
  return fmt::format("correct or unset the environment variable {}, which is '{}'; without it, {}",
                     kOnnxRuntimeVariable, given, install_advice(device));
}

Error missing(const EngineOptions& options, const std::string& problem) {
  const std::string fix = problem.starts_with(kCudaFailure) ? driver_advice(options.device)
                                                            : library_advice(options.device);
  return {fmt::format("ONNX Runtime cannot use the device {}: {}", options.device, problem),
          "network.device", fix + ", or take another device"};
}

/// Returns the part of a message that names the cause, such as "LIBRARY: REASON" or "CUDA failure
/// 35: REASON"; the other parts name ONNX Runtime's source files.
std::string short_message(const std::string& text) {
  std::string line = text.substr(0, text.find('\n'));
  if (const auto found = line.find(kCudaFailure); found != std::string::npos)
    return line.substr(found, line.find(" ;", found) - found);
  for (const std::string mark : {"with error: ", "[ONNXRuntimeError] : "}) {
    if (const auto found = line.rfind(mark); found != std::string::npos)
      return line.substr(found + mark.size());
  }
  return line;
}

/// Calls functions of the library; failures become exceptions.
class Caller {
 public:
  explicit Caller(const ort::Api& api) : api_(&api) {}

  const ort::Api& api() const { return *api_; }
  void check(ort::Status* status) const {
    if (status == nullptr) return;
    const std::string message = short_message(api_->message(status));
    api_->release_status(status);
    throw std::runtime_error(message);
  }
  /// Returns a new object of the library.
  template <typename T, typename... Arguments, typename... Values>
  std::unique_ptr<T, void (*)(T*)> make(void (*release)(T*), ort::Status* (*create)(Arguments...),
                                        Values... values) const {
    T* made = nullptr;
    check(create(values..., &made));
    return {made, release};
  }

 private:
  const ort::Api* api_;
};

template <typename T>
using Owned = std::unique_ptr<T, void (*)(T*)>;
using Settings = std::vector<std::pair<std::string, std::string>>;

template <typename Options>
void update(const Caller& call, ort::Update<Options> update, Options* options,
            const Settings& settings) {
  std::vector<ort::Text> keys, values;
  for (const auto& [key, value] : settings) {
    keys.push_back(key.c_str());
    values.push_back(value.c_str());
  }
  call.check(update(options, keys.data(), values.data(), keys.size()));
}

/// One environment for the process, as ONNX Runtime demands; it is never released.
const ort::Env* environment_of(const Caller& call) {
  static const ort::Env* const made = [&call] {
    ort::Env* env = nullptr;
    call.check(call.api().create_env(ort::kLogFatal, "stillmap", &env));
    return env;
  }();
  return made;
}

/// Returns the folder, next to the model, of TensorRT's engine and timing cache, which take minutes
/// to build; empty if it cannot be written.
std::string tensorrt_cache(const std::string& model) {
  const fs::path folder = model + ".tensorrt";
  std::error_code error;
  if (fs::exists(folder) && !fs::is_empty(folder, error)) return folder.string();
  fs::create_directories(folder, error);
  warn(error
           ? fmt::format("TensorRT builds its engine in every run, since {} cannot be written ({})",
                         folder.string(), error.message())
           : fmt::format("TensorRT builds its engine for this network, which takes minutes, once; "
                         "it is kept in {}",
                         folder.string()),
       "");
  return error ? std::string() : folder.string();
}

/// 16-bit floats, with the engine and the timings of its construction kept on disk.
Settings tensorrt_settings(const std::string& cache) {
  Settings settings = {{"trt_fp16_enable", "1"}};
  if (!cache.empty()) {
    for (const std::string kind : {"engine", "timing"}) {
      settings.emplace_back("trt_" + kind + "_cache_enable", "1");
      settings.emplace_back("trt_" + kind + "_cache_path", cache);
    }
  }
  return settings;
}

/// Operators that TensorRT does not support run on CUDA. CUDA's convolution algorithms are chosen
/// by rules: a choice by measured times, and with it the results, would differ from run to run.
void append_providers(const Caller& call, const EngineOptions& options,
                      ort::SessionOptions* session) {
  const ort::Api& api = call.api();
  if (options.device == "tensorrt") {
    const auto tensorrt = call.make(api.release_tensorrt_options, api.create_tensorrt_options);
    // Without a cache first, since this fails if a library is missing.
    update(call, api.update_tensorrt_options, tensorrt.get(), tensorrt_settings(""));
    update(call, api.update_tensorrt_options, tensorrt.get(),
           tensorrt_settings(tensorrt_cache(options.model)));
    call.check(api.append_tensorrt(session, tensorrt.get()));
  }
  const auto cuda = call.make(api.release_cuda_options, api.create_cuda_options);
  update(call, api.update_cuda_options, cuda.get(), {{"cudnn_conv_algo_search", "HEURISTIC"}});
  call.check(api.append_cuda(session, cuda.get()));
}

void use_nvidia_gpu(const Caller& call, const OnnxRuntimeLibrary& library,
                    const EngineOptions& options, ort::SessionOptions* session) {
  for (const std::string& provider : {options.device, std::string("cuda")}) {
    const std::string file = "libonnxruntime_providers_" + provider + ".so";
    if (!fs::exists(library.folder() / file))
      throw missing(options, fmt::format("version {} has no {}", library.version(), file));
  }
  open_nvidia_packages(library);
  try {
    append_providers(call, options, session);
  } catch (const std::runtime_error& e) {
    throw missing(options, e.what());
  }
}

class OnnxRuntimeEngine final : public InferenceEngine {
 public:
  OnnxRuntimeEngine(const EngineOptions& options, const OnnxRuntimeLibrary& library)
      : call_(library.api()),
        options_(options),
        name_(name_of(options, library)),
        memory_(call_.make(call_.api().release_memory, call_.api().create_cpu_memory, ort::kArena,
                           ort::kDefaultMemory)),
        session_(start(library)) {
    for (const auto& output : options_.outputs) output_names_.push_back(output.c_str());
  }

  std::array<int, 4> input_shape() const override { return options_.input_shape; }

  std::vector<TensorView> run(std::span<const float> input) override {
    outputs_.clear();
    const auto& sizes = options_.input_shape;
    const std::array<std::int64_t, 4> shape = {sizes[0], sizes[1], sizes[2], sizes[3]};
    // The tensor is only read; the library has no const view.
    const auto tensor =
        call_.make(call_.api().release_value, call_.api().create_tensor, memory_.get(),
                   static_cast<void*>(const_cast<float*>(input.data())), input.size_bytes(),
                   shape.data(), shape.size(), ort::kFloatTensor);
    const ort::Value* inputs = tensor.get();
    const ort::Text input_name = options_.input.c_str();
    std::vector<ort::Value*> made(output_names_.size(), nullptr);
    call_.check(call_.api().run(session_.get(), nullptr, &input_name, &inputs, 1,
                                output_names_.data(), made.size(), made.data()));
    for (auto* value : made) outputs_.emplace_back(value, call_.api().release_value);
    std::vector<TensorView> views;
    for (const auto& output : outputs_) views.push_back(view(output.get()));
    return views;
  }

  EngineName name() const override { return name_; }

 private:
  static EngineName name_of(const EngineOptions& options, const OnnxRuntimeLibrary& library) {
    EngineName name = {"ONNX Runtime", library.version(), "on the CPU"};
    if (options.device != "cpu") {
      name.place = fmt::format("with {} on {}", options.device == "cuda" ? "CUDA" : "TensorRT",
                               nvidia_gpu_name());
    }
    return name;
  }

  Owned<ort::Session> start(const OnnxRuntimeLibrary& library) const {
    const ort::Api& api = call_.api();
    const ort::Env* const environment = environment_of(call_);  // before all other calls
    const auto options = call_.make(api.release_session_options, api.create_session_options);
    call_.check(api.set_threads(options.get(), options_.threads));
    // Threads that wait for work leave the cores to the tracker.
    call_.check(api.set_entry(options.get(), "session.intra_op.allow_spinning", "0"));
    call_.check(api.set_deterministic(options.get(), true));
    for (const auto& [dimension, size] : options_.dynamic_dimensions)
      call_.check(api.fix_dimension(options.get(), dimension.c_str(), size));
    if (options_.device != "cpu") use_nvidia_gpu(call_, library, options_, options.get());
    try {
      return call_.make(api.release_session, api.create_session, environment,
                        options_.model.c_str(),
                        static_cast<const ort::SessionOptions*>(options.get()));
    } catch (const std::runtime_error& e) {
      if (std::string_view(e.what()).starts_with(kCudaFailure)) throw missing(options_, e.what());
      throw;
    }
  }

  TensorView view(ort::Value* value) const {
    const ort::Api& api = call_.api();
    const auto shape =
        call_.make(api.release_shape, api.tensor_shape, static_cast<const ort::Value*>(value));
    int type = 0;
    std::size_t dimensions = 0;
    call_.check(api.element_type(shape.get(), &type));
    if (type != ort::kFloatTensor)
      throw std::runtime_error("an output is no tensor of 32-bit floats");
    call_.check(api.dimension_count(shape.get(), &dimensions));
    TensorView view;
    view.shape.resize(dimensions);
    call_.check(api.dimensions(shape.get(), view.shape.data(), dimensions));
    void* data = nullptr;
    call_.check(api.tensor_data(value, &data));
    std::size_t count = 1;
    for (const auto n : view.shape) count *= static_cast<std::size_t>(n);
    view.values = {static_cast<const float*>(data), count};
    return view;
  }

  Caller call_;
  EngineOptions options_;
  EngineName name_;
  Owned<ort::MemoryInfo> memory_;
  Owned<ort::Session> session_;
  std::vector<ort::Text> output_names_;
  std::vector<Owned<ort::Value>> outputs_;  // of the last run
};

}  // namespace

std::unique_ptr<InferenceEngine> make_onnxruntime_engine(const EngineOptions& options,
                                                         const OnnxRuntimeLibrary& library) {
  if (!library.loaded()) {
    throw Error("ONNX Runtime cannot be loaded: " + library.problem(),
                "network.backend, network.device",
                given_onnxruntime().empty()
                    ? fmt::format("{}, or let the environment variable {} name its folder",
                                  install_advice(options.device), kOnnxRuntimeVariable)
                    : library_advice(options.device));
  }
  return std::make_unique<OnnxRuntimeEngine>(options, library);
}

}  // namespace stillmap
