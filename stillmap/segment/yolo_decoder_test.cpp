// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/yolo_decoder.hpp"

#include "stillmap/base/error.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr int kClasses = 3, kCoefficients = 2, kAnchors = 20;
constexpr int kAttributes = 4 + kClasses + kCoefficients;
const std::vector<std::string> kNames = {"person", "chair", "cat"};

/// Output of a network with kAnchors anchors, all inactive until set. Either layout.
struct FakeOutput {
  bool attributes_first;
  std::vector<float> values = std::vector<float>(kAttributes * kAnchors, 0.0F);
  std::vector<float> prototypes = std::vector<float>(kCoefficients * 16 * 16, 0.0F);

  float& at(int anchor, int attribute) {
    return values[static_cast<std::size_t>(attributes_first ? attribute * kAnchors + anchor
                                                            : anchor * kAttributes + attribute)];
  }
  void propose(int anchor, cv::Rect2f box, int class_id, float score) {
    at(anchor, 0) = box.x + box.width / 2;
    at(anchor, 1) = box.y + box.height / 2;
    at(anchor, 2) = box.width;
    at(anchor, 3) = box.height;
    at(anchor, 4 + class_id) = score;
  }
  std::vector<std::vector<std::int64_t>> shapes() const {
    if (attributes_first) return {{1, kAttributes, kAnchors}, {1, kCoefficients, 16, 16}};
    return {{1, kAnchors, kAttributes}, {1, kCoefficients, 16, 16}};
  }
  std::vector<TensorView> views() const {
    return {{shapes()[0], values}, {shapes()[1], prototypes}};
  }
  std::vector<Instance> decode(const Letterbox& letterbox) const {
    return decode_yolo(views(), recognize_yolo(shapes(), kClasses, "test"), letterbox, {}, kNames);
  }
};

struct Layouts : testing::TestWithParam<bool> {
  FakeOutput output{GetParam()};
  Letterbox letterbox{{128, 96}, {64, 64}};  // half size, 8 rows of padding above and below
};

TEST_P(Layouts, ReturnsKnownBoxesInImagePixelsByDescendingConfidence) {
  output.at(0, 7) = output.at(5, 7) = 1;              // both use prototype 0,
  std::fill_n(output.prototypes.begin(), 256, 1.0F);  // which is all inside
  output.propose(5, {10, 20, 20, 30}, 2, 0.6F);
  output.propose(0, {0, 8, 8, 8}, 1, 0.9F);
  const auto found = output.decode(letterbox);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].class_name, "chair");
  EXPECT_FLOAT_EQ(found[0].confidence, 0.9F);
  EXPECT_EQ(found[0].box, cv::Rect(0, 0, 16, 16));
  EXPECT_EQ(found[1].class_id, 2);
  EXPECT_EQ(found[1].box, cv::Rect(20, 24, 40, 60));
  EXPECT_EQ(found[1].mask.size(), found[1].box.size());
  EXPECT_EQ(cv::countNonZero(found[1].mask), 40 * 60);
}

TEST_P(Layouts, BoxesAreClippedToTheImage) {
  output.at(3, 8) = 1;
  std::fill_n(output.prototypes.begin() + 256, 256, 1.0F);
  output.propose(3, {50, 40, 40, 40}, 0, 0.8F);
  const auto found = output.decode(letterbox);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].box, cv::Rect(100, 64, 28, 32));
}

TEST_P(Layouts, MaskIsTheWeightedSumOfPrototypesCutAtZero) {
  // Prototype 0 rises to the right and is 0 between its columns 7 and 8: input x = 32, image x
  // = 64. Prototype 1 is a constant, which the second coefficient scales to shift that border by
  // one column = 8 image pixels.
  for (int i = 0; i < 256; ++i) {
    output.prototypes[static_cast<std::size_t>(i)] = static_cast<float>(i % 16) - 7.5F;
    output.prototypes[static_cast<std::size_t>(256 + i)] = 1;
  }
  output.propose(7, {16, 16, 32, 32}, 0, 0.8F);
  output.at(7, 7) = 2;
  output.at(7, 8) = 2;
  const auto found = output.decode(letterbox);
  ASSERT_EQ(found.size(), 1U);
  const cv::Rect box(32, 16, 64, 64);
  ASSERT_EQ(found[0].box, box);
  const int border = 64 - 8;
  for (int y = 0; y < box.height; ++y) {
    for (int x = 0; x < box.width; ++x) {
      ASSERT_EQ(found[0].mask.at<std::uint8_t>(y, x), box.x + x >= border ? 255 : 0)
          << x << " " << y;
    }
  }
}

