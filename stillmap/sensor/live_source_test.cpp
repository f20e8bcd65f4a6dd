// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/live_source.hpp"

#include "stillmap/base/test_error.hpp"
#include "stillmap/sensor/test_sequence.hpp"

#include <atomic>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using test::error_of;
using ::testing::HasSubstr;
using ::testing::SizeIs;

// The long time is for sources that end by themselves.
constexpr double kShort = 0.02, kLong = 60;  // s

using Flag = std::shared_ptr<std::atomic<bool>>;

// Delivers frames with the times 1, 2, 3, ... s at once, then none.
class Script : public LiveCamera {
 public:
  Script(int frames, Flag read, bool fails = false)
      : frames_(frames), read_(std::move(read)), fails_(fails), camera_(TestSequence::camera()) {}
  const Camera& camera() const override { return camera_; }
  std::shared_ptr<RgbdFrame> read() override {
    if (delivered_ == frames_) {
      *read_ = true;
      if (fails_) throw Error("is unplugged", "camera", "plug it in");
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      return nullptr;
    }
    auto frame = std::make_shared<RgbdFrame>();
    frame->timestamp = ++delivered_;
    return frame;
  }

 private:
  int frames_, delivered_ = 0;
  Flag read_;  // whether the source has all frames
  bool fails_;
  Camera camera_;
};

// Returns a source that has read all frames of a Script.
std::unique_ptr<LiveSource> source_of(int frames, bool fails = false) {
  const auto read = std::make_shared<std::atomic<bool>>(false);
  auto source = std::make_unique<LiveSource>(std::make_unique<Script>(frames, read, fails),
                                             Following{.patience = fails ? kLong : kShort});
  while (!*read) std::this_thread::yield();
  return source;
}

std::vector<double> times_of(LiveSource& source) {
  std::vector<double> times;
  while (const RgbdFramePtr frame = source.next()) times.push_back(frame->timestamp);
  return times;
}

TEST(LiveSource, DropsTheOldestFramesThatNobodyTakesAndListsThem) {
  const auto source = source_of(5);
  const RgbdFramePtr first = source->next();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->timestamp, 4);
  EXPECT_EQ(first->index, 0U);
  EXPECT_EQ(times_of(*source), (std::vector<double>{5}));
  ASSERT_THAT(source->skipped(), SizeIs(3));
  EXPECT_EQ(source->skipped()[2].timestamp, 3);
  EXPECT_TRUE(source->skipped()[0].frame_lost);
  EXPECT_TRUE(source->skipped()[0].late);
  EXPECT_THAT(source->skipped()[0].reason, HasSubstr("faster than tracking"));
}

TEST(LiveSource, ReturnsAllFramesThatAreTakenInTime) {
  const auto source = source_of(2);
  EXPECT_EQ(times_of(*source), (std::vector<double>{1, 2}));
  EXPECT_THAT(source->skipped(), SizeIs(0));
  EXPECT_FALSE(source->size());
}

TEST(LiveSource, EndsWhenItIsTold) {
  LiveSource source(std::make_unique<Script>(0, std::make_shared<std::atomic<bool>>(false)),
                    {.patience = kLong, .stop = [] { return true; }});
  EXPECT_FALSE(source.next());
}

TEST(LiveSource, KeepsTheFramesOfACameraThatStops) {
  const auto source = source_of(2, /*fails=*/true);
  EXPECT_EQ(times_of(*source), (std::vector<double>{1, 2}));
  ASSERT_THAT(source->skipped(), SizeIs(1));
  EXPECT_EQ(source->skipped()[0].reason, "the camera stopped: is unplugged");
}

TEST(LiveSource, HasTheFramesOfTheRange) {
  const auto read = std::make_shared<std::atomic<bool>>(false);
  LiveSource source(std::make_unique<Script>(9, read), {.patience = kLong},
                    {.first = 2, .count = 3, .stride = 2});
  EXPECT_EQ(times_of(source), (std::vector<double>{3, 5}));
  EXPECT_FALSE(*read);  // The camera is not read after the last frame of the range.
}

TEST(LiveSource, NeedsItsLibraryAndCannotBeReadTwice) {
  EXPECT_TRUE(names_live_camera("realsense:"));
  EXPECT_FALSE(names_live_camera("realsense"));
  EXPECT_THAT(error_of([] { recorded_camera("realsense:1"); }),
              HasSubstr("stillmap record realsense:1 FOLDER"));
  SourceOptions options;
  options.camera = "tum_fr1";
  EXPECT_THAT(error_of([&] { make_source("realsense:", options); }),
              HasSubstr("leave --camera out"));
#ifndef STILLMAP_HAS_REALSENSE
  EXPECT_THAT(error_of([] { make_source("realsense:"); }), HasSubstr("built without librealsense"));
#endif
}

}  // namespace
}  // namespace stillmap
