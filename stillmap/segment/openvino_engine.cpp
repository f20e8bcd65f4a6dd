// SPDX-License-Identifier: Apache-2.0
// OpenVINO's headers stay in this file: it is compiled without the house's precompiled header,
// since OpenVINO's targets bring compile definitions of their own.
#include "stillmap/segment/inference_engine.hpp"

#ifdef STILLMAP_HAS_OPENVINO
#include <openvino/openvino.hpp>
#endif

namespace stillmap::engines {

#ifdef STILLMAP_HAS_OPENVINO
namespace {

class OpenVinoEngine final : public InferenceEngine {
 public:
  explicit OpenVinoEngine(const EngineOptions& options) : shape_(options.input_shape) {
    auto model = core_.read_model(options.model);
    if (model->is_dynamic()) model->reshape(ov::Shape(shape_.begin(), shape_.end()));
    compiled_ = core_.compile_model(model, "CPU", settings(options.threads));
    request_ = compiled_.create_infer_request();
  }

  std::array<int, 4> input_shape() const override { return shape_; }

  std::vector<TensorView> run(std::span<const float> input) override {
    ov::Tensor tensor = request_.get_input_tensor();
    std::copy(input.begin(), input.end(), tensor.data<float>());
    request_.infer();
    std::vector<TensorView> views;
    for (const auto& output : compiled_.outputs())
      views.push_back(view(request_.get_tensor(output)));
    return views;
  }

  std::string name() const override {
    return std::string("OpenVINO ") + ov::get_openvino_version().buildNumber;
  }

 private:
  /// One stream, unpinned (the tracker shares the cores), full 32-bit floats: so results do not
  /// depend on the processor's short formats, nor on the number of threads.
  static ov::AnyMap settings(int threads) {
    return {ov::hint::performance_mode(ov::hint::PerformanceMode::LATENCY),
            ov::inference_num_threads(threads), ov::num_streams(1),
            ov::hint::inference_precision(ov::element::f32), ov::hint::enable_cpu_pinning(false)};
  }
  static TensorView view(const ov::Tensor& tensor) {
    const auto& shape = tensor.get_shape();
    return {{shape.begin(), shape.end()}, {tensor.data<const float>(), tensor.get_size()}};
  }

  std::array<int, 4> shape_;
  ov::Core core_;
  ov::CompiledModel compiled_;
  ov::InferRequest request_;
};

}  // namespace

std::unique_ptr<InferenceEngine> make_openvino(const EngineOptions& options) {
  return std::make_unique<OpenVinoEngine>(options);
}
bool has_openvino() { return true; }
#else
std::unique_ptr<InferenceEngine> make_openvino(const EngineOptions&) { return nullptr; }
bool has_openvino() { return false; }
#endif

}  // namespace stillmap::engines
