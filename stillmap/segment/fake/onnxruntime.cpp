// SPDX-License-Identifier: Apache-2.0
// A substitute for ONNX Runtime with CUDA and TensorRT for tests on computers without a GPU. It
// records the settings that it gets. Each network computes out = max(in, 0). TensorRT's "engine" is
// a file fake.engine in the folder of the cache.
#include "stillmap/base/file.hpp"
#include "stillmap/segment/fake/fake_onnxruntime.hpp"
#include "stillmap/segment/onnxruntime_api.hpp"

#include <algorithm>
#include <filesystem>

namespace stillmap::ort {

struct Status {
  std::string message;
};
struct Env {};
struct SessionOptions {
  std::string cache;  ///< Folder of TensorRT's engine; empty without.
};
struct Session {};
struct MemoryInfo {};
struct Allocator {};
struct Value {
  std::vector<std::int64_t> shape;
  std::vector<float> values;
};
struct Binding {
  const Value* input = nullptr;
};
struct TensorShape {
  std::vector<std::int64_t> sizes;
};
struct CudaOptions {};
struct TensorRtOptions {
  std::string cache;
};

namespace {

namespace fs = std::filesystem;

test::FakeOnnxRuntime& state() {
  static test::FakeOnnxRuntime kept;
  return kept;
}

/// Whether the environment was created, which must be the first call.
bool& environment_exists() {
  static bool exists = false;
  return exists;
}

/// Records a call. Returns its failure if the test demands one, otherwise null.
Status* record(const std::string& call) {
  state().calls.push_back(call);
  const auto failure = state().failures.find(call);
  return failure == state().failures.end() ? nullptr : new Status{failure->second};
}

template <typename T>
void release(T* made) {
  delete made;
}

template <typename T>
Status* create(T** made) {
  *made = new T{};
  return nullptr;
}

/// Records a call that creates an object, and creates it unless the call fails.
template <typename T>
Status* create_recorded(const std::string& call, T** made) {
  Status* failure = record(call);
  if (failure == nullptr) *made = new T{};
  return failure;
}

Status* create_memory(Text name, int, int, int, MemoryInfo** made) {
  return create_recorded(std::string("memory ") + name, made);
}

Status* create_session(const Env*, Text, const SessionOptions* options, Session** made) {
  if (!options->cache.empty()) {
    const fs::path engine = fs::path(options->cache) / "fake.engine";
    if (!fs::exists(engine)) {
      record("build engine");
      write_file(engine, "engine");
    } else if (read_file(engine) != "engine") {
      return new Status{"TensorRT EP could not deserialize engine from cache: " + engine.string()};
    }
  }
  return create_recorded("create session", made);
}

Status* update_cuda(CudaOptions*, const Text* keys, const Text* values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) record(std::string("cuda ") + keys[i] + "=" + values[i]);
  return nullptr;
}

Status* update_tensorrt(TensorRtOptions* options, const Text* keys, const Text* values,
                        std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    record(std::string("tensorrt ") + keys[i] + "=" + values[i]);
    if (std::string(keys[i]) == "trt_engine_cache_path") options->cache = values[i];
  }
  return nullptr;
}

Status* append_tensorrt(SessionOptions* session, const TensorRtOptions* options) {
  session->cache = options->cache;
  return record("append tensorrt");
}

Status* create_tensor(Allocator*, const std::int64_t* shape, std::size_t dimensions, int,
                      Value** made) {
  *made = new Value{{shape, shape + dimensions}, {}};
  std::size_t count = 1;
  for (const std::int64_t size : (*made)->shape) count *= static_cast<std::size_t>(size);
  (*made)->values.resize(count);
  return nullptr;
}

Status* bind_input(Binding* binding, Text, const Value* value) {
  binding->input = value;
  return nullptr;
}

Status* bound_outputs(const Binding* binding, Allocator*, Value*** values, std::size_t* count) {
  auto* output = new Value(*binding->input);
  for (float& value : output->values) value = std::max(value, 0.0F);
  *count = 1;
  *values = new Value* [1] { output };
  return nullptr;
}

