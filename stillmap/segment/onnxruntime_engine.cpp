// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/inference_engine.hpp"

#ifdef STILLMAP_HAS_ONNXRUNTIME
#include <onnxruntime_cxx_api.h>
#endif

namespace stillmap::engines {

#ifdef STILLMAP_HAS_ONNXRUNTIME
namespace {

class OnnxRuntimeEngine final : public InferenceEngine {
 public:
  explicit OnnxRuntimeEngine(const EngineOptions& options)
      : shape_(options.input_shape),
        env_(ORT_LOGGING_LEVEL_ERROR, "stillmap"),
        session_(env_, options.model.c_str(), settings(options.threads)) {
    Ort::AllocatorWithDefaultOptions allocator;
    input_name_ = session_.GetInputNameAllocated(0, allocator).get();
    for (std::size_t i = 0; i < session_.GetOutputCount(); ++i) {
      output_names_.emplace_back(session_.GetOutputNameAllocated(i, allocator).get());
    }
  }

  std::array<int, 4> input_shape() const override { return shape_; }

  std::vector<TensorView> run(std::span<const float> input) override {
    buffer_.assign(input.begin(), input.end());
    const std::array<std::int64_t, 4> shape{shape_[0], shape_[1], shape_[2], shape_[3]};
    const auto memory = Ort::MemoryInfo::CreateCpu(OrtArenaAllocator, OrtMemTypeDefault);
    const auto tensor = Ort::Value::CreateTensor<float>(memory, buffer_.data(), buffer_.size(),
                                                        shape.data(), shape.size());
    const char* input_name = input_name_.c_str();
    std::vector<const char*> output_names;
    for (const auto& name : output_names_) output_names.push_back(name.c_str());
    outputs_ = session_.Run(Ort::RunOptions{nullptr}, &input_name, &tensor, 1, output_names.data(),
                            output_names.size());
    std::vector<TensorView> views;
    for (const auto& output : outputs_) views.push_back(view(output));
    return views;
  }

  std::string name() const override { return "ONNX Runtime " + Ort::GetVersionString(); }

 private:
  static Ort::SessionOptions settings(int threads) {
    Ort::SessionOptions settings;
    settings.SetIntraOpNumThreads(threads);
    settings.SetInterOpNumThreads(1);
    settings.SetExecutionMode(ExecutionMode::ORT_SEQUENTIAL);
    settings.SetGraphOptimizationLevel(GraphOptimizationLevel::ORT_ENABLE_ALL);
    settings.AddConfigEntry("session.intra_op.allow_spinning",
                            "0");  // the tracker shares the cores
    return settings;
  }
  static TensorView view(const Ort::Value& tensor) {
    const auto info = tensor.GetTensorTypeAndShapeInfo();
    return {info.GetShape(), {tensor.GetTensorData<float>(), info.GetElementCount()}};
  }

  std::array<int, 4> shape_;
  Ort::Env env_;
  Ort::Session session_;
  std::string input_name_;
  std::vector<std::string> output_names_;
  std::vector<float> buffer_;
  std::vector<Ort::Value> outputs_;
};

}  // namespace

std::unique_ptr<InferenceEngine> make_onnxruntime(const EngineOptions& options) {
  return std::make_unique<OnnxRuntimeEngine>(options);
}
bool has_onnxruntime() { return true; }
#else
std::unique_ptr<InferenceEngine> make_onnxruntime(const EngineOptions&) { return nullptr; }
bool has_onnxruntime() { return false; }
#endif

}  // namespace stillmap::engines