TEST_P(Layouts, WeakAndInvalidCandidatesAreIgnored) {
  std::fill_n(output.prototypes.begin(), 256, 1.0F);
  for (int a = 0; a < kAnchors; ++a) output.at(a, 7) = 1;
  output.propose(0, {0, 10, 10, 10}, 0, 0.24F);
  output.propose(2, {40, 10, 10, 10}, 0, 0.9F);
  output.at(2, 0) = std::numeric_limits<float>::quiet_NaN();
  output.propose(3, {40, 30, 10, 10}, 0, std::numeric_limits<float>::quiet_NaN());
  output.propose(4, {20, 40, 10, 10}, 0, 0.5F);
  const auto found = output.decode(letterbox);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].box, cv::Rect(40, 64, 20, 20));
}

INSTANTIATE_TEST_SUITE_P(Both, Layouts, testing::Bool(), [](const auto& test) {
  return test.param ? "AttributesFirst" : "AnchorsFirst";
});

std::vector<std::size_t> anchors_of(const std::vector<Candidate>& candidates) {
  std::vector<std::size_t> anchors;
  for (const auto& c : candidates) anchors.push_back(c.anchor);
  return anchors;
}

TEST(SuppressOverlaps, DropsTheWeakerOfOneClassOnly) {
  const cv::Rect2f box(0, 0, 10, 10), shifted(1, 0, 10, 10), apart(5, 0, 10, 10);  // IoU .82, .33
  const auto kept = suppress_overlaps(
      {{box, 0.5F, 0, 0}, {shifted, 0.9F, 0, 1}, {box, 0.4F, 1, 2}, {apart, 0.3F, 0, 3}}, 0.7F,
      100);
  EXPECT_THAT(anchors_of(kept), testing::ElementsAre(1, 2, 3));
}

TEST(SuppressOverlaps, ThresholdDecidesAndTiesAreResolvedByAnchor) {
  const cv::Rect2f box(0, 0, 10, 10), half(0, 0, 10, 5);  // IoU exactly 0.5
  const std::vector<Candidate> pair = {{half, 0.5F, 0, 8}, {box, 0.5F, 0, 3}};
  EXPECT_THAT(anchors_of(suppress_overlaps(pair, 0.49F, 100)), testing::ElementsAre(3));
  EXPECT_THAT(anchors_of(suppress_overlaps(pair, 0.5F, 100)), testing::ElementsAre(3, 8));
}

TEST(SuppressOverlaps, KeepsTheMostConfidentUpToTheLimit) {
  std::vector<Candidate> many;
  for (std::size_t i = 0; i < 10; ++i) {
    many.push_back(
        {{20.0F * static_cast<float>(i), 0, 10, 10}, 0.05F * static_cast<float>(i), 0, i});
  }
  EXPECT_THAT(anchors_of(suppress_overlaps(many, 0.7F, 3)), testing::ElementsAre(9, 8, 7));
}

TEST(RecognizeYolo, RecognizesTheFourStandardShapes) {
  const auto segment = recognize_yolo({{1, 116, 8400}, {1, 32, 160, 160}}, 80, "x");
  EXPECT_TRUE(segment.attributes_first);
  EXPECT_EQ(segment.mask_coefficients, 32);
  const auto transposed = recognize_yolo({{1, 32, 160, 160}, {1, 8400, 116}}, 80, "x");
  EXPECT_FALSE(transposed.attributes_first);
  EXPECT_EQ(transposed.boxes_output, 1U);
  EXPECT_EQ(transposed.prototypes_output, 0U);
  EXPECT_EQ(recognize_yolo({{1, 84, 8400}}, 0, "x").classes, 80);
  EXPECT_EQ(recognize_yolo({{1, 8400, 84}}, 0, "x").anchors, 8400U);
}

TEST(RecognizeYolo, ClassCountDecidesWhereAnchorsAreFewerThanAttributes) {
  EXPECT_TRUE(recognize_yolo({{1, 116, 84}, {1, 32, 16, 16}}, 80, "x").attributes_first);
  EXPECT_FALSE(recognize_yolo({{1, 84, 116}, {1, 32, 16, 16}}, 80, "x").attributes_first);
}

