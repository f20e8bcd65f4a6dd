// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/paced_source.hpp"

#include <algorithm>
#include <memory>
#include <vector>

#include <gmock/gmock.h>

namespace stillmap {
namespace {

constexpr std::size_t kFrames = 90;
constexpr double kInterval = 0.1;  // s

/// Frames of 10 Hz from 100 s on, each of which takes a time to be read.
class SlowSource : public FrameSource {
 public:
  SlowSource(double reading, double& clock) : reading_(reading), clock_(clock) {
    camera_.fps = 1 / kInterval;
  }
  const Camera& camera() const override { return camera_; }
  RgbdFramePtr next() override {
    if (index_ == kFrames) return nullptr;
    clock_ += reading_;
    auto frame = std::make_shared<RgbdFrame>();
    frame->timestamp = stamp(index_);
    frame->index = index_++;
    return frame;
  }
  void skip_before(double timestamp) override {
    while (index_ + 1 < kFrames && stamp(index_) < timestamp) ++index_;
  }
  std::optional<std::size_t> size() const override { return std::nullopt; }
  const std::vector<SkippedFrame>& skipped() const override { return none_; }

  static double stamp(std::size_t index) { return 100 + kInterval * static_cast<double>(index); }

 private:
  double reading_;
  double& clock_;
  std::size_t index_ = 0;
  Camera camera_;
  std::vector<SkippedFrame> none_;
};

/// Returns how late each frame was when it was read [s].
std::vector<double> lateness(double reading) {
  double clock = 5;
  TimelySource source(std::make_unique<SlowSource>(reading, clock), 1, [&] { return clock; });
  std::vector<double> late;
  const double start = clock + reading;
  while (const RgbdFramePtr frame = source.next())
    late.push_back(clock - start - (frame->timestamp - SlowSource::stamp(0)));
  return late;
}

TEST(TimelySource, LeavesOutNothingIfReadingIsFastEnough) {
  EXPECT_THAT(lateness(0.9 * kInterval), testing::SizeIs(kFrames));
}

TEST(TimelySource, ASlowReaderReadsFewerFramesAndNoneTooLate) {
  for (const double reading : {1.5 * kInterval, 4 * kInterval}) {
    auto late = lateness(reading);
    EXPECT_GE(late.size(), static_cast<std::size_t>(0.9 * kFrames * kInterval / reading));
    late.pop_back();  // the last frame is never left out
    for (const double seconds : late) EXPECT_LE(seconds, 1.001 * kInterval);
  }
}

TEST(PacedSource, ListsTheFramesThatWereLeftOutBefore) {
  double clock = 0;
  auto slow = std::make_unique<TimelySource>(std::make_unique<SlowSource>(3 * kInterval, clock), 1,
                                             [&] { return clock; });
  PacedSource source(std::move(slow), /*slower=*/1e-6);  // due at once: the test does not wait
  std::vector<double> stamps;
  while (const RgbdFramePtr frame = source.next()) stamps.push_back(frame->timestamp);
  EXPECT_LT(stamps.size(), kFrames);
  stamps.insert(stamps.end(), source.dropped().begin(), source.dropped().end());
  std::sort(stamps.begin(), stamps.end());
  ASSERT_THAT(stamps, testing::SizeIs(kFrames));
  for (std::size_t i = 0; i < kFrames; ++i) EXPECT_NEAR(stamps[i], SlowSource::stamp(i), 1e-6);
}

}  // namespace
}  // namespace stillmap
