// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/end_to_end_detector.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/segment/coco.hpp"
#include "stillmap/segment/inference_engine.hpp"
#include "stillmap/segment/make_detector.hpp"
#include "stillmap/segment/test_onnx.hpp"

#include <cmath>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr float kNever = -100;  // Logit of a class that is not there.

float logistic(float t) { return 1 / (1 + std::exp(-t)); }

/// Returns an output whose values do not depend on the image.
test::MeanOutput constant_output(const std::string& name, const std::vector<std::int64_t>& shape,
                                 const std::vector<float>& values) {
  return {name, shape, std::vector<float>(3 * values.size()), values};
}

/// A network file for an input of 64 x 64 pixels, and an image of 128 x 64 of one color.
struct EndToEnd : testing::TestWithParam<std::string> {
  std::filesystem::path file = test::own_path("end_to_end.onnx");
  RgbdFrame frame;

  void SetUp() override {
    const auto backends = available_backends();
    if (std::ranges::find(backends, GetParam()) == backends.end())
      GTEST_SKIP() << "this build lacks " << GetParam();
    frame.color = cv::Mat(64, 128, CV_8UC3, cv::Scalar(104, 117, 125));  // blue, green, red
  }
  void TearDown() override { std::filesystem::remove(file); }

  std::unique_ptr<Detector> detector(
      const std::vector<test::MeanOutput>& outputs,
      const std::map<std::string, std::string>& metadata = {}) const {
    write_file(file, test::mean_model({1, 3, 64, 64}, outputs, metadata));
    SegmentOptions options;
    options.model = file.string();
    options.backend = GetParam();
    return make_detector(options);
  }
  std::string error_of(const std::vector<test::MeanOutput>& outputs,
                       const std::map<std::string, std::string>& metadata = {}) const {
    try {
      detector(outputs, metadata);
    } catch (const Error& e) {
      EXPECT_EQ(e.where(), file.string());
      EXPECT_FALSE(e.fix().empty());
      return e.problem();
    }
    return "no error";
  }
};

/// Logits of one query, all but one of which say that a class is not there.
std::vector<float> logits_of(std::size_t columns, std::size_t column, float logit) {
  std::vector<float> logits(columns, kNever);
  logits[column] = logit;
  return logits;
}