TEST(RecognizeYolo, OtherShapesAreAnErrorWithExportAdvice) {
  const std::vector<std::vector<std::vector<std::int64_t>>> wrong = {
      {{1, 1000}},                               // a classifier
      {{1, 25200, 86}},                          // one class too many, with objectness or without
      {{1, 116, 8400}},                          // masks declared, no prototypes
      {{2, 84, 8400}},                           // two images
      {{1, 32, 160, 160}},                       // prototypes alone
      {{1, 3, 80, 80, 85}, {1, 3, 40, 40, 85}},  // a raw head is missing
      {{1, 3, 80, 80, 85}, {1, 3, 40, 40, 85}, {1, 3, 10, 10, 85}},  // one of another stride
      {{1, 3, 80, 80, 85}, {1, 3, 40, 40, 85}, {1, 3, 20, 20, 90}},  // heads that differ
      {{1, 3, 80, 80, 25}, {1, 3, 40, 40, 25}, {1, 3, 20, 20, 25}},  // other classes
      {{1, 255, 80, 80}, {1, 255, 40, 40}, {1, 255, 20, 20}},        // heads not yet reshaped
      {},
  };
  for (const auto& shapes : wrong) {
    try {
      recognize_yolo(shapes, 80, "odd.onnx", {640, 640});
      FAIL() << "accepted a wrong shape";
    } catch (const Error& e) {
      EXPECT_EQ(e.where(), "odd.onnx");
      EXPECT_THAT(e.fix(), testing::HasSubstr("yolo export model=yolo11n-seg.pt format=onnx"));
    }
  }
}

TEST(RecognizeYolo, RecognizesDetectionsByTheirNumber) {
  const cv::Size input(640, 640);
  for (const int classes : {1, 2, 80}) {
    const auto boxes = recognize_yolo({{1, 300, 6}}, classes, "x", input);
    EXPECT_TRUE(boxes.end_to_end) << classes;
    EXPECT_EQ(boxes.classes, classes);
    EXPECT_EQ(boxes.anchors, 300U);
    const auto masks = recognize_yolo({{1, 300, 38}, {1, 32, 160, 160}}, classes, "x", input);
    EXPECT_TRUE(masks.end_to_end) << classes;
    EXPECT_EQ(masks.mask_coefficients, 32);
  }
  EXPECT_FALSE(recognize_yolo({{1, 6, 8400}}, 2, "x", input).end_to_end);
  EXPECT_FALSE(recognize_yolo({{1, 8400, 6}}, 2, "x", input).end_to_end);
  EXPECT_FALSE(recognize_yolo({{1, 25200, 6}}, 1, "x", input).end_to_end);
  EXPECT_THROW(recognize_yolo({{1, 300, 6}}, 0, "x", input), Error);  // which classes?
}

TEST(DecodeYolo, ReadsTheDetectionsOfEndToEndNetworks) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> rows = {10, 20, 30, 50, 0.9F, 1,  // a chair
                                   0,  0,  10, 10, 0.2F, 0,  // not confident
                                   0,  0,  10, 10, 0.8F, 7,  // of no class
                                   5,  5,  5,  9,  0.8F, 0,  // without extent
                                   0,  8,  4,  16, 0.5F, 0,  // a person
                                   0,  0,  10, 10, kNan, 0};
  const std::vector<TensorView> outputs{{{1, 6, 6}, rows}};
  const auto shape = recognize_yolo({{1, 6, 6}}, 3, "x", {64, 64});
  const auto found = decode_yolo(outputs, shape, Letterbox({128, 96}, {64, 64}), {}, kNames);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].class_name, "chair");
  EXPECT_FLOAT_EQ(found[0].confidence, 0.9F);
  EXPECT_EQ(found[0].box, cv::Rect(20, 24, 40, 60));
  EXPECT_EQ(found[1].class_name, "person");
  EXPECT_EQ(found[1].box, cv::Rect(0, 0, 8, 16));
}

TEST(RecognizeYolo, RecognizesObjectnessByTheClassCount) {
  const auto boxes = recognize_yolo({{1, 25200, 85}}, 80, "x");
  EXPECT_TRUE(boxes.objectness);
  EXPECT_FALSE(boxes.attributes_first);
  EXPECT_EQ(boxes.classes, 80);
  EXPECT_EQ(boxes.anchors, 25200U);
  const auto masks = recognize_yolo({{1, 25200, 117}, {1, 32, 160, 160}}, 80, "x");
  EXPECT_TRUE(masks.objectness);
  EXPECT_EQ(masks.classes, 80);
  EXPECT_FALSE(recognize_yolo({{1, 85, 8400}}, 81, "x").objectness);
}

