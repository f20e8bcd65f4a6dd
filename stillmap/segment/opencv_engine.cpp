// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/opencv_engine.hpp"

#include "stillmap/base/error.hpp"

#include <opencv2/core/utils/logger.hpp>
#include <opencv2/dnn.hpp>

namespace stillmap {
namespace {

class OpenCvEngine final : public InferenceEngine {
 public:
  explicit OpenCvEngine(const EngineOptions& options)
      : shape_(options.input_shape),
        outputs_(options.outputs),
        net_(cv::dnn::readNetFromONNX(options.model)),
        input_(4, shape_.data(), CV_32F, cv::Scalar(0)) {
    if (net_.empty())
      throw Error("OpenCV found no network in this file", options.model, export_advice());
    net_.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
    net_.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
    // OpenCV 4.6 drops a scalar factor behind a matrix product when it fuses YOLO11's attention,
    // and computes wrong results without an error.
    net_.enableFusion(false);
  }

  std::array<int, 4> input_shape() const override { return shape_; }

  std::span<float> input() override { return {input_.ptr<float>(), input_.total()}; }

  std::vector<TensorView> run() override {
    net_.setInput(input_);
    net_.forward(results_, outputs_);
    std::vector<TensorView> views;
    for (const auto& result : results_) views.push_back(view(result));
    return views;
  }

  EngineName name() const override { return {"OpenCV", CV_VERSION, "on the CPU"}; }

 private:
  static TensorView view(const cv::Mat& tensor) {
    if (!tensor.isContinuous() || tensor.type() != CV_32F)
      throw Error("OpenCV returned an output that is not a dense float tensor", "",
                  export_advice());
    return {{tensor.size.p, tensor.size.p + tensor.dims}, {tensor.ptr<float>(), tensor.total()}};
  }

  std::array<int, 4> shape_;
  std::vector<std::string> outputs_;
  cv::dnn::Net net_;
  cv::Mat input_;
  std::vector<cv::Mat> results_;
};

}  // namespace

std::unique_ptr<InferenceEngine> make_opencv_engine(const EngineOptions& options) {
  return std::make_unique<OpenCvEngine>(options);
}

}  // namespace stillmap
