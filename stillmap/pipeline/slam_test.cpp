// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/statistics.hpp"
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/pipeline/prefetch.hpp"
#include "stillmap/pipeline/recording_test.hpp"
#include "stillmap/pipeline/slam_system.hpp"

#include <cstring>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

using recorded::Recording, recorded::recording, recorded::small_options, recorded::black,
    recorded::same_bytes, recorded::TrueMasks;

struct Outcome {
  SlamResult result;
  double ate = 0;  // meters
};

Outcome run(const Recording& recording, const SlamParameters& options) {
  std::unique_ptr<Detector> detector;
  if (!options.motion.cues.empty()) detector = std::make_unique<TrueMasks>(recording.sequence);
  SlamSystem slam(recording.sequence->camera(), options, std::move(detector));
  for (const auto& frame : recording.frames) slam.push(frame);
  Outcome outcome{slam.finish()};
  if (outcome.result.tracked() >= 3) {
    outcome.ate =
        absolute_trajectory_error(recording.sequence->trajectory(), outcome.result.trajectory)
            .translation.rmse;
  }
  return outcome;
}

TEST(SlamOnAStillScene, FollowsTheCameraToMillimeters) {
  for (const char* camera : {"xyz", "halfsphere", "rpy"}) {
    const Outcome r = run(recording(0, camera), small_options("static"));
    EXPECT_EQ(r.result.tracked(), 90U) << camera;
    EXPECT_EQ(r.result.maps, 1U) << camera;
    EXPECT_LT(r.ate, 0.008) << camera;
  }
}

TEST(SlamOnAStillScene, FollowsACameraWithAnotherDepthSensor) {
  for (const char* sensor : {"realsense_d435i", "azure_kinect", "ideal"}) {
    const Outcome r = run(recording(0, "xyz", sensor), small_options("static"));
    EXPECT_EQ(r.result.tracked(), 90U) << sensor;
    EXPECT_LT(r.ate, 0.012) << sensor;
  }
}

TEST(SlamOnAStillScene, TheCloudLiesOnTheTrueSurfaces) {
  const Recording& rec = recording(0, "xyz");
  const Outcome r = run(rec, small_options("static"));
  ASSERT_GT(r.result.dense.cloud.size(), 5000U);
  const Pose T_camera_world = r.result.trajectory.front().T_world_camera.inverse();
  std::vector<double> errors = recorded::depth_errors(r.result.dense.cloud, rec, T_camera_world);
  ASSERT_GT(errors.size(), 3000U);
  for (double& error : errors) error = std::abs(error);
  EXPECT_LT(quantile(errors, 0.5), 0.02) << "median distance along the ray [m]";
}

/// Returns the recording with a gripper 0.3 m away in the lower middle quarter of all images.
Recording with_gripper(const Recording& recording, bool ignored) {
  Recording held{recording.sequence, {}};
  const cv::Size size = recording.frames.front()->gray.size();
  const cv::Rect place(size.width / 4, size.height / 2, size.width / 2, size.height / 2);
  cv::Mat texture(place.size(), CV_8UC1);
  cv::RNG(5).fill(texture, cv::RNG::UNIFORM, 0, 256);
  cv::blur(texture, texture, {4, 4});
  cv::normalize(texture, texture, 0, 255, cv::NORM_MINMAX);
  cv::Mat pixels(size, CV_8UC1, cv::Scalar(0));
  pixels(place).setTo(255);
  for (const RgbdFramePtr& frame : recording.frames) {
    auto changed = std::make_shared<RgbdFrame>(*frame);
    changed->gray = frame->gray.clone();
    texture.copyTo(changed->gray(place));
    changed->depth = frame->depth.clone();
    changed->depth(place).setTo(ignored ? 0 : 0.3);
    if (ignored) changed->ignored = pixels;
    held.frames.push_back(std::move(changed));
  }
  return held;
}

TEST(SlamOnAStillScene, AGripperThatIsIgnoredDoesNotMatter) {
  const SlamParameters options = small_options("fused");
  const Recording& rec = recording(0, "xyz");
  const Outcome without = run(rec, options), ignored = run(with_gripper(rec, true), options);
  EXPECT_EQ(ignored.result.tracked(), 90U);
  EXPECT_LT(ignored.ate, without.ate + 0.004) << "with fewer keypoints";
  EXPECT_TRUE(ignored.result.movers.empty());
  const Outcome seen = run(with_gripper(rec, false), options);
  EXPECT_TRUE(seen.ate > 2 * ignored.ate || !seen.result.movers.empty()) << seen.ate;
}

TEST(SlamWithPeople, MasksKeepTheAccuracyOfAnEmptyScene) {
  const Outcome masked = run(recording(3, "xyz"), small_options("seg-mask"));
  EXPECT_EQ(masked.result.tracked(), 90U);
  EXPECT_LT(masked.ate, 0.012);
  const Outcome empty = run(recording(0, "xyz"), small_options("orb-rgbd"));
  EXPECT_LT(masked.ate, empty.ate + 0.004) << "empty " << empty.ate;
  const Outcome unmasked = run(recording(3, "xyz"), small_options("orb-rgbd"));
  EXPECT_GT(unmasked.ate, 2 * masked.ate) << "people disturb a camera that believes everything";
}

TEST(SlamWithPeople, MasksOfEveryThirdFrameSuffice) {
  const Outcome masked = run(recording(3, "xyz"), small_options("fused"));
  EXPECT_EQ(masked.result.tracked(), 90U);
  EXPECT_EQ(masked.result.segmented, 30U);
  EXPECT_LT(masked.ate, 0.012);
}