TEST(RecognizeYolo, WithoutAClassListTheAnchorsPerCellImplyObjectness) {
  const cv::Size input(320, 256);  // 40 * 32 + 20 * 16 + 10 * 8 = 1680 cells
  EXPECT_TRUE(recognize_yolo({{1, 5040, 85}}, 0, "x", input).objectness);
  EXPECT_EQ(recognize_yolo({{1, 5040, 25}}, 0, "x", input).classes, 20);
  EXPECT_TRUE(recognize_yolo({{1, 1680, 85}}, 0, "x", input).objectness);  // YOLOX
  EXPECT_FALSE(recognize_yolo({{1, 1680, 84}}, 0, "x", input).objectness);
  EXPECT_FALSE(recognize_yolo({{1, 85, 1680}}, 0, "x", input).objectness);
  EXPECT_TRUE(recognize_yolo({{1, 25200, 85}}, 0, "x").objectness);
}

// YOLOX.

struct YoloX : testing::Test {
  cv::Size input{64, 32};  // 8 * 4 + 4 * 2 + 2 * 1 = 42 cells
  YoloShape shape = recognize_yolo({{1, 42, 8}}, 3, "x", input);
  std::vector<float> values = std::vector<float>(42 * 8, 0.0F);

  void propose(std::size_t anchor, std::array<float, 4> box, float objectness, float person) {
    std::copy(box.begin(), box.end(), values.begin() + static_cast<std::ptrdiff_t>(anchor * 8));
    values[anchor * 8 + 4] = objectness;
    values[anchor * 8 + 5] = person;
  }
  std::vector<Candidate> candidates() const {
    return read_candidates({{1, 42, 8}, values}, shape, 0.25F);
  }
};

TEST_F(YoloX, CentersAreRelativeToTheCellAndSizesAreLogarithms) {
  propose(32 + 6, {0.5F, 0.25F, std::log(1.5F), std::numbers::ln2_v<float>}, 0.8F,
          0.5F);                         // stride 16: (2, 1)
  propose(0, {0, 0, 0, 0}, 0.4F, 0.5F);  // the product of both scores is too low
  const auto found = candidates();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_FLOAT_EQ(found[0].confidence, 0.4F);
  EXPECT_FLOAT_EQ(found[0].box.x + found[0].box.width / 2, 2.5F * 16);
  EXPECT_FLOAT_EQ(found[0].box.y + found[0].box.height / 2, 1.25F * 16);
  EXPECT_FLOAT_EQ(found[0].box.width, 24);
  EXPECT_FLOAT_EQ(found[0].box.height, 32);
}

TEST_F(YoloX, BoxesOfAnExportThatDecodesThemStayAsTheyAre) {
  propose(41, {48, 16, 20, 10}, 1, 1);
  EXPECT_NEAR(candidates()[0].box.width, std::exp(20.0F) * 32, 1e6);  // not yet known
  leave_decoded({{1, 42, 8}, values}, input, shape);
  EXPECT_EQ(candidates()[0].box, cv::Rect2f(38, 11, 20, 10));
}

TEST_F(YoloX, CentersWithinACellAreNotDecodedOnes) {
  propose(41, {3.7F, 3.6F, 0, 0}, 1, 1);
  leave_decoded({{1, 42, 8}, values}, input, shape);
  EXPECT_EQ(shape.cells.size(), 42U);
}

TEST(RecognizeYolo, RecognizesRawHeadsInAnyOrder) {
  for (const int known : {0, 80}) {
    const auto shape = recognize_yolo({{1, 3, 16, 20, 85}, {1, 3, 32, 40, 85}, {1, 3, 8, 10, 85}},
                                      known, "x", {320, 256});
    EXPECT_EQ(shape.classes, 80);
    EXPECT_TRUE(shape.objectness);
    ASSERT_EQ(shape.raw_heads.size(), 3U);
    EXPECT_EQ(shape.raw_heads[0].output, 1U);
    EXPECT_EQ(shape.raw_heads[1].output, 0U);
    EXPECT_FLOAT_EQ(shape.raw_heads[2].stride, 32);
  }
}

TEST(RecognizeYolo, RawHeadsNextToDecodedBoxesAreIgnored) {
  const auto shape =
      recognize_yolo({{1, 5040, 85}, {1, 3, 32, 40, 85}, {1, 3, 16, 20, 85}, {1, 3, 8, 10, 85}}, 80,
                     "x", {320, 256});
  EXPECT_TRUE(shape.raw_heads.empty());
  EXPECT_EQ(shape.anchors, 5040U);
}

