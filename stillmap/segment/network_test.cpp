// SPDX-License-Identifier: Apache-2.0
// Real networks on real pictures. Both come from ../shared, where that is; else these tests are
// skipped.
#include "stillmap/segment/inference_engine.hpp"
#include "stillmap/segment/make_detector.hpp"

#include <cstdlib>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

std::filesystem::path shared() {
  const char* folder = std::getenv("STILLMAP_SHARED");
  return folder != nullptr ? folder : STILLMAP_SHARED_DEFAULT;
}

RgbdFrame picture(const std::string& name) {
  RgbdFrame frame;
  frame.color = cv::imread((shared() / "models/img" / name).string());
  cv::cvtColor(frame.color, frame.grey, cv::COLOR_BGR2GRAY);
  frame.depth = cv::Mat::zeros(frame.grey.size(), CV_32F);
  return frame;
}

std::vector<std::string> classes_in(const std::vector<Instance>& instances) {
  std::vector<std::string> names;
  for (const auto& i : instances) names.push_back(i.class_name);
  return names;
}

struct Network : testing::TestWithParam<std::tuple<std::string, std::string>> {
  void SetUp() override {
    if (!std::filesystem::exists(model())) GTEST_SKIP() << "no " << model();
    const auto backends = available_backends();
    if (std::find(backends.begin(), backends.end(), std::get<1>(GetParam())) == backends.end()) {
      GTEST_SKIP() << "this build lacks " << std::get<1>(GetParam());
    }
  }
  SegmentOptions options() const {
    SegmentOptions options;
    options.model = model();
    options.backend = std::get<1>(GetParam());
    return options;
  }
  std::filesystem::path model() const { return shared() / "models" / std::get<0>(GetParam()); }
};

TEST_P(Network, FindsFourPersonsAndABus) {
  const auto detector = make_detector(options());
  const auto found = detector->detect(picture("bus.jpg"));
  for (const auto& i : found)
    std::cout << i.class_name << " " << i.confidence << " " << i.box << "\n";
  EXPECT_THAT(classes_in(found), testing::IsSupersetOf({"bus", "person", "person", "person"}));
}

INSTANTIATE_TEST_SUITE_P(All, Network,
                         testing::Combine(testing::Values("yolo11n-seg_480x640.onnx",
                                                          "yolov8n-seg_480x640.onnx",
                                                          "yolo11n_480x640.onnx"),
                                          testing::Values("openvino", "onnxruntime", "opencv")));

}  // namespace
}  // namespace stillmap
