// Tests of detectors with network files: invalid ones generated here, and real ones on photographs,
// which are read from $STILLMAP_SHARED and skipped if missing.
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/segment/coco.hpp"
#include "stillmap/segment/dynamic_mask.hpp"
#include "stillmap/segment/inference_engine.hpp"
#include "stillmap/segment/make_detector.hpp"
#include "stillmap/segment/test_onnx.hpp"
#include "stillmap/segment/yolo_detector.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

fs::path shared() {
  const char* folder = std::getenv("STILLMAP_SHARED");
  return folder != nullptr ? folder : STILLMAP_SHARED_DEFAULT;
}

RgbdFrame image_frame(const std::string& name) {
  RgbdFrame frame;
  frame.color = read_stored_image(shared() / "models/img" / name).image;
  cv::cvtColor(frame.color, frame.gray, cv::COLOR_BGR2GRAY);
  return frame;
}

SegmentOptions options_for(const fs::path& model, const std::string& backend = "auto") {
  SegmentOptions options;
  options.model = model.string();
  options.backend = backend;
  return options;
}

TEST(ClassNames, OfCocoMayBeWrittenOtherwise) {
  for (const char* name : {"Person", "people", "Pedestrian"})
    EXPECT_EQ(coco_class_name(name), "person") << name;
  EXPECT_EQ(coco_class_name("Potted Plant"), "potted plant");
  EXPECT_EQ(coco_class_name("Hook"), "Hook");
}

// A network of YOLOX's layout for 64 x 32 pixels, 42 cells. One cell has a box whose objectness is
// the mean of the blue channel divided by 255: it is 1 if the input is BGR from 0 to 255.
TEST(YoloXNetwork, GetsItsImageInItsOwnFormat) {
  const fs::path file = test::own_path("yolox.onnx");
  constexpr std::size_t kRow = 7, kAnchor = 32 + 6;  // column 2, row 1 of stride 16
  std::vector<float> weights(42 * kRow * 3, 0.0F);
  weights[(kAnchor * kRow + 4) * 3] = 1.0F / 255;
  weights[(kAnchor * kRow + 5) * 3] = 1.0F / 255;
  const std::string names = "{0: 'person', 1: 'cat'}";
  write_file(file, test::mean_model({1, 3, 32, 64}, {{"out", {1, 42, kRow}, weights}},
                                    {{"names", names}}));
  RgbdFrame frame;
  frame.color = cv::Mat(64, 128, CV_8UC3, cv::Scalar(255, 0, 0));
  const auto found = make_detector(options_for(file))->detect(frame);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].class_name, "person");
  EXPECT_FLOAT_EQ(found[0].confidence, 1);
  EXPECT_EQ(found[0].box, cv::Rect(48, 16, 32, 32));  // (32, 16) +- 8 pixels, at half size
  fs::remove(file);
}

// Invalid files.

struct WrongNetwork : testing::TestWithParam<std::string> {
  fs::path file = test::own_path("wrong.onnx");
  void SetUp() override {
    const auto backends = available_backends();
    if (std::find(backends.begin(), backends.end(), GetParam()) == backends.end()) {
      GTEST_SKIP() << "this build lacks " << GetParam();
    }
  }
  void TearDown() override { fs::remove(file); }
  /// Returns the error message for a file with these bytes.
  std::string error_of(const std::string& content) const {
    write_file(file, content);
    try {
      make_detector(options_for(file, GetParam()));
    } catch (const Error& e) {
      EXPECT_EQ(e.where(), file.string());
      EXPECT_THAT(e.fix(), testing::HasSubstr("yolo export"));
      return e.problem();
    }
    return "no error";
  }
};

TEST_P(WrongNetwork, NotANetwork) {
  EXPECT_THAT(error_of("hello"), testing::HasSubstr("not an ONNX network"));
  EXPECT_THAT(error_of(""), testing::HasSubstr("not an ONNX network"));
  EXPECT_THAT(error_of("PK\x03\x04"), testing::HasSubstr("PyTorch's weights (.pt)"));
}