TEST(Objectness, MultipliesTheClassScore) {
  const std::size_t anchors = 5, attributes = 8;
  std::vector<float> values(anchors * attributes, 0.0F);
  const auto propose = [&](std::size_t anchor, float objectness, float chair) {
    const std::array<float, 8> row = {30, 40, 20, 10, objectness, 0.1F, chair, 0.2F};
    std::copy(row.begin(), row.end(), values.begin() + static_cast<std::ptrdiff_t>(anchor * 8));
  };
  propose(1, 0.5F, 0.4F);  // 0.2: too little, although both are above the threshold
  propose(3, 0.8F, 0.9F);
  const std::vector<TensorView> outputs = {{{1, 5, 8}, values}};
  const auto shape = recognize_yolo({{1, 5, 8}}, kClasses, "test");
  const auto found =
      decode_yolo(outputs, shape, Letterbox({64, 64}, {64, 64}), DecodeOptions(), kNames);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].class_name, "chair");
  EXPECT_FLOAT_EQ(found[0].confidence, 0.72F);
  EXPECT_EQ(found[0].box, cv::Rect(20, 35, 20, 10));
  EXPECT_TRUE(found[0].mask.empty());
}

/// Raw heads for an input of 64 x 64 pixels, inactive until set.
struct FakeHeads {
  static constexpr std::size_t kAttributes = 5 + kClasses;
  std::array<std::size_t, 3> side = {8, 4, 2};
  std::array<std::vector<float>, 3> values;

  FakeHeads() {
    for (std::size_t h = 0; h < 3; ++h) {
      values[h].assign(3 * side[h] * side[h] * kAttributes, -20.0F);
    }
  }
  static float logit(float p) { return std::log(p / (1 - p)); }
  /// @param x, y, w, h  logistic values of the box
  void propose(std::size_t head, std::size_t size, std::size_t row, std::size_t column,
               std::array<float, 4> box, float objectness, std::size_t class_id, float score) {
    float* out =
        values[head].data() + ((size * side[head] + row) * side[head] + column) * kAttributes;
    for (std::size_t k = 0; k < 4; ++k) out[k] = logit(box[k]);
    out[4] = logit(objectness);
    out[5 + class_id] = logit(score);
  }
  std::vector<std::vector<std::int64_t>> shapes() const {
    std::vector<std::vector<std::int64_t>> all;
    for (const auto n : side) {
      const auto s = static_cast<std::int64_t>(n);
      all.push_back({1, 3, s, s, kAttributes});
    }
    return all;
  }
  std::vector<Instance> decode() const {
    std::vector<TensorView> views;
    for (std::size_t h = 0; h < 3; ++h) views.push_back({shapes()[h], values[h]});
    return decode_yolo(views, recognize_yolo(shapes(), kClasses, "test", {64, 64}),
                       Letterbox({64, 64}, {64, 64}), DecodeOptions(), kNames);
  }
};

TEST(RawHeads, BoxesFollowFromCellStrideAndAnchor) {
  FakeHeads heads;
  // Stride 8, third anchor box 40 x 28, row 2, column 3: center (3.5 * 8, 2.5 * 8), full size.
  heads.propose(0, 2, 2, 3, {0.5F, 0.5F, 0.5F, 0.5F}, 0.9F, 0, 0.8F);
  // Stride 16, first anchor box 36 x 75, row 1, column 2: (1.5 - 0.5 + 2) * 16 = 48, (0.5 - 0.5 +
  // 1) * 16 = 16, (2 * 0.25)^2 * 36 = 9, (2 * 0.2)^2 * 75 = 12.
  heads.propose(1, 0, 1, 2, {0.75F, 0.25F, 0.25F, 0.2F}, 0.8F, 2, 0.5F);
  const auto found = heads.decode();
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].class_name, "person");
  EXPECT_NEAR(found[0].confidence, 0.72F, 1e-5);
  EXPECT_EQ(found[0].box & cv::Rect(9, 7, 38, 26), cv::Rect(9, 7, 38, 26));  // 8, 6, 40, 28
  EXPECT_LE(found[0].box.area(), 42 * 30);  // rounded outwards by a pixel at most
  EXPECT_EQ(found[1].class_name, "cat");
  EXPECT_NEAR(found[1].confidence, 0.4F, 1e-5);
  EXPECT_NEAR(found[1].box.x, 43.5, 1);
  EXPECT_NEAR(found[1].box.br().x, 52.5, 1);
  EXPECT_NEAR(found[1].box.y, 10, 1);
  EXPECT_NEAR(found[1].box.br().y, 22, 1);
}

TEST(RawHeads, InactiveAndInvalidCellsGiveNothing) {
  FakeHeads heads;
  heads.propose(2, 1, 0, 1, {0.5F, 0.5F, 0.5F, 0.5F}, 0.4F, 0, 0.5F);  // 0.2
  heads.propose(0, 0, 0, 0, {0.5F, 0.5F, 0.5F, 0.5F}, 0.9F, 0, 0.9F);
  heads.values[0][0] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(heads.decode().empty());
}

}  // namespace
}  // namespace stillmap
