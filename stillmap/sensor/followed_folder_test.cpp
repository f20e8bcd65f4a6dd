// SPDX-License-Identifier: Apache-2.0
// Folders into which images are written while they are read. The hook that ends the wait writes the
// images, so no test depends on time.
#include "stillmap/sensor/followed_folder.hpp"

#include "stillmap/sensor/test_sequence.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using test::error_of;
using ::testing::HasSubstr;
using ::testing::SizeIs;

namespace fs = std::filesystem;

constexpr double kForever = 1e6;  // seconds

// A complete sequence, and a copy that grows by one step whenever the source waits.
class GrowingSequence {
 public:
  explicit GrowingSequence(int frames) : complete_(frames), frames_(frames), growing_(0) {
    fs::remove(growing_.path("rgb.txt"));
    fs::remove(growing_.path("depth.txt"));
  }
  // Steps of a frame: color image, depth image, first part of a list's line, the rest of it.
  bool grow() {
    const int frame = step_ / 4, part = step_ % 4;
    if (frame >= frames_) return false;
    ++step_;
    if (part == 0) return copy_half(TestSequence::color_name(frame));
    if (part == 1) {
      append("rgb.txt", fmt::format("{:.6f} {}\n", TestSequence::stamp(frame),
                                    TestSequence::color_name(frame)));
      return copy(TestSequence::color_name(frame));
    }
    const std::string line = fmt::format("{:.6f} {}\n", TestSequence::stamp(frame) + 0.005,
                                         TestSequence::depth_name(frame));
    if (part == 2) {
      append("depth.txt", line.substr(0, 7));
      return copy_half(TestSequence::depth_name(frame));
    }
    append("depth.txt", line.substr(7));
    return copy(TestSequence::depth_name(frame));
  }
  SourceOptions options() {
    SourceOptions options;
    options.recorded = TestSequence::camera();
    options.following = Following{.patience = kForever, .stop = [this] { return !grow(); }};
    return options;
  }
  std::string folder() const { return growing_.folder().string(); }
  const TestSequence& complete() const { return complete_; }
  const TestSequence& growing() const { return growing_; }

 private:
  bool copy(const std::string& name) const {
    return fs::copy_file(complete_.path(name), growing_.path(name),
                         fs::copy_options::overwrite_existing);
  }
  bool copy_half(const std::string& name) const {
    copy(name);
    growing_.truncate(name, 0.5);
    return true;
  }
  void append(const std::string& name, const std::string& text) const {
    std::ofstream(growing_.path(name), std::ios::app) << text;
  }

  TestSequence complete_;
  int frames_;
  TestSequence growing_;
  int step_ = 0;
};

TEST(FollowedFolder, GivesTheFramesOfTheCompleteFolder) {
  GrowingSequence sequence(6);
  const auto source = make_source(sequence.folder(), sequence.options());
  const auto followed = all_frames(*source);
  TumFolder complete = sequence.complete().open();
  const auto expected = all_frames(complete);
  ASSERT_THAT(followed, SizeIs(6));
  for (std::size_t i = 0; i < followed.size(); ++i) {
    EXPECT_EQ(followed[i]->index, i);
    EXPECT_EQ(followed[i]->timestamp, expected[i]->timestamp);
    EXPECT_EQ(followed[i]->depth_delay, expected[i]->depth_delay);
    EXPECT_EQ(cv::norm(followed[i]->depth, expected[i]->depth, cv::NORM_INF), 0);
  }
  EXPECT_THAT(source->skipped(), SizeIs(0));
  EXPECT_FALSE(source->next());
}

TEST(FollowedFolder, ADamagedImageIsSkippedWhenLaterOnesAreComplete) {
  GrowingSequence sequence(5);
  sequence.complete().truncate(TestSequence::color_name(2), 0.5);
  const auto source = make_source(sequence.folder(), sequence.options());
  EXPECT_THAT(all_frames(*source), SizeIs(4));
  ASSERT_THAT(source->skipped(), SizeIs(1));
  EXPECT_THAT(source->skipped()[0].reason, HasSubstr("rgb/2.png"));
}

TEST(FollowedFolder, ARangeOfFramesEndsWithoutWaiting) {
  GrowingSequence sequence(5);
  while (sequence.grow()) continue;
  SourceOptions options = sequence.options();
  options.first = 1;
  options.count = 2;
  bool waited = false;
  options.following->stop = [&] { return waited = true; };
  const auto frames = all_frames(*make_source(sequence.folder(), options));
  ASSERT_THAT(frames, SizeIs(2));
  EXPECT_NEAR(frames[0]->timestamp, TestSequence::stamp(1), 1e-6);
  EXPECT_FALSE(waited);
}

TEST(FollowedFolder, EveryNthFrameIsThatOfTheCompleteFolder) {
  GrowingSequence sequence(7);
  SourceOptions options = sequence.options();
  options.stride = 3;
  const auto frames = all_frames(*make_source(sequence.folder(), options));
  ASSERT_THAT(frames, SizeIs(3));
  EXPECT_DOUBLE_EQ(frames[2]->timestamp, TestSequence::stamp(6));
}

TEST(FollowedFolder, WithoutImagesTheProblemOfTheFolderIsTold) {
  const TestSequence sequence(0);
  SourceOptions options;
  options.recorded = TestSequence::camera();
  options.following = Following{.patience = kForever, .stop = [] { return true; }};
  EXPECT_THAT(error_of([&] { make_source(sequence.folder().string(), options); }),
              HasSubstr("contains no image"));
}

TEST(FollowedFolder, RecordedFilesAreRefused) {
  const TestSequence sequence(1);
  sequence.write("recorded.bag", "#ROSBAG V2.0\n");
  SourceOptions options;
  options.following = Following{};
  EXPECT_THAT(error_of([&] { make_source(sequence.path("recorded.bag").string(), options); }),
              HasSubstr("cannot be followed"));
}

}  // namespace
}  // namespace stillmap