std::vector<float> joined(const std::vector<std::vector<float>>& parts) {
  std::vector<float> all;
  for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

// RF-DETR.

struct RfDetr : EndToEnd {
  /// The left half of the image, its lower right quarter, and a box that reaches out of it.
  test::MeanOutput dets = constant_output(
      "dets", {1, 3, 4}, {0.25F, 0.5F, 0.5F, 1, 0.75F, 0.75F, 0.5F, 0.5F, 1, 0.125F, 0.25F, 0.25F});
  test::MeanOutput labels =
      constant_output("labels", {1, 3, 91},
                      joined({logits_of(91, 1, 1), logits_of(91, 90, 3), logits_of(91, 13, 2)}));
};

TEST_P(RfDetr, GivesBoxesByDescendingConfidenceWithTheNamesOfCocosIds) {
  const auto network = detector({labels, dets});  // outputs are told apart by their names
  EXPECT_FALSE(network->gives_masks());
  const auto found = network->detect(frame);
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(found[0].class_name, "toothbrush");
  EXPECT_EQ(found[0].box, cv::Rect(64, 32, 64, 32));
  EXPECT_NEAR(found[0].confidence, logistic(3), 1e-5);
  EXPECT_EQ(found[1].class_name, "stop sign");
  EXPECT_EQ(found[1].box, cv::Rect(112, 0, 16, 16));
  EXPECT_NEAR(found[1].confidence, logistic(2), 1e-5);
  EXPECT_EQ(found[2].class_name, "person");
  EXPECT_EQ(found[2].box, cv::Rect(0, 0, 64, 64));
  EXPECT_NEAR(found[2].confidence, logistic(1), 1e-5);
}

TEST_P(RfDetr, LeavesOutWhatIsNotConfident) {
  for (std::size_t query = 0; query < 3; ++query)
    for (float& logit : std::span(labels.bias).subspan(91 * query, 91)) logit -= 3.5F;
  const auto found = detector({dets, labels})->detect(frame);
  ASSERT_EQ(found.size(), 1U);  // logistic(-0.5) is above 0.25, logistic(-1.5) is not
  EXPECT_EQ(found[0].class_name, "toothbrush");
}

// Logit of query i: difference of channel i from the mean of ImageNet [bytes].
TEST_P(RfDetr, GetsTheWholeImageInRgbWithImageNetsMeanAndDeviation) {
  const std::array<float, 3> deviation = {58.395F, 57.12F, 57.375F};  // red, green, blue
  for (std::size_t i = 0; i < 3; ++i) {
    labels.bias[91 * i + 1 + i] = 0;
    labels.weights[3 * (91 * i + 1 + i) + i] = deviation[i];
  }
  labels.bias[91 + 90] = labels.bias[2 * 91 + 13] = kNever;
  const auto found = detector({dets, labels})->detect(frame);
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(found[0].class_name, "person");  // red
  EXPECT_NEAR(found[0].confidence, logistic(125 - 123.675F), 1e-3);
  EXPECT_EQ(found[1].class_name, "bicycle");  // green
  EXPECT_NEAR(found[1].confidence, logistic(117 - 116.28F), 1e-3);
  EXPECT_EQ(found[2].class_name, "car");  // blue
  EXPECT_NEAR(found[2].confidence, logistic(104 - 103.53F), 1e-3);
}

// Each mask has 2 x 2 logits for the whole image; their zero is in the middle.
TEST_P(RfDetr, MasksAreLogitsOfTheWholeImage) {
  const auto masks = constant_output("masks", {1, 3, 2, 2},
                                     {2, -2, 2, -2,  // left half
                                      -1, -1, 1, 1,  // lower half
                                      -1, -1, -1, -1});
  const auto network = detector({dets, labels, masks});
  EXPECT_TRUE(network->gives_masks());
  const auto found = network->detect(frame);
  ASSERT_EQ(found.size(), 2U);  // the third mask is empty
  EXPECT_EQ(found[0].class_name, "toothbrush");
  EXPECT_EQ(found[0].mask.size(), cv::Size(64, 32));
  EXPECT_EQ(cv::countNonZero(found[0].mask), 64 * 32);
  EXPECT_EQ(found[1].class_name, "person");
  EXPECT_EQ(found[1].mask.size(), cv::Size(64, 64));
  EXPECT_EQ(cv::countNonZero(found[1].mask), 64 * 64);
}

TEST_P(RfDetr, AMaskEndsWhereItsLogitsChangeTheirSign) {
  dets.bias = {0.5F, 0.5F, 1, 1, 0.5F, 0.5F, 1, 1, 0.5F, 0.5F, 1, 1};
  const auto masks =
      constant_output("masks", {1, 3, 2, 2}, {2, -2, 2, -2, -1, -1, 1, 1, -1, -1, -1, -1});
  const auto found = detector({dets, labels, masks})->detect(frame);
  ASSERT_EQ(found.size(), 2U);
  cv::Mat1b lower = cv::Mat1b::zeros(64, 128), left = cv::Mat1b::zeros(64, 128);
  lower(cv::Rect(0, 32, 128, 32)) = 255;
  left(cv::Rect(0, 0, 64, 64)) = 255;
  EXPECT_EQ(cv::norm(found[0].mask, lower, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(found[1].mask, left, cv::NORM_INF), 0);
}

TEST_P(RfDetr, ClassNamesOfItsMetadataAreUsedAndTheLastColumnIsTheBackground) {
  labels =
      constant_output("labels", {1, 3, 3}, {1, kNever, 5, kNever, 2, kNever, kNever, kNever, 5});
  const std::string json = R"({"task":"detect","class_id_to_name":{"0":"Person","1":"forklift"}})";
  const auto network = detector({dets, labels}, {{"rfdetr_inference", json}});
  EXPECT_THAT(network->class_names(), testing::ElementsAre("person", "forklift"));
  const auto found = network->detect(frame);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].class_name, "forklift");
  EXPECT_EQ(found[0].box, cv::Rect(64, 32, 64, 32));
  EXPECT_EQ(found[1].class_name, "person");
}