TEST(SlamWithPeople, TheStaticPresetTracksEveryFrame) {
  const Outcome r = run(recording(3, "xyz"), small_options("static"));
  EXPECT_EQ(r.result.tracked(), 90U);
}

TEST(Lockstep, TwoRunsAreIdenticalToTheLastBit) {
  const SlamParameters options = small_options("seg-mask");
  const Outcome first = run(recording(3, "xyz"), options),
                second = run(recording(3, "xyz"), options);
  EXPECT_TRUE(same_bytes(first.result.trajectory, second.result.trajectory));
  EXPECT_TRUE(same_bytes(first.result.keyframes, second.result.keyframes));
  EXPECT_EQ(first.result.dense.cloud, second.result.dense.cloud);
}

TEST(Lockstep, OneThreadForOpenCvGivesTheSame) {
  const SlamParameters options = small_options("seg-mask");
  const Outcome many = run(recording(3, "xyz"), options);
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const Outcome one = run(recording(3, "xyz"), options);
  cv::setNumThreads(threads);
  EXPECT_TRUE(same_bytes(many.result.trajectory, one.result.trajectory));
  EXPECT_EQ(many.result.dense.cloud, one.result.dense.cloud);
}

TEST(Realtime, TracksEveryFramePushed) {
  SlamParameters options = small_options("seg-mask");
  options.schedule.realtime = true;
  const Outcome r = run(recording(3, "xyz"), options);
  EXPECT_EQ(r.result.tracked(), 90U);
  // Frames are pushed as fast as they are tracked, so the delay of masks and map depends on the
  // machine.
  EXPECT_LT(r.ate, 0.1);
}

TEST(Lost, AMomentOfBlacknessIsBridged) {
  const Recording& rec = recording(0, "xyz");
  SlamSystem slam(rec.sequence->camera(), small_options("static"));
  for (std::size_t i = 0; i < 60; ++i) {
    auto frame = std::make_shared<RgbdFrame>(*rec.frames[i]);
    if (i >= 30 && i < 33) frame->gray = black(frame->gray);
    slam.push(frame);
  }
  const SlamResult result = slam.finish();
  EXPECT_EQ(result.maps, 1U);
  EXPECT_EQ(result.tracked(), 57U);
}

/// Detector that reports one person over the whole image from frame 10 on.
class AllOnePerson final : public Detector {
 public:
  std::vector<Instance> detect(const RgbdFrame& frame) override {
    if (frame.index < 10) return {};
    return {recorded::person_everywhere(frame)};
  }
  std::string description() const override { return "one person"; }
  const std::vector<std::string>& class_names() const override { return names_; }

 private:
  std::vector<std::string> names_ = {"person"};
};

TEST(Lost, NoPoseIsEstimatedIfEverythingSeemsToMove) {
  const Recording& rec = recording(0, "xyz");
  SlamParameters options = small_options("seg-mask");
  options.schedule.segment_every = 1;
  options.schedule.mask_delay = 0;
  SlamSystem slam(rec.sequence->camera(), options, std::make_unique<AllOnePerson>());
  for (std::size_t i = 0; i < 30; ++i) {
    const auto pose = slam.push(rec.frames[i]);
    EXPECT_EQ(pose.has_value(), i < 10) << i;
  }
  const SlamResult result = slam.finish();
  EXPECT_EQ(result.frames[20].state, TrackState::kLost);
  EXPECT_NE(result.frames[20].reason.find("everything seems to move"), std::string::npos)
      << result.frames[20].reason;
}

TEST(Lost, WithoutDepthThereIsNoMapAndTheReasonIsReported) {
  const Recording& rec = recording(0, "xyz");
  SlamSystem slam(rec.sequence->camera(), small_options("static"));
  for (std::size_t i = 0; i < 5; ++i) {
    auto frame = std::make_shared<RgbdFrame>(*rec.frames[i]);
    frame->depth = black(frame->depth);
    EXPECT_FALSE(slam.push(frame).has_value());
  }
  const SlamResult result = slam.finish();
  EXPECT_EQ(result.maps, 0U);
  EXPECT_TRUE(result.dense.cloud.empty());
  EXPECT_NE(result.frames[0].reason.find("keypoints with depth"), std::string::npos);
}

TEST(SlamInput, AFrameOfAnotherSizeOrOutOfOrderIsAnError) {
  const Recording& rec = recording(0, "xyz");
  SlamSystem slam(rec.sequence->camera(), small_options("static"));
  slam.push(rec.frames[1]);
  EXPECT_THROW(slam.push(rec.frames[0]), Error) << "earlier than the one before";
  auto small = std::make_shared<RgbdFrame>(*rec.frames[2]);
  cv::resize(small->gray, small->gray, {160, 120});
  EXPECT_THROW(slam.push(small), Error);
  EXPECT_TRUE(slam.push(rec.frames[2]).has_value()) << "an error costs no more than the frame";
}

TEST(Prefetch, HandsOutTheSameFramesAsTheSourceItself) {
  const Recording& rec = recording(0, "xyz");
  Prefetch source(std::make_unique<SimulatedSequence>(rec.sequence->options()), 3);
  std::size_t count = 0;
  while (const auto frame = source.next()) {
    const cv::Mat& expected = rec.frames[count]->gray;
    ASSERT_EQ(frame->index, count);
    EXPECT_EQ(std::memcmp(frame->gray.data, expected.data, expected.total()), 0);
    ++count;
  }
  EXPECT_EQ(count, rec.frames.size());
  EXPECT_EQ(source.next(), nullptr);
  EXPECT_TRUE(source.skipped().empty());
}

}  // namespace
}  // namespace stillmap