TEST_P(WrongNetwork, WrongInput) {
  EXPECT_THAT(error_of(test::tiny_model("Relu", {1, 10}, {1, 10})), testing::HasSubstr("input"));
  EXPECT_THAT(error_of(test::tiny_model("Relu", {1, 1, 8, 8}, {1, 1, 8, 8})),
              testing::HasSubstr("input is [1, 1, 8, 8]"));
}

TEST_P(WrongNetwork, WrongOutputs) {
  EXPECT_THAT(error_of(test::tiny_model("Relu", {1, 3, 8, 8}, {1, 3, 8, 8})),
              testing::HasSubstr("the outputs fit no YOLOv7, YOLOv8"));
}

TEST_P(WrongNetwork, WrongElements) {
  constexpr int kHalf = 10, kByte = 2, kInt64 = 7;  // TensorProto.DataType
  const auto model = [](int in, int out) {
    return test::tiny_model("Relu", {1, 3, 8, 8}, {1, 3, 8, 8}, {}, in, out);
  };
  EXPECT_THAT(error_of(model(kHalf, kHalf)), testing::HasSubstr("\"in\" holds 16-bit floats"));
  EXPECT_THAT(error_of(model(kByte, 1)), testing::HasSubstr("\"in\" holds integers"));
  EXPECT_THAT(error_of(model(1, kHalf)), testing::HasSubstr("output \"out\" holds 16-bit floats"));
  EXPECT_THAT(error_of(model(1, kInt64)), testing::HasSubstr("output \"out\" holds integers"));
}

TEST_P(WrongNetwork, OutputsThatAreNoNumbers) {
  // log(0) is negative infinity; the image of the test is black.
  EXPECT_THAT(error_of(test::tiny_model("Log", {1, 3, 8, 8}, {1, 3, 8, 8})),
              testing::HasSubstr("infinite values or none"));
}

TEST(MessageOfALibrary, TheLineWithTheCauseIsTaken) {
  EXPECT_EQ(cause_in("Exception from src/core.cpp:84:\nCheck 'false' failed at a.cpp:1:\n"
                     "Loading input model\nInput tensor isn't found\n\n"),
            "Input tensor isn't found");
  EXPECT_EQ(cause_in("Exception from src/core.cpp:84:\nModel wasn't converted:\n-- Conv-12\n\n"
                     "Summary:\n-- No rule for operations: Frob-12\n-- Failed for: Conv-12\n\n"),
            "No rule for operations: Frob-12");
  EXPECT_EQ(cause_in("OpenCV(4.6.0) a.cpp:1040: error: (-2:Unspecified error) in function 'f'\n"
                     "> Node [Frob]: OpenCV(4.6.0) b.cpp:7: error: (-2) Can't create layer\n>"),
            "(-2) Can't create layer");
  EXPECT_EQ(cause_in("Invalid model.\nMore"), "Invalid model.");
}

TEST_P(WrongNetwork, WrongTask) {
  EXPECT_THAT(error_of(test::tiny_model("Relu", {1, 3, 8, 8}, {1, 3, 8, 8}, {{"task", "pose"}})),
              testing::HasSubstr("pose"));
}

TEST_P(WrongNetwork, UnknownOperator) {
  EXPECT_THAT(error_of(test::tiny_model("Frobnicate", {1, 3, 8, 8}, {1, 3, 8, 8})),
              testing::HasSubstr("cannot load"));
}

INSTANTIATE_TEST_SUITE_P(All, WrongNetwork, testing::Values("openvino", "onnxruntime", "opencv"),
                         [](const auto& test) { return test.param; });