TEST_P(RfDetr, UnknownClassesAreAnErrorThatSaysSo) {
  labels = constant_output("labels", {1, 3, 7}, std::vector<float>(21));
  EXPECT_THAT(error_of({dets, labels}),
              testing::HasSubstr("7 columns of classes, but the names of 0"));
  EXPECT_THAT(error_of({dets, labels}, {{"names", "{0: 'person'}"}}),
              testing::HasSubstr("7 columns of classes, but the names of 1"));
}

// RTMDet.

struct RtmDet : EndToEnd {
  /// In the input, whose lower half is padding: x1, y1, x2, y2, score.
  test::MeanOutput dets = constant_output(
      "dets", {1, 3, 5}, {0, 0, 32, 32, 0.5F, 48, 16, 64, 24, 0.75F, 0, 0, 0, 0, 0});
  test::MeanOutput labels = constant_output("labels", {1, 3}, {0, 79, 0});

  void SetUp() override {
    EndToEnd::SetUp();
    labels.integers = true;
  }
};

TEST_P(RtmDet, GivesBoxesWithTheNamesOfCocosClasses) {
  const auto network = detector({dets, labels});
  EXPECT_FALSE(network->gives_masks());
  const auto found = network->detect(frame);
  ASSERT_EQ(found.size(), 2U);  // the third row says that there are no more
  EXPECT_EQ(found[0].class_name, "toothbrush");
  EXPECT_EQ(found[0].box, cv::Rect(96, 32, 32, 16));
  EXPECT_FLOAT_EQ(found[0].confidence, 0.75F);
  EXPECT_EQ(found[1].class_name, "person");
  EXPECT_EQ(found[1].box, cv::Rect(0, 0, 64, 64));
  EXPECT_FLOAT_EQ(found[1].confidence, 0.5F);
}

TEST_P(RtmDet, IgnoresClassesThatItDoesNotHave) {
  labels.bias[1] = 80;
  const auto found = detector({dets, labels})->detect(frame);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].class_name, "person");
}

// The blue channel gives the score of detection 0, the red one the score of detection 1. Half of
// the input is gray (114).
TEST_P(RtmDet, GetsItsImageInBgrAndGrayAround) {
  dets.bias[4] = dets.bias[9] = 0.5F;
  dets.weights[static_cast<std::size_t>(3 * 4)] = 57.375F / 100;
  dets.weights[static_cast<std::size_t>(3 * 9 + 2)] = 58.395F / 100;
  const auto found = detector({dets, labels})->detect(frame);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].class_name, "person");
  EXPECT_NEAR(found[0].confidence, 0.5F + ((104 + 114) / 2.0F - 103.53F) / 100, 1e-4);
  EXPECT_EQ(found[1].class_name, "toothbrush");
  EXPECT_NEAR(found[1].confidence, 0.5F + ((125 + 114) / 2.0F - 123.675F) / 100, 1e-4);
}

// Masks of 4 x 4 probabilities for the input, whose upper half is the image.
TEST_P(RtmDet, MasksAreProbabilitiesInTheInput) {
  dets.bias[2] = 64;  // the whole image
  std::vector<float> probabilities;
  for (int row = 0; row < 4; ++row)
    probabilities.insert(probabilities.end(), {0.75F, 0.75F, 0.25F, 0.25F});
  std::vector<float> all(16, 0.625F);
  const auto masks = constant_output("masks", {1, 2, 4, 4}, joined({probabilities, all}));
  const auto network = detector({dets, labels, masks});  // no mask for the row of zeros
  EXPECT_TRUE(network->gives_masks());
  const auto found = network->detect(frame);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].class_name, "toothbrush");
  EXPECT_EQ(cv::countNonZero(found[0].mask), 32 * 16);
  cv::Mat1b left = cv::Mat1b::zeros(64, 128);
  left(cv::Rect(0, 0, 64, 64)) = 255;
  EXPECT_EQ(found[1].class_name, "person");
  EXPECT_EQ(cv::norm(found[1].mask, left, cv::NORM_INF), 0);
}

