// SPDX-License-Identifier: Apache-2.0
// The plug-in libstillmap_openvino.so: the only file that OpenVINO is linked to. It uses headers of
// segment, but nothing of its library.
#include "stillmap/segment/openvino_plugin.hpp"

#include <stdexcept>

#include <openvino/openvino.hpp>

namespace stillmap {
namespace {

class OpenVinoEngine final : public InferenceEngine {
 public:
  explicit OpenVinoEngine(const EngineOptions& options) : shape_(options.input_shape) {
    const std::string device = device_of(options.device);
    auto model = core_.read_model(options.model);
    if (model->is_dynamic()) model->reshape(ov::Shape(shape_.begin(), shape_.end()));
    model = with_float_outputs(model);
    compiled_ = core_.compile_model(model, device, settings(device, options.threads));
    const std::string version = ov::get_openvino_version().buildNumber;
    name_ = {
        "OpenVINO", version.substr(0, version.find('-')),
        "on " + (device == "CPU" ? "the CPU" : core_.get_property(device, ov::device::full_name))};
    request_ = compiled_.create_infer_request();
  }

  std::array<int, 4> input_shape() const override { return shape_; }

  std::span<float> input() override {
    ov::Tensor tensor = request_.get_input_tensor();
    return {tensor.data<float>(), tensor.get_size()};
  }

  std::vector<TensorView> run() override {
    request_.infer();
    std::vector<TensorView> views;
    for (const auto& output : compiled_.outputs())
      views.push_back(view(request_.get_tensor(output)));
    return views;
  }

  EngineName name() const override { return name_; }

 private:
  /// Returns OpenVINO's name of a device; throws std::runtime_error if its plug-in does not find
  /// it.
  std::string device_of(const std::string& device) const {
    if (device == "cpu") return "CPU";
    const std::string name = device == "npu" ? "NPU" : "GPU";
    for (const std::string& found : core_.get_available_devices()) {
      if (found.starts_with(name)) return found;
    }
    throw std::runtime_error("OpenVINO finds no " + name + " that its plug-in supports");
  }
  /// On the CPU one stream, unpinned because the tracker shares the cores, in 32-bit floats:
  /// results then depend neither on the short formats of the processor nor on the number of
  /// threads. Other devices choose their fastest format, which is 16-bit floats.
  static ov::AnyMap settings(const std::string& device, int threads) {
    if (device != "CPU") return {ov::hint::performance_mode(ov::hint::PerformanceMode::LATENCY)};
    return {ov::hint::performance_mode(ov::hint::PerformanceMode::LATENCY),
            ov::inference_num_threads(threads), ov::num_streams(1),
            ov::hint::inference_precision(ov::element::f32), ov::hint::enable_cpu_pinning(false)};
  }
  static std::shared_ptr<ov::Model> with_float_outputs(const std::shared_ptr<ov::Model>& model) {
    ov::preprocess::PrePostProcessor processor(model);
    bool has_integers = false;
    for (std::size_t i = 0; i < model->outputs().size(); ++i) {
      if (model->output(i).get_element_type() != ov::element::i64) continue;
      processor.output(i).tensor().set_element_type(ov::element::f32);
      has_integers = true;
    }
    return has_integers ? processor.build() : model;
  }
  static TensorView view(const ov::Tensor& tensor) {
    const auto& shape = tensor.get_shape();
    return {{shape.begin(), shape.end()}, {tensor.data<const float>(), tensor.get_size()}};
  }

  std::array<int, 4> shape_;
  EngineName name_;
  ov::Core core_;
  ov::CompiledModel compiled_;
  ov::InferRequest request_;
};

}  // namespace
}  // namespace stillmap

extern "C" {

const char* stillmap_openvino_version() { return STILLMAP_VERSION; }

stillmap::InferenceEngine* stillmap_openvino_engine(const stillmap::EngineOptions* options) {
  return new stillmap::OpenVinoEngine(*options);
}
}
