// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

/// The part of ONNX Runtime's C API that Stillmap calls. It is declared here so that Stillmap is
/// built without ONNX Runtime's headers and library. The library returns a table of functions,
/// OrtApi; newer versions only append to it (onnxruntime_c_api.h of
/// github.com/microsoft/onnxruntime).
namespace stillmap::ort {

/// First version of the table that has all functions below: that of ONNX Runtime 1.17.
constexpr std::uint32_t kApiVersion = 17;

constexpr int kLogFatal = 4;       ///< ORT_LOGGING_LEVEL_FATAL
constexpr int kFloatTensor = 1;    ///< ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT
constexpr int kInt64Tensor = 7;    ///< ONNX_TENSOR_ELEMENT_DATA_TYPE_INT64
constexpr int kArena = 1;          ///< OrtArenaAllocator
constexpr int kDevice = 0;         ///< OrtDeviceAllocator
constexpr int kDefaultMemory = 0;  ///< OrtMemTypeDefault

// Opaque types of the library.
struct Status;
struct Env;
struct SessionOptions;
struct Session;
struct RunOptions;
struct MemoryInfo;
struct Allocator;
struct Binding;
struct Value;
struct TensorShape;
struct CudaOptions;
struct TensorRtOptions;

using Text = const char*;
template <std::size_t N>
using Unused = std::array<void (*)(), N>;
/// Changes the options of an execution provider.
template <typename Options>
using Update = Status* (*)(Options*, const Text* keys, const Text* values, std::size_t count);

/// OrtApi. A function returns null or a Status that describes its failure.
struct Api {
  Unused<2> unused_0;
  Text (*message)(const Status*);
  Status* (*create_env)(int log_level, Text log_name, Env** made);
  Unused<3> unused_4;
  Status* (*create_session)(const Env*, Text file, const SessionOptions*, Session** made);
  Unused<2> unused_8;
  Status* (*create_session_options)(SessionOptions** made);
  Unused<13> unused_11;
  Status* (*set_threads)(SessionOptions*, int threads);
  Unused<23> unused_25;
  Status* (*create_tensor)(Allocator*, const std::int64_t* shape, std::size_t dimensions, int type,
                           Value** made);
  Unused<2> unused_49;
  Status* (*tensor_data)(Value*, void** data);
  Unused<8> unused_52;
  Status* (*element_type)(const TensorShape*, int* type);
  Status* (*dimension_count)(const TensorShape*, std::size_t* count);
  Status* (*dimensions)(const TensorShape*, std::int64_t* sizes, std::size_t count);
  Unused<2> unused_63;
  Status* (*tensor_shape)(const Value*, TensorShape** made);
  Unused<2> unused_66;
  Status* (*create_memory)(Text name, int allocator, int device, int memory, MemoryInfo** made);
  Unused<7> unused_69;
  Status* (*free)(Allocator*, void* data);
  Unused<16> unused_77;
  void (*release_status)(Status*);
  void (*release_memory)(MemoryInfo*);
  void (*release_session)(Session*);
  void (*release_value)(Value*);
  Unused<2> unused_97;
  void (*release_shape)(TensorShape*);
  void (*release_session_options)(SessionOptions*);
  Unused<23> unused_101;
  Status* (*fix_dimension)(SessionOptions*, Text name, std::int64_t size);
  Unused<5> unused_125;
  Status* (*set_entry)(SessionOptions*, Text key, Text value);
  Status* (*create_allocator)(const Session*, const MemoryInfo*, Allocator** made);
  void (*release_allocator)(Allocator*);
  Status* (*run_binding)(Session*, const RunOptions*, const Binding*);
  Status* (*create_binding)(Session*, Binding** made);
  void (*release_binding)(Binding*);
  Status* (*bind_input)(Binding*, Text name, const Value*);
  Unused<1> unused_137;
  Status* (*bind_output)(Binding*, Text name, const MemoryInfo*);
  Unused<1> unused_139;
  Status* (*bound_outputs)(const Binding*, Allocator* of_array, Value*** values,
                           std::size_t* count);
  Unused<29> unused_141;
  Status* (*append_tensorrt)(SessionOptions*, const TensorRtOptions*);
  Status* (*create_tensorrt_options)(TensorRtOptions** made);
  Update<TensorRtOptions> update_tensorrt_options;
  Unused<1> unused_173;
  void (*release_tensorrt_options)(TensorRtOptions*);
  Unused<29> unused_175;
  Status* (*append_cuda)(SessionOptions*, const CudaOptions*);
  Status* (*create_cuda_options)(CudaOptions** made);
  Update<CudaOptions> update_cuda_options;
  Unused<1> unused_207;
  void (*release_cuda_options)(CudaOptions*);
  Unused<64> unused_209;
  Status* (*set_deterministic)(SessionOptions*, bool deterministic);
};

/// Result of OrtGetApiBase(), the only function that the library exports by name.
struct ApiBase {
  const Api* (*api)(std::uint32_t version);  ///< Null if the library is older.
  Text (*version)();
};

// The positions of the functions, by their order in onnxruntime_c_api.h.
#define STILLMAP_ORT_POSITION(member, position) \
  static_assert(offsetof(Api, member) == (position) * sizeof(void (*)()))
STILLMAP_ORT_POSITION(message, 2);                    // GetErrorMessage
STILLMAP_ORT_POSITION(create_env, 3);                 // CreateEnv
STILLMAP_ORT_POSITION(create_session, 7);             // CreateSession
STILLMAP_ORT_POSITION(create_session_options, 10);    // CreateSessionOptions
STILLMAP_ORT_POSITION(set_threads, 24);               // SetIntraOpNumThreads
STILLMAP_ORT_POSITION(create_tensor, 48);             // CreateTensorAsOrtValue
STILLMAP_ORT_POSITION(tensor_data, 51);               // GetTensorMutableData
STILLMAP_ORT_POSITION(element_type, 60);              // GetTensorElementType
STILLMAP_ORT_POSITION(dimension_count, 61);           // GetDimensionsCount
STILLMAP_ORT_POSITION(dimensions, 62);                // GetDimensions
STILLMAP_ORT_POSITION(tensor_shape, 65);              // GetTensorTypeAndShape
STILLMAP_ORT_POSITION(create_memory, 68);             // CreateMemoryInfo
STILLMAP_ORT_POSITION(free, 76);                      // AllocatorFree
STILLMAP_ORT_POSITION(release_status, 93);            // ReleaseStatus
STILLMAP_ORT_POSITION(release_memory, 94);            // ReleaseMemoryInfo
STILLMAP_ORT_POSITION(release_session, 95);           // ReleaseSession
STILLMAP_ORT_POSITION(release_value, 96);             // ReleaseValue
STILLMAP_ORT_POSITION(release_shape, 99);             // ReleaseTensorTypeAndShapeInfo
STILLMAP_ORT_POSITION(release_session_options, 100);  // ReleaseSessionOptions
STILLMAP_ORT_POSITION(fix_dimension, 124);            // AddFreeDimensionOverrideByName
STILLMAP_ORT_POSITION(set_entry, 130);                // AddSessionConfigEntry
STILLMAP_ORT_POSITION(create_allocator, 131);         // CreateAllocator
STILLMAP_ORT_POSITION(release_allocator, 132);        // ReleaseAllocator
STILLMAP_ORT_POSITION(run_binding, 133);              // RunWithBinding
STILLMAP_ORT_POSITION(create_binding, 134);           // CreateIoBinding
STILLMAP_ORT_POSITION(release_binding, 135);          // ReleaseIoBinding
STILLMAP_ORT_POSITION(bind_input, 136);               // BindInput
STILLMAP_ORT_POSITION(bind_output, 138);              // BindOutputToDevice
STILLMAP_ORT_POSITION(bound_outputs, 140);            // GetBoundOutputValues
STILLMAP_ORT_POSITION(append_tensorrt, 170);  // SessionOptionsAppendExecutionProvider_TensorRT_V2
STILLMAP_ORT_POSITION(create_tensorrt_options, 171);   // CreateTensorRTProviderOptions
STILLMAP_ORT_POSITION(update_tensorrt_options, 172);   // UpdateTensorRTProviderOptions
STILLMAP_ORT_POSITION(release_tensorrt_options, 174);  // ReleaseTensorRTProviderOptions
STILLMAP_ORT_POSITION(append_cuda, 204);           // SessionOptionsAppendExecutionProvider_CUDA_V2
STILLMAP_ORT_POSITION(create_cuda_options, 205);   // CreateCUDAProviderOptions
STILLMAP_ORT_POSITION(update_cuda_options, 206);   // UpdateCUDAProviderOptions
STILLMAP_ORT_POSITION(release_cuda_options, 208);  // ReleaseCUDAProviderOptions
STILLMAP_ORT_POSITION(set_deterministic, 273);     // SetDeterministicCompute
#undef STILLMAP_ORT_POSITION

}  // namespace stillmap::ort
