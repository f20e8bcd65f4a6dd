// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/tolerant_detector.hpp"

#include <functional>
#include <stdexcept>

#include <gmock/gmock.h>

namespace stillmap {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr int kWidth = 64, kHeight = 48;

Instance person(const cv::Rect& box, cv::Size mask) {
  return {.class_id = 0,
          .class_name = "person",
          .confidence = 1,
          .box = box,
          .mask = cv::Mat1b(mask, std::uint8_t{255})};
}

/// Detector that finds one person in every frame, except for frame 3, in which it calls `act`.
class FailingOnce final : public Detector {
 public:
  using Act = std::function<Instance()>;
  explicit FailingOnce(Act act) : act_(std::move(act)) {}
  std::vector<Instance> detect(const RgbdFrame& frame) override {
    return {frame.index == 3 ? act_() : person({8, 8, 10, 20}, {10, 20})};
  }
  std::string description() const override { return "my detector"; }
  const std::vector<std::string>& class_names() const override { return names_; }

 private:
  const Act act_;
  const std::vector<std::string> names_ = {"person"};
};

/// Instances and messages of seven frames.
struct Seven {
  std::vector<std::size_t> instances;  // by frame
  std::string warning, skipped;
  std::size_t failures = 0;
};

Seven seven_frames(FailingOnce::Act act) {
  TolerantDetector detector(std::make_unique<FailingOnce>(std::move(act)));
  Seven seven;
  testing::internal::CaptureStderr();
  for (std::size_t i = 0; i < 7; ++i) {
    RgbdFrame frame;
    frame.index = i;
    frame.gray = cv::Mat1b(kHeight, kWidth, std::uint8_t{0});
    seven.instances.push_back(detector.detect(frame).size());
  }
  seven.warning = testing::internal::GetCapturedStderr();
  seven.skipped = detector.skipped();
  seven.failures = detector.failures();
  return seven;
}

TEST(TolerantDetector, LosesTheInstancesOfAFrameInWhichTheDetectorThrows) {
  const Seven seven = seven_frames([]() -> Instance { throw std::runtime_error("no memory"); });
  EXPECT_THAT(seven.instances, ElementsAre(1, 1, 1, 0, 1, 1, 1));
  EXPECT_EQ(seven.failures, 1U);
  EXPECT_EQ(seven.skipped,
            "the detector failed in 1 of 7 frames; the first: my detector: no memory");
  EXPECT_THAT(seven.warning, AllOf(HasSubstr("failed in frame 3"), HasSubstr("(my detector: no"),
                                   HasSubstr("fix: correct the detector")));
}

TEST(TolerantDetector, SaysNothingOfADetectorThatWorks) {
  const Seven seven = seven_frames([] { return person({0, 0, kWidth, kHeight}, {}); });
  EXPECT_THAT(seven.instances, ElementsAre(1, 1, 1, 1, 1, 1, 1));
  EXPECT_THAT(seven.warning + seven.skipped, IsEmpty());
}

TEST(TolerantDetector, NamesTheSizesOfAMaskOrBoxThatDoesNotFit) {
  EXPECT_THAT(seven_frames([] {
                return person({8, 8, 10, 20}, {20, 10});
              }).warning,
              HasSubstr("the mask of a 'person' is 20 x 10 of type CV_8UC1, and its box 10 x 20"));
  EXPECT_THAT(seven_frames([] {
                return person({60, 8, 10, 20}, {10, 20});
              }).warning,
              HasSubstr("the box of a 'person' is 10 x 20 pixels at (60, 8), not within the image "
                        "of 64 x 48"));
}

TEST(TolerantDetector, WarnsOnce) {
  TolerantDetector detector(std::make_unique<FailingOnce>(
      []() -> Instance { throw Error("is broken", "here", "mend it"); }));
  RgbdFrame frame;
  frame.index = 3;
  testing::internal::CaptureStderr();
  detector.detect(frame);
  EXPECT_THAT(testing::internal::GetCapturedStderr(),
              AllOf(HasSubstr("(here: is broken)"), HasSubstr("fix: mend it")));
  testing::internal::CaptureStderr();
  detector.detect(frame);
  EXPECT_THAT(testing::internal::GetCapturedStderr(), IsEmpty());
  EXPECT_EQ(detector.failures(), 2U);
}

}  // namespace
}  // namespace stillmap