TEST(MakeDetector, NeitherIsValidAndBothIsAnError) {
  EXPECT_EQ(make_detector(SegmentOptions()), nullptr);
  SegmentOptions both = options_for("a.onnx");
  both.masks = "masks";
  EXPECT_THROW(make_detector(both), Error);
}

TEST(MakeDetector, ADeviceWithoutANetworkGivesAWarning) {
  SegmentOptions options;
  options.device = "cuda";
  testing::internal::CaptureStderr();
  EXPECT_EQ(make_detector(options), nullptr);
  EXPECT_THAT(testing::internal::GetCapturedStderr(),
              testing::AllOf(testing::HasSubstr("network.device is 'cuda', but no network"),
                             testing::HasSubstr("--model FILE.onnx")));
  testing::internal::CaptureStderr();
  make_detector(SegmentOptions());
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(MakeDetector, IfNoBackEndLoadsANetworkTheErrorIsThatOfTheFastest) {
  const fs::path file = test::own_path("unknown.onnx");
  write_file(file, test::tiny_model("Frobnicate", {1, 3, 8, 8}, {1, 3, 8, 8}));
  try {
    make_detector(options_for(file));
    ADD_FAILURE() << "no error";
  } catch (const Error& e) {
    EXPECT_THAT(e.problem(), testing::StartsWith("the " + available_backends().front()));
  }
  fs::remove(file);
}

TEST(SlowerEngine, NamesWhatThisBuildCanUse) {
  const auto python = slower_engine("OpenCV 4.6.0 on the CPU", false);
  ASSERT_TRUE(python);
  EXPECT_NE(python->problem().find("runs on OpenCV 4.6.0 on the CPU, since ONNX Runtime"),
            std::string::npos);
  EXPECT_EQ(python->fix(),
            "pip install onnxruntime, in the active environment or the one with this program");
  EXPECT_FALSE(slower_engine("ONNX Runtime 1.20.0 on the CPU", false)) << "the fastest it has";
  const auto command = slower_engine("ONNX Runtime 1.20.0 on the CPU", true);
  ASSERT_TRUE(command);
  EXPECT_NE(command->problem().find("since OpenVINO"), std::string::npos);
}

TEST(MakeDetector, UnknownBackEndsAndDevicesAreErrors) {
  const fs::path file = test::own_path("fine.onnx");
  write_file(file, test::tiny_model("Relu", {1, 3, 8, 8}, {1, 3, 8, 8}));
  const auto where = [&](auto&& change) -> std::string {
    SegmentOptions options = options_for(file);
    change(options);
    try {
      make_detector(options);
    } catch (const Error& e) {
      return e.where() + e.fix();
    }
    return "no error";
  };
  EXPECT_THAT(where([](auto& o) { o.backend = "tpu"; }), testing::HasSubstr("auto, "));
  EXPECT_THAT(where([](auto& o) { o.device = "tpu"; }), testing::HasSubstr("auto, tensorrt, cuda"));
  fs::remove(file);
}

// Real files.

struct Network : testing::TestWithParam<std::tuple<std::string, std::string>> {
  void SetUp() override {
    if (!fs::exists(model())) GTEST_SKIP() << "no " << model();
    if (!fs::exists(shared() / "models/img/bus.jpg")) GTEST_SKIP() << "no images";
    const auto backends = available_backends();
    if (std::find(backends.begin(), backends.end(), backend()) == backends.end()) {
      GTEST_SKIP() << "this build lacks " << backend();
    }
  }
  static fs::path model() { return shared() / "models" / std::get<0>(GetParam()); }
  static std::string backend() { return std::get<1>(GetParam()); }
};

std::vector<std::string> classes_in(const std::vector<Instance>& instances) {
  std::vector<std::string> names;
  for (const auto& i : instances) names.push_back(i.class_name);
  return names;
}

TEST_P(Network, FindsThePersonsAndTheBus) {
  const auto found = make_detector(options_for(model(), backend()))->detect(image_frame("bus.jpg"));
  EXPECT_THAT(classes_in(found), testing::IsSupersetOf({"bus", "person", "person", "person"}));
  const cv::Rect image(0, 0, 810, 1080);
  for (const auto& i : found) {
    EXPECT_EQ(i.box & image, i.box);
    EXPECT_TRUE(i.mask.empty() || i.mask.size() == i.box.size());
  }
}

TEST_P(Network, AgreesWithOpenCv) {
  const RgbdFrame frame = image_frame("zidane.jpg");
  const auto found = make_detector(options_for(model(), backend()))->detect(frame);
  const auto reference = make_detector(options_for(model(), "opencv"))->detect(frame);
  ASSERT_EQ(classes_in(found), classes_in(reference));
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_NEAR(found[i].confidence, reference[i].confidence, 1e-3);
    const double shared_area = (found[i].box & reference[i].box).area();
    EXPECT_GT(shared_area / (found[i].box | reference[i].box).area(), 0.98);
  }
  const auto mask = [&](const std::vector<Instance>& instances) {
    return dynamic_mask({0, 0, instances}, {"person"}, frame.color.size());
  };
  const double apart = cv::countNonZero(mask(found) ^ mask(reference));
  EXPECT_LT(apart, 0.002 * cv::countNonZero(mask(reference)));
}