Status* free_values(Allocator*, void* data) {
  delete[] static_cast<Value**>(data);
  return nullptr;
}

Status* tensor_shape(const Value* value, TensorShape** made) {
  *made = new TensorShape{value->shape};
  return nullptr;
}

Status* dimensions(const TensorShape* shape, std::int64_t* sizes, std::size_t) {
  std::copy(shape->sizes.begin(), shape->sizes.end(), sizes);
  return nullptr;
}

Api make_api() {
  Api api{};
  api.message = [](const Status* status) -> Text { return status->message.c_str(); };
  api.create_env = [](int, Text, Env** made) {
    environment_exists() = true;
    return create(made);
  };
  api.create_session = create_session;
  api.create_session_options = create<SessionOptions>;
  api.set_threads = [](SessionOptions*, int) -> Status* { return nullptr; };
  api.create_tensor = create_tensor;
  api.tensor_data = [](Value* value, void** data) -> Status* {
    *data = value->values.data();
    return nullptr;
  };
  api.element_type = [](const TensorShape*, int* type) -> Status* {
    *type = kFloatTensor;
    return nullptr;
  };
  api.dimension_count = [](const TensorShape* shape, std::size_t* count) -> Status* {
    *count = shape->sizes.size();
    return nullptr;
  };
  api.dimensions = dimensions;
  api.tensor_shape = tensor_shape;
  api.create_memory = create_memory;
  api.free = free_values;
  api.release_status = release<Status>;
  api.release_memory = release<MemoryInfo>;
  api.release_session = release<Session>;
  api.release_value = release<Value>;
  api.release_shape = release<TensorShape>;
  api.release_session_options = release<SessionOptions>;
  api.fix_dimension = [](SessionOptions*, Text, std::int64_t) -> Status* { return nullptr; };
  api.set_entry = [](SessionOptions*, Text, Text) -> Status* { return nullptr; };
  api.create_allocator = [](const Session*, const MemoryInfo*, Allocator** made) {
    return create(made);
  };
  api.release_allocator = release<Allocator>;
  api.run_binding = [](Session*, const RunOptions*, const Binding*) { return record("run"); };
  api.create_binding = [](Session*, Binding** made) { return create(made); };
  api.release_binding = release<Binding>;
  api.bind_input = bind_input;
  api.bind_output = [](Binding*, Text, const MemoryInfo*) -> Status* { return nullptr; };
  api.bound_outputs = bound_outputs;
  api.append_tensorrt = append_tensorrt;
  api.create_tensorrt_options = [](TensorRtOptions** made) {
    if (!environment_exists()) return new Status{"no environment"};
    return create_recorded("create tensorrt", made);
  };
  api.update_tensorrt_options = update_tensorrt;
  api.release_tensorrt_options = release<TensorRtOptions>;
  api.append_cuda = [](SessionOptions*, const CudaOptions*) { return record("append cuda"); };
  api.create_cuda_options = create<CudaOptions>;
  api.update_cuda_options = update_cuda;
  api.release_cuda_options = release<CudaOptions>;
  api.set_deterministic = [](SessionOptions*, bool) -> Status* { return nullptr; };
  return api;
}

}  // namespace
}  // namespace stillmap::ort

extern "C" {

__attribute__((visibility("default"))) stillmap::test::FakeOnnxRuntime* fake_onnxruntime_state() {
  return &stillmap::ort::state();
}

// NOLINTNEXTLINE(readability-identifier-naming): the name is that of ONNX Runtime.
__attribute__((visibility("default"))) const stillmap::ort::ApiBase* OrtGetApiBase() {
  static const stillmap::ort::Api api = stillmap::ort::make_api();
  static const stillmap::ort::ApiBase base = {[](std::uint32_t) { return &api; },
                                              []() -> stillmap::ort::Text { return "9.9.9"; }};
  return &base;
}
}
