// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/onnxruntime_engine.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/warning.hpp"
#include "stillmap/segment/accelerator.hpp"
#include "stillmap/segment/tensorrt_cache.hpp"

#include <dlfcn.h>
#include <list>
#include <map>
#include <mutex>
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

/// Returns how to install the libraries on which one with CUDA depends, next to it.
std::string dependency_advice(const std::string& device) {
  const std::string given = given_onnxruntime().string();
  const std::string advice = install_advice(device);
  return given.empty() ? advice : fmt::format("{} in the environment of '{}'", advice, given);
}

Error missing(const EngineOptions& options, const std::string& problem, const std::string& fix) {
  return {fmt::format("ONNX Runtime cannot use the device {}: {}", options.device, problem),
          "network.device", fix + ", or take another device"};
}

/// Returns the error for a failure of an execution provider: of the driver, or a missing library.
Error cannot_start(const EngineOptions& options, const std::exception& reason) {
  const std::string problem = reason.what();
  return missing(options, problem,
                 problem.starts_with(kCudaFailure) ? driver_advice(options.device)
                                                   : dependency_advice(options.device));
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

/// Returns the environment of the library: one for the process, as ONNX Runtime demands; it is
/// never released.
const ort::Env* environment_of(const Caller& call) {
  static std::mutex mutex;
  static auto& made = *new std::map<const ort::Api*, const ort::Env*>;  // lives as long as they do
  const std::scoped_lock guard(mutex);
  const ort::Env*& environment = made[&call.api()];
  if (environment == nullptr) {
    ort::Env* env = nullptr;
    call.check(call.api().create_env(ort::kLogFatal, "stillmap", &env));
    environment = env;
  }
  return environment;
}

/// 16-bit floats, with the engine and the timings of its construction kept on disk.
Settings tensorrt_settings(const fs::path& cache) {
  Settings settings = {{"trt_fp16_enable", "1"}};
  if (!cache.empty()) {
    for (const std::string kind : {"engine", "timing"}) {
      settings.emplace_back("trt_" + kind + "_cache_enable", "1");
      settings.emplace_back("trt_" + kind + "_cache_path", cache.string());
    }
  }
  return settings;
}

Owned<ort::TensorRtOptions> tensorrt_options(const Caller& call, const fs::path& cache) {
  const ort::Api& api = call.api();
  auto options = call.make(api.release_tensorrt_options, api.create_tensorrt_options);
  update(call, api.update_tensorrt_options, options.get(), tensorrt_settings(cache));
  return options;
}

/// Checks that the execution providers and the libraries that they need can be opened. Throws Error
/// that names the first one that is missing.
void require_nvidia_libraries(const EngineOptions& options, const OnnxRuntimeLibrary& library) {
  for (const std::string& provider : {options.device, std::string("cuda")}) {
    const std::string file = "libonnxruntime_providers_" + provider + ".so";
    if (!fs::exists(library.folder() / file))
      throw missing(options, fmt::format("version {} has no {}", library.version(), file),
                    library_advice(options.device));
  }
  open_nvidia_packages(library);
  if (options.device != "tensorrt") return;
  const Caller call(library.api());
  (void)environment_of(call);  // before all other calls
  try {
    (void)tensorrt_options(call, "");
  } catch (const std::runtime_error& e) {
    throw cannot_start(options, e);
  }
}

/// Operators that TensorRT does not support run on CUDA. CUDA's convolution algorithms are chosen
/// by rules: a choice by measured times, and with it the results, would differ from run to run.
void append_providers(const Caller& call, const EngineOptions& options, const fs::path& cache,
                      ort::SessionOptions* session) {
  const ort::Api& api = call.api();
  try {
    if (options.device == "tensorrt")
      call.check(api.append_tensorrt(session, tensorrt_options(call, cache).get()));
    const auto cuda = call.make(api.release_cuda_options, api.create_cuda_options);
    update(call, api.update_cuda_options, cuda.get(), {{"cudnn_conv_algo_search", "HEURISTIC"}});
    call.check(api.append_cuda(session, cuda.get()));
  } catch (const std::runtime_error& e) {
    throw cannot_start(options, e);
  }
}

/// Memory of the host for the input and the outputs of a session.
struct HostMemory {
  Owned<ort::MemoryInfo> kind;
  Owned<ort::Allocator> allocator;
};

/// @param kind the library's name of the memory
HostMemory host_memory(const Caller& call, const ort::Session* session, ort::Text kind,
                       int allocator_type) {
  const ort::Api& api = call.api();
  auto info = call.make(api.release_memory, api.create_memory, kind, allocator_type, 0,
                        ort::kDefaultMemory);
  auto allocator = call.make(api.release_allocator, api.create_allocator, session,
                             static_cast<const ort::MemoryInfo*>(info.get()));
  return {std::move(info), std::move(allocator)};
}

/// Returns ordinary memory on the CPU. For a GPU returns pinned memory, which the GPU reads and
/// writes without an intermediate copy; ordinary memory, which is slower, if there is none.
HostMemory fastest_memory(const Caller& call, const ort::Session* session,
                          const std::string& device) {
  if (device == "cpu") return host_memory(call, session, "Cpu", ort::kArena);
  try {
    return host_memory(call, session, "CudaPinned", ort::kDevice);
  } catch (const std::runtime_error&) {
    return host_memory(call, session, "Cpu", ort::kArena);
  }
}

class OnnxRuntimeEngine final : public InferenceEngine {
 public:
  /// @param cache the folder of TensorRT's engine; null for other devices
  OnnxRuntimeEngine(const EngineOptions& options, const OnnxRuntimeLibrary& library,
                    std::shared_ptr<TensorRtCache> cache)
      : call_(library.api()),
        options_(options),
        name_(name_of(options, library)),
        cache_(std::move(cache)),
        session_(start()),
        memory_(fastest_memory(call_, session_.get(), options.device)),
        binding_(
            call_.make(call_.api().release_binding, call_.api().create_binding, session_.get())),
        input_(make_input()) {
    void* data = nullptr;
    call_.check(call_.api().tensor_data(input_.get(), &data));
    values_ = {static_cast<float*>(data), count_of(options.input_shape)};
  }

  std::array<int, 4> input_shape() const override { return options_.input_shape; }

  std::span<float> input() override { return values_; }

  std::vector<TensorView> run() override {
    const ort::Api& api = call_.api();
    outputs_.clear();
    converted_.clear();
    // Bound before each run: binding copies the input to the device, and outputs may change size.
    call_.check(api.bind_input(binding_.get(), options_.input.c_str(), input_.get()));
    for (const std::string& output : options_.outputs)
      call_.check(api.bind_output(binding_.get(), output.c_str(), memory_.kind.get()));
    call_.check(api.run_binding(session_.get(), nullptr, binding_.get()));
    take_outputs();
    if (cache_) cache_->commit();
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

  Owned<ort::Session> start() const {
    const ort::Api& api = call_.api();
    const ort::Env* const environment = environment_of(call_);  // before all other calls
    const auto options = call_.make(api.release_session_options, api.create_session_options);
    call_.check(api.set_threads(options.get(), options_.threads));
    // Threads that wait for work leave the cores to the tracker.
    call_.check(api.set_entry(options.get(), "session.intra_op.allow_spinning", "0"));
    call_.check(api.set_deterministic(options.get(), true));
    for (const auto& [dimension, size] : options_.dynamic_dimensions)
      call_.check(api.fix_dimension(options.get(), dimension.c_str(), size));
    if (options_.device != "cpu")
      append_providers(call_, options_, cache_ ? cache_->folder() : fs::path(), options.get());
    try {
      return call_.make(api.release_session, api.create_session, environment,
                        options_.model.c_str(),
                        static_cast<const ort::SessionOptions*>(options.get()));
    } catch (const std::runtime_error& e) {
      if (std::string_view(e.what()).starts_with(kCudaFailure)) throw cannot_start(options_, e);
      throw;
    }
  }

  Owned<ort::Value> make_input() const {
    std::array<std::int64_t, 4> shape{};
    std::ranges::copy(options_.input_shape, shape.begin());
    return call_.make(call_.api().release_value, call_.api().create_tensor, memory_.allocator.get(),
                      static_cast<const std::int64_t*>(shape.data()), shape.size(),
                      ort::kFloatTensor);
  }

  void take_outputs() {
    const ort::Api& api = call_.api();
    ort::Value** values = nullptr;
    std::size_t count = 0;
    call_.check(api.bound_outputs(binding_.get(), memory_.allocator.get(), &values, &count));
    for (std::size_t i = 0; i < count; ++i) outputs_.emplace_back(values[i], api.release_value);
    call_.check(api.free(memory_.allocator.get(), static_cast<void*>(values)));
  }

  TensorView view(ort::Value* value) {
    const ort::Api& api = call_.api();
    const auto shape =
        call_.make(api.release_shape, api.tensor_shape, static_cast<const ort::Value*>(value));
    int type = 0;
    std::size_t dimensions = 0;
    call_.check(api.element_type(shape.get(), &type));
    if (type != ort::kFloatTensor && type != ort::kInt64Tensor)
      throw std::runtime_error("an output is no tensor of 32-bit floats");
    call_.check(api.dimension_count(shape.get(), &dimensions));
    TensorView view;
    view.shape.resize(dimensions);
    call_.check(api.dimensions(shape.get(), view.shape.data(), dimensions));
    void* data = nullptr;
    call_.check(api.tensor_data(value, &data));
    const std::size_t count = count_of(view.shape);
    view.values = type == ort::kFloatTensor
                      ? std::span(static_cast<const float*>(data), count)
                      : as_floats({static_cast<const std::int64_t*>(data), count});
    return view;
  }

  std::span<const float> as_floats(std::span<const std::int64_t> integers) {
    return converted_.emplace_back(integers.begin(), integers.end());
  }

  Caller call_;
  EngineOptions options_;
  EngineName name_;
  std::shared_ptr<TensorRtCache> cache_;
  Owned<ort::Session> session_;
  HostMemory memory_;
  Owned<ort::Binding> binding_;
  Owned<ort::Value> input_;
  std::span<float> values_;                  // of input_
  std::vector<Owned<ort::Value>> outputs_;   // of the last run
  std::list<std::vector<float>> converted_;  // outputs of the last run that are integers
};

/// Returns the GPU and the versions of the libraries, on which an engine of TensorRT depends.
std::string versions_of(const OnnxRuntimeLibrary& library) {
  const auto tensorrt = reinterpret_cast<int (*)()>(dlsym(RTLD_DEFAULT, "getInferLibVersion"));
  return fmt::format("{}, ONNX Runtime {}, TensorRT {}", nvidia_gpu_name(), library.version(),
                     tensorrt == nullptr ? 0 : tensorrt());
}

/// Starts TensorRT; an engine of an earlier run that cannot be read is built again.
std::unique_ptr<InferenceEngine> start_tensorrt(const EngineOptions& options,
                                                const OnnxRuntimeLibrary& library) {
  const auto cache = std::make_shared<TensorRtCache>(options.model, versions_of(library));
  try {
    return std::make_unique<OnnxRuntimeEngine>(options, library, cache);
  } catch (const std::runtime_error& e) {
    if (!cache->complete() ||
        std::string_view(e.what()).find("deserialize") == std::string_view::npos)
      throw;
    warn(fmt::format("TensorRT cannot read the engine of an earlier run ({}); it is built again",
                     e.what()),
         "");
  }
  cache->rebuild();
  return std::make_unique<OnnxRuntimeEngine>(options, library, cache);
}

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
  if (options.device != "cpu") require_nvidia_libraries(options, library);
  if (options.device == "tensorrt") return start_tensorrt(options, library);
  return std::make_unique<OnnxRuntimeEngine>(options, library, nullptr);
}

}  // namespace stillmap
