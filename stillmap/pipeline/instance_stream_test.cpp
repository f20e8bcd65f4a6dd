// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/instance_stream.hpp"

#include "stillmap/pipeline/recording_test.hpp"

#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// Detector that finds one person in every image, later than frames are pushed.
class LatePerson final : public Detector {
 public:
  explicit LatePerson(bool immediate) : immediate_(immediate) {}
  std::vector<Instance> detect(const RgbdFrame& frame) override {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return {recorded::person_everywhere(frame)};
  }
  std::string description() const override { return "one person"; }
  bool immediate() const override { return immediate_; }
  const std::vector<std::string>& class_names() const override { return names_; }

 private:
  const bool immediate_;
  const std::vector<std::string> names_ = {"person"};
};

/// Returns for each of seven frames the frame whose detections it was given.
std::vector<std::size_t> sources(bool immediate, const ScheduleOptions& schedule) {
  const auto& rec = recorded::recording(0, "xyz");
  SlamParameters options = recorded::small_options("seg-mask");
  options.schedule = schedule;
  InstanceStream stream(std::make_unique<LatePerson>(immediate), options);
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < 7; ++i) {
    const auto& frame = rec.frames[i];
    stream.push(frame, std::make_shared<CellGrid>(frame->depth, rec.sequence->camera()));
    found.push_back(stream.wait().detected.image->index);
  }
  stream.finish();
  return found;
}

TEST(InstanceStream, GivesEveryFrameItsOwnMasksOfAnImmediateDetectorInBothSchedules) {
  for (const bool realtime : {false, true})
    EXPECT_THAT(sources(true, {.realtime = realtime}), testing::ElementsAre(0, 1, 2, 3, 4, 5, 6));
}

TEST(InstanceStream, WaitsForTheMasksOfTheFrameIfTheirDelayIsZero) {
  for (const bool realtime : {false, true}) {
    EXPECT_THAT(sources(false, {.realtime = realtime, .segment_every = 2, .mask_delay = 0}),
                testing::ElementsAre(0, 0, 2, 2, 4, 4, 6));
  }
}

TEST(InstanceStream, GivesTheMasksOfOtherDetectorsTwoFramesLater) {
  EXPECT_THAT(sources(false, {}), testing::ElementsAre(0, 0, 0, 0, 0, 3, 3));
}

TEST(InstanceStream, NamesTheScheduleInForce) {
  SlamParameters options = recorded::small_options("seg-mask");
  options.schedule = {};
  EXPECT_FALSE(InstanceStream(nullptr, options).use());
  for (const bool immediate : {false, true}) {
    InstanceStream stream(std::make_unique<LatePerson>(immediate), options);
    stream.finish();
    ASSERT_TRUE(stream.use());
    EXPECT_EQ(stream.use()->every, immediate ? 1 : 3);
    EXPECT_EQ(stream.use()->mask_delay, immediate ? 0 : 2);
    EXPECT_FALSE(stream.use()->inference);
  }
}

}  // namespace
}  // namespace stillmap