TEST_P(Network, ResultDoesNotDependOnRunOrThreads) {
  const RgbdFrame frame = image_frame("zidane.jpg");
  SegmentOptions options = options_for(model(), backend());
  const auto detector = make_detector(options);
  const auto once = detector->detect(frame);
  (void)detector->detect(image_frame("bus.jpg"));
  const auto twice = detector->detect(frame);
  options.threads = 2;
  const auto threads = make_detector(options)->detect(frame);
  for (const auto* other : {&twice, &threads}) {
    ASSERT_EQ(once.size(), other->size());
    for (std::size_t i = 0; i < once.size(); ++i) {
      EXPECT_EQ(once[i].confidence, (*other)[i].confidence);
      EXPECT_EQ(once[i].box, (*other)[i].box);
      if (once[i].mask.empty()) continue;
      EXPECT_EQ(cv::norm(once[i].mask, (*other)[i].mask), 0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, Network,
    testing::Combine(testing::Values("yolo11n-seg_480x640.onnx", "yolov8n-seg_480x640.onnx",
                                     "yolo11n_256x320.onnx"),
                     testing::Values("openvino", "onnxruntime", "opencv")),
    [](const auto& test) {
      return fs::path(std::get<0>(test.param)).stem().string().substr(0, 7).append("_") +
             std::get<1>(test.param) + "_" + std::to_string(test.index);
    });

TEST(PermissiveNetworks, FindPersonsAndTheBus) {
  for (const char* name : {"deeplab_v3_1_default_1.onnx", "yolox_nano_416x416.onnx"}) {
    const fs::path model = shared() / "models/permissive" / name;
    if (!fs::exists(model)) GTEST_SKIP() << "no " << model;
    const auto found = make_detector(options_for(model))->detect(image_frame("bus.jpg"));
    EXPECT_THAT(classes_in(found), testing::IsSupersetOf({"bus", "person"})) << name;
  }
}

TEST(NetworkFile, TruncationIsAnErrorAndNoCrash) {
  const fs::path model = shared() / "models/yolo11n-seg_256x320.onnx";
  if (!fs::exists(model)) GTEST_SKIP() << "no " << model;
  const std::string whole = read_file(model);
  const fs::path cut = test::own_path("cut.onnx");
  for (const double share : {0.001, 0.5, 0.99}) {
    write_file(
        cut, whole.substr(0, static_cast<std::size_t>(share * static_cast<double>(whole.size()))));
    EXPECT_THROW(make_detector(options_for(cut)), Error) << share;
  }
  fs::remove(cut);
}

}  // namespace
}  // namespace stillmap