TEST_P(RtmDet, AClassNumberOfTheMetadataHasItsName) {
  const auto found = detector({dets, labels}, {{"names", "['worker']"}})->detect(frame);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].class_name, "worker");
}

TEST_P(RtmDet, OtherShapesAreAnErrorThatListsThem) {
  dets = constant_output("dets", {1, 3, 6}, std::vector<float>(18));
  EXPECT_THAT(error_of({dets, labels}),
              testing::HasSubstr("the outputs fit neither RF-DETR nor RTMDet: dets [1, 3, 6] "
                                 "labels [1, 3]"));
  const auto queries = constant_output("dets", {1, 3, 4}, std::vector<float>(12));
  EXPECT_THAT(error_of({queries, labels}), testing::HasSubstr("dets [1, 3, 4] labels [1, 3]"));
}

TEST_P(RtmDet, MasksOfAnotherShapeAreAnError) {
  const auto masks = constant_output("masks", {1, 3, 4}, std::vector<float>(12));
  EXPECT_THAT(error_of({dets, labels, masks}), testing::HasSubstr("masks [1, 3, 4]"));
}

const auto kBackends = testing::Values("openvino", "onnxruntime");
INSTANTIATE_TEST_SUITE_P(All, RfDetr, kBackends, [](const auto& test) { return test.param; });
INSTANTIATE_TEST_SUITE_P(All, RtmDet, kBackends, [](const auto& test) { return test.param; });

// MMDeploy may give one mask less than detections: the last one, a row of zeros, has none.
TEST(EndToEndOutputs, DetectionsWithoutAMaskAreLeftOut) {
  const std::vector<std::vector<std::int64_t>> shapes = {{1, 2, 5}, {1, 2}, {1, 1, 1, 1}};
  const auto shape = recognize_end_to_end({"dets", "labels", "masks"}, shapes, "file");
  const std::vector<float> dets = {0, 0, 8, 8, 0.5F, 16, 16, 32, 32, 0.75F}, labels = {0, 0};
  const std::vector<float> masks = {1};
  const std::vector<TensorView> outputs = {
      {shapes[0], dets}, {shapes[1], labels}, {shapes[2], masks}};
  const Letterbox letterbox({64, 64}, {64, 64});
  const auto found = decode_end_to_end(outputs, shape, letterbox, 0.25F, coco_class_names());
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].box, cv::Rect(0, 0, 8, 8));
}

TEST(EndToEndOutputs, MayHaveNoDetection) {
  const std::vector<std::vector<std::int64_t>> shapes = {{1, 1, 5}, {1, 1}, {1, 0, 64, 64}};
  const auto shape = recognize_end_to_end({"dets", "labels", "masks"}, shapes, "file");
  const std::vector<float> zeros(5);
  const std::vector<TensorView> outputs = {
      {shapes[0], zeros}, {shapes[1], std::span(zeros).first(1)}, {shapes[2], {}}};
  const Letterbox letterbox({64, 64}, {64, 64});
  EXPECT_TRUE(decode_end_to_end(outputs, shape, letterbox, 0, coco_class_names()).empty());
}

TEST(CocoNames, ByIdAreThoseOfTheAnnotations) {
  const auto& names = coco_names_by_id();
  ASSERT_EQ(names.size(), 91U);
  EXPECT_EQ(names[0], "class 0");
  EXPECT_EQ(names[1], "person");
  EXPECT_EQ(names[27], "backpack");
  EXPECT_EQ(names[62], "chair");
  EXPECT_EQ(names[67], "dining table");
  EXPECT_EQ(names[72], "tv");
  EXPECT_EQ(names[83], "class 83");
  EXPECT_EQ(names[90], "toothbrush");
}

}  // namespace
}  // namespace stillmap
