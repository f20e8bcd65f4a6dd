// SPDX-License-Identifier: Apache-2.0
// The public face of the library, on rendered frames.
#include "stillmap/base/test_error.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/geometry/depth_sensor.hpp"
#include "stillmap/pipeline/recording_test.hpp"
#include "stillmap/pipeline/recovered_run.hpp"
#include "stillmap/pipeline/saved_map.hpp"
#include "stillmap/sensor/image_file.hpp"
#include "stillmap/sensor/rectifier.hpp"
#include "stillmap/slam.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <limits>
#include <set>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

using recorded::Recording, recorded::recording, recorded::same_bytes, recorded::TrueMasks;
using test::error_of;
using testing::AllOf;
using testing::HasSubstr;

Options small_options() {
  Options options;
  options.features.keypoints = 600;
  return options;
}

Slam slam_for(const Recording& rec) {
  return Slam(rec.sequence->camera(), small_options(), std::make_unique<TrueMasks>(rec.sequence));
}

/// Returns the largest distance between poses of one frame [m]; infinity for other frames.
double largest_distance(const Trajectory& a, const Trajectory& b) {
  if (a.size() != b.size()) return std::numeric_limits<double>::infinity();
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    largest = std::max(
        largest, (a[i].T_world_camera.translation() - b[i].T_world_camera.translation()).norm());
  return largest;
}

cv::Mat raw_depth(const cv::Mat& meters, double depth_factor) {
  cv::Mat raw;
  meters.convertTo(raw, CV_16UC1, depth_factor);
  return raw;
}

TEST(SlamApi, ResultsAreThoseOfTheRun) {
  const Recording& rec = recording(2, "xyz");
  Slam slam = slam_for(rec);
  for (const RgbdFramePtr& frame : rec.frames) slam.push(frame);
  const Results results = slam.finish();
  EXPECT_EQ(results.statistics.frames, rec.frames.size());
  EXPECT_EQ(results.statistics.tracked, results.trajectory.size());
  EXPECT_GT(results.statistics.tracked, rec.frames.size() * 9 / 10);
  EXPECT_EQ(results.statistics.maps, 1U);
  EXPECT_GT(results.statistics.landmarks, 100U);
  EXPECT_GT(results.keyframes.size(), 1U);
  EXPECT_GT(results.cloud->size(), 1000U);
  const auto is_person = [](const MovingObjectTrack& mover) {
    return mover.class_name == "person" && !mover.samples.empty();
  };
  EXPECT_TRUE(std::any_of(results.movers.begin(), results.movers.end(), is_person));
}

/// A room with people that a camera with an IMU sees.
const SimulatedSequence& with_imu() {
  static const SimulatedSequence made([] {
    SimulationOptions options;
    options.width = 320;
    options.height = 240;
    options.people = 2;
    options.frames = 15;
    options.camera = "rpy";
    options.imu = "d435i";
    return options;
  }());
  return made;
}

TEST(SlamApi, PushedSamplesOfTheImuActAsThoseOfTheFrames) {
  const auto trajectory = [](bool in_frames, bool pushed) {
    SimulatedSequence sequence = with_imu();
    Slam slam(sequence.camera(), small_options());
    double last = -1;
    while (const RgbdFramePtr frame = sequence.next()) {
      std::vector<ImuSample> samples = frame->imu;
      std::reverse(samples.begin(), samples.end());
      for (const ImuSample& sample : samples)
        if (pushed && sample.timestamp > last) slam.push_imu(sample);
      last = samples.front().timestamp;
      auto copy = std::make_shared<RgbdFrame>(*frame);
      if (!in_frames) copy->imu.clear();
      slam.push(copy);
    }
    return slam.finish().trajectory;
  };
  const Trajectory of_frames = trajectory(true, false);
  EXPECT_TRUE(same_bytes(trajectory(false, true), of_frames));
  EXPECT_FALSE(same_bytes(trajectory(false, false), of_frames)) << "they have no effect";
}

/// Each frame is pushed before the samples of the 20 ms before it.
TEST(SlamApi, SamplesAfterTheirFramesAreFound) {
  const auto findings = [](double delay) {
    SimulatedSequence sequence = with_imu();
    Slam slam(sequence.camera(), small_options());
    double pushed = -1;
    while (const RgbdFramePtr frame = sequence.next()) {
      for (const ImuSample& sample : frame->imu) {
        if (sample.timestamp <= pushed || sample.timestamp > frame->timestamp - delay) continue;
        slam.push_imu(sample);
        pushed = sample.timestamp;
      }
      auto copy = std::make_shared<RgbdFrame>(*frame);
      copy->imu.clear();
      slam.push(copy);
    }
    return slam.findings();
  };
  EXPECT_THAT(findings(0),
              testing::Not(testing::Contains(testing::Field(&Finding::code, "late-samples"))));
  const std::vector<Finding> late = findings(0.02);
  const auto found = std::ranges::find(late, "late-samples", &Finding::code);
  ASSERT_NE(found, late.end());
  EXPECT_GT(found->evidence.at("longest_s"), 0.015);
  EXPECT_LT(found->evidence.at("longest_s"), 0.021);
}

TEST(SlamApi, APushedOdometryGivesThePoseInTheDark) {
  const Recording& rec = recording(0, "xyz");
  Camera camera = rec.sequence->camera();
  camera.wheels = Wheels();
  Slam slam(camera, small_options());
  for (const RgbdFramePtr& frame : rec.frames) {
    if (frame->index == 30) break;
    const bool dark = frame->index >= 20;
    auto pushed = std::make_shared<RgbdFrame>(*frame);
    if (dark) pushed->gray = recorded::black(frame->gray);
    slam.push_odometry({frame->timestamp, rec.sequence->motion(frame->timestamp)});
    const PoseUpdate update = slam.push(pushed);
    EXPECT_EQ(update.state, dark ? PoseState::kPredicted : PoseState::kTracked) << frame->index;
    EXPECT_EQ(update.certain, !dark) << frame->index;
    EXPECT_EQ(update.reason.empty(), !dark) << frame->index;
    ASSERT_TRUE(update.T_world_camera) << frame->index;
    const Pose truth =
        rec.sequence->T_world_camera(0).inverse() * rec.sequence->T_world_camera(frame->index);
    EXPECT_LT((truth.inverse() * *update.T_world_camera).translation().norm(), 0.02);
    EXPECT_TRUE(!dark || update.covariance.trace() > 0) << frame->index;
  }
}

TEST(SlamApi, SamplesThatCannotBeUsedAreAnError) {
  Slam without = slam_for(recording(0, "xyz"));
  EXPECT_THAT(error_of([&] { without.push_imu({.timestamp = 1}); }),
              AllOf(HasSubstr("has no IMU"), HasSubstr("T_camera_imu")));
  Slam with(with_imu().camera(), small_options());
  EXPECT_THAT(error_of([&] {
                with.push_imu({.timestamp = 1, .angular_velocity = {0, std::nan(""), 0}});
              }),
              HasSubstr("is not finite"));
  EXPECT_THAT(error_of([&] { without.push_odometry({}); }),
              AllOf(HasSubstr("is on no wheels"), HasSubstr("T_camera_base")));
}

TEST(SlamApi, ASnapshotAfterTheEndShowsTheResults) {
  const Recording& rec = recording(0, "xyz");
  Slam slam = slam_for(rec);
  for (const RgbdFramePtr& frame : rec.frames) slam.push(frame);
  const Results results = slam.finish();
  const auto snapshot = slam.snapshot();
  EXPECT_TRUE(same_bytes(snapshot->trajectory, results.trajectory));
  EXPECT_EQ(snapshot->keyframes.size(), results.keyframes.size());
  EXPECT_EQ(snapshot->landmarks.size(), results.statistics.landmarks);
  EXPECT_EQ(snapshot->cloud, results.cloud) << "the very same, not a copy";
}

TEST(SlamApi, ASnapshotBeforeTheFirstFrameIsEmpty) {
  const Slam slam(recording(0, "xyz").sequence->camera(), small_options());
  const auto snapshot = slam.snapshot();
  EXPECT_TRUE(snapshot->trajectory.empty());
  EXPECT_TRUE(snapshot->keyframes.empty());
  ASSERT_NE(snapshot->cloud, nullptr);
  EXPECT_TRUE(snapshot->cloud->empty());
}

TEST(SlamApi, SnapshotsFromAnotherThreadAreConsistentAndChangeNothing) {
  const Recording& rec = recording(2, "xyz");
  Slam undisturbed = slam_for(rec);
  for (const RgbdFramePtr& frame : rec.frames) undisturbed.push(frame);
  const Results expected = undisturbed.finish();

  Slam slam = slam_for(rec);
  std::atomic<bool> done = false;
  std::vector<std::shared_ptr<const Snapshot>> taken;
  std::thread watcher([&] {
    while (!done) taken.push_back(slam.snapshot());
  });
  for (const RgbdFramePtr& frame : rec.frames) slam.push(frame);
  const Results results = slam.finish();
  done = true;
  watcher.join();
  EXPECT_TRUE(same_bytes(results.trajectory, expected.trajectory));
  EXPECT_EQ(*results.cloud, *expected.cloud);
  ASSERT_FALSE(taken.empty());
  std::size_t frames = 0;
  for (const auto& snapshot : taken) {
    EXPECT_GE(snapshot->trajectory.size(), frames) << "time runs backwards";
    frames = snapshot->trajectory.size();
    EXPECT_LE(snapshot->keyframes.size(), std::max<std::size_t>(frames, 1));
    for (const LandmarkPoint& landmark : snapshot->landmarks) {
      ASSERT_TRUE(landmark.p_world.allFinite());
      ASSERT_GE(landmark.static_probability, 0);
      ASSERT_LE(landmark.static_probability, 1);
      ASSERT_GE(landmark.observations, 1);
    }
    ASSERT_EQ(snapshot->cloud->points.size(), snapshot->cloud->colors.size());
  }
}

TEST(SlamApi, ASnapshotStaysAsItIsWhileTheMapGoesOn) {
  const Recording& rec = recording(0, "xyz");
  Slam slam = slam_for(rec);
  const std::size_t half = rec.frames.size() / 2;
  for (std::size_t i = 0; i < half; ++i) slam.push(rec.frames[i]);
  const auto snapshot = slam.snapshot();
  const Trajectory trajectory(snapshot->trajectory.begin(), snapshot->trajectory.end());
  const std::size_t landmarks = snapshot->landmarks.size();
  const Cloud cloud = *snapshot->cloud;
  EXPECT_EQ(snapshot->newest.frame_index, half - 1);
  EXPECT_EQ(snapshot->trajectory.size(), half);
  EXPECT_GT(cloud.size(), 100U) << "the live cloud";
  for (std::size_t i = half; i < rec.frames.size(); ++i) slam.push(rec.frames[i]);
  slam.finish();
  EXPECT_TRUE(same_bytes(snapshot->trajectory, trajectory));
  EXPECT_EQ(snapshot->landmarks.size(), landmarks);
  EXPECT_EQ(*snapshot->cloud, cloud);
}

TEST(SlamApi, TheLiveCloudLiesOnTheTrueSurfaces) {
  const Recording& rec = recording(0, "xyz");
  Slam slam = slam_for(rec);
  for (const RgbdFramePtr& frame : rec.frames) slam.push(frame);
  const auto snapshot = slam.snapshot();
  const Pose T_camera_world = snapshot->trajectory.front().T_world_camera.inverse();
  const std::vector<double> errors = recorded::depth_errors(*snapshot->cloud, rec, T_camera_world);
  ASSERT_GT(errors.size(), 1000U);
  const auto in_free_space = [](double error) { return error <= -0.05; };
  const auto wrong = std::count_if(errors.begin(), errors.end(), in_free_space);
  EXPECT_LT(static_cast<std::size_t>(wrong), errors.size() * 5 / 100);
}

TEST(SlamApi, SubscribersHearOfPosesKeyframesAndMovers) {
  const Recording& rec = recording(2, "xyz");
  Slam slam = slam_for(rec);
  std::vector<PoseUpdate> poses;
  std::vector<KeyframePose> keyframes;
  std::size_t movers = 0, corrections = 0;
  const Subscription on_pose = slam.on_pose([&](const PoseUpdate& p) { poses.push_back(p); });
  const Subscription on_keyframe =
      slam.on_keyframe([&](const KeyframePose& k) { keyframes.push_back(k); });
  const Subscription on_movers = slam.on_movers(
      [&](const std::vector<MovingObject>& m) { movers = std::max(movers, m.size()); });
  const Subscription on_map = slam.on_map_changed([&](const MapCorrection&) { ++corrections; });
  for (const RgbdFramePtr& frame : rec.frames) {
    const PoseUpdate update = slam.push(frame);
    ASSERT_FALSE(poses.empty());
    EXPECT_EQ(poses.back().frame_index, frame->index);
    EXPECT_EQ(update.frame_index, frame->index);
    EXPECT_EQ(poses.back().T_world_camera.has_value(), update.T_world_camera.has_value());
  }
  const Results results = slam.finish();
  EXPECT_EQ(poses.size(), rec.frames.size());
  EXPECT_GE(keyframes.size(), results.keyframes.size()) << "some are culled later";
  EXPECT_GE(movers, 1U);
  EXPECT_GE(corrections, 1U) << "the adjustment at the end";
}

TEST(SlamApi, TheNewestFrameHasMotionLabelsAndObjects) {
  const Recording& rec = recording(2, "xyz");
  Slam slam = slam_for(rec);
  EXPECT_FALSE(slam.newest().has_value());
  int on_people = 0, found = 0, on_static = 0, wrong = 0, matched = 0;
  for (const RgbdFramePtr& frame : rec.frames) {
    const PoseUpdate update = slam.push(frame);
    const ObservedFrame newest = slam.newest().value();
    ASSERT_EQ(newest.update.frame_index, frame->index);
    ASSERT_EQ(newest.update.T_world_camera.has_value(), update.T_world_camera.has_value());
    ASSERT_EQ(newest.images->color.size(), frame->color.size());
    const cv::Mat1b truth = class_mask(rec.sequence->truth(frame->index));
    if (newest.objects) {
      for (const Instance& object : newest.objects->instances)
        EXPECT_EQ(object.class_name, "person");
    }
    for (const ObservedKeypoint& k : newest.keypoints) {
      const cv::Point pixel(static_cast<int>(k.u + 0.5F), static_cast<int>(k.v + 0.5F));
      (truth(pixel) != 0 ? on_people : on_static) += 1;
      (truth(pixel) != 0 ? found : wrong) += k.moving ? 1 : 0;
      if (k.moving) {
        EXPECT_LT(k.static_probability, 0.5F);
      }
      matched += k.matched ? 1 : 0;
    }
  }
  ASSERT_GT(on_people, 100);
  EXPECT_GT(found, 0.9 * on_people);
  EXPECT_LT(wrong, 0.1 * on_static);
  EXPECT_GT(matched, 0.3 * on_static);
}

TEST(SlamApi, APushTellsWhyThereIsNoPose) {
  const Recording& rec = recording(0, "xyz");
  Options options = small_options();
  options.input.stride = 2;
  Slam slam(rec.sequence->camera(), options);
  const RgbdFramePtr& first = rec.frames[0];
  const cv::Mat1f no_depth = cv::Mat1f::zeros(first->depth.size());
  EXPECT_EQ(slam.push(first->color, no_depth, 0).state, PoseState::kNoMap);
  const PoseUpdate skipped = slam.push(first->color, first->depth, 0.1);
  EXPECT_EQ(skipped.state, PoseState::kSkipped);
  EXPECT_EQ(skipped.frame_index, 1U);
  EXPECT_EQ(slam.push(first->color, first->depth, 0.2).state, PoseState::kTracked);
  slam.push(first->color, first->depth, 0.3);
  const cv::Mat dark = cv::Mat::zeros(first->color.size(), CV_8UC3);
  const PoseUpdate lost = slam.push(dark, no_depth, 0.4);
  EXPECT_EQ(lost.state, PoseState::kLost);
  EXPECT_FALSE(lost.reason.empty());
}

TEST(SlamApi, ASubscriptionEndsWithItsHandle) {
  const Recording& rec = recording(0, "xyz");
  Slam slam = slam_for(rec);
  int first = 0, second = 0;
  Subscription a = slam.on_pose([&](const PoseUpdate&) { ++first; });
  const Subscription b = slam.on_pose([&](const PoseUpdate&) { ++second; });
  slam.push(rec.frames[0]);
  a.reset();
  slam.push(rec.frames[1]);
  EXPECT_EQ(first, 1);
  EXPECT_EQ(second, 2);
}

TEST(SlamApi, FramesOfOpenCvImagesAreTrackedAsThoseOfASource) {
  const Recording& rec = recording(0, "xyz");
  const Camera& camera = rec.sequence->camera();
  Slam whole(camera, small_options());
  Slam raw(camera, small_options()), meters(camera, small_options());
  for (const RgbdFramePtr& frame : rec.frames) {
    whole.push(frame);
    raw.push(frame->color, raw_depth(frame->depth, camera.depth_factor), frame->timestamp);
    meters.push(frame->color, frame->depth, frame->timestamp);
  }
  const Results expected = whole.finish();
  // 16-bit depth is rounded to 0.2 mm.
  EXPECT_LT(largest_distance(raw.finish().trajectory, expected.trajectory), 0.005);
  EXPECT_TRUE(same_bytes(meters.finish().trajectory, expected.trajectory));
}

TEST(SlamApi, GrayImagesAreEnough) {
  const Recording& rec = recording(0, "xyz");
  Slam slam(rec.sequence->camera(), small_options());
  for (const RgbdFramePtr& frame : rec.frames)
    slam.push(frame->gray, frame->depth, frame->timestamp);
  EXPECT_EQ(slam.finish().statistics.tracked, rec.frames.size());
}

/// What a camera with this distortion would record is not known, but rectifying it is a fixed
/// function of the pixels: the trajectory must be that of images rectified beforehand.
TEST(SlamApi, ADistortedCameraIsRectified) {
  const Recording& rec = recording(0, "xyz");
  Camera distorted = rec.sequence->camera();
  distorted.distortion << 0.1, -0.05, 0.001, 0, 0;
  const Rectifier rectifier(distorted);
  Slam whole(distorted, small_options()), rectified(rectifier.camera(), small_options());
  Slam ignored(rectifier.camera(), small_options());
  for (const RgbdFramePtr& frame : rec.frames) {
    whole.push(frame->color, frame->depth, frame->timestamp);
    rectified.push(rectifier.image(frame->color), rectifier.nearest(frame->depth),
                   frame->timestamp);
    ignored.push(frame->color, frame->depth, frame->timestamp);
  }
  const Trajectory trajectory = whole.finish().trajectory;
  EXPECT_TRUE(same_bytes(trajectory, rectified.finish().trajectory));
  EXPECT_FALSE(same_bytes(trajectory, ignored.finish().trajectory));
}

TEST(SlamApi, FramesGetRisingIndices) {
  const Recording& rec = recording(0, "xyz");
  Slam slam = slam_for(rec);
  const RgbdFrame& f = *rec.frames[0];
  const RgbdFramePtr a = slam.make_frame(f.color, f.depth, 1),
                     b = slam.make_frame(f.color, f.depth, 2);
  EXPECT_EQ(a->index, 0U);
  EXPECT_EQ(b->index, 1U);
  slam.push(b);
  EXPECT_THAT(error_of([&] { slam.push(a); }), HasSubstr("does not come after frame 1"));
}

TEST(SlamApi, AWrongFrameIsAnErrorThatNamesIt) {
  const Recording& rec = recording(0, "xyz");
  Slam slam = slam_for(rec);
  const RgbdFrame& f = *rec.frames[0];
  const cv::Mat small = f.color(cv::Rect(0, 0, 100, 80));
  EXPECT_THAT(error_of([&] { slam.push(nullptr); }), HasSubstr("frame is null"));
  EXPECT_THAT(error_of([&] { slam.push(cv::Mat(), f.depth, 1); }),
              HasSubstr("color image is empty"));
  EXPECT_THAT(error_of([&] { slam.push(f.color, cv::Mat(), 1); }),
              HasSubstr("depth image is empty"));
  EXPECT_THAT(error_of([&] { slam.push(small, f.depth, 1); }),
              HasSubstr("color image has 100 x 80 pixels"));
  EXPECT_THAT(error_of([&] { slam.push(f.depth, f.depth, 1); }), HasSubstr("CV_32FC1"));
  EXPECT_THAT(error_of([&] { slam.push(f.color, f.gray, 1); }), HasSubstr("CV_8UC1"));
  EXPECT_THAT(
      error_of([&] { slam.push(f.color, f.depth, std::numeric_limits<double>::quiet_NaN()); }),
      HasSubstr("timestamp is not finite"));
  auto half = std::make_shared<RgbdFrame>(f);
  half->depth = cv::Mat();
  EXPECT_THAT(error_of([&] { slam.push(half); }), HasSubstr("depth image is empty"));
  auto cropped = std::make_shared<RgbdFrame>(f);
  cropped->gray = f.gray(cv::Rect(0, 0, 100, 80));
  EXPECT_THAT(error_of([&] { slam.push(cropped); }), HasSubstr("gray image has 100 x 80 pixels"));
  slam.push(f.color, f.depth, 1);
  EXPECT_THAT(error_of([&] { slam.push(f.color, f.depth, 1); }), HasSubstr("does not come after"));
  EXPECT_EQ(slam.finish().statistics.frames, 1U) << "wrong frames leave nothing behind";
}

TEST(SlamApi, DepthInMillimetersIsAnErrorThatNamesMeters) {
  const Recording& rec = recording(0, "xyz");
  const RgbdFrame& f = *rec.frames[0];
  Slam slam = slam_for(rec);
  const cv::Mat millimeters = f.depth * 1000;
  EXPECT_THAT(error_of([&] { slam.make_frame(f.color, millimeters, 1); }),
              AllOf(HasSubstr("depth in meters is expected"), HasSubstr("divide millimeters")));
  Camera camera = rec.sequence->camera();
  camera.depth_factor = 1;
  Slam wrong_unit(camera, small_options());
  EXPECT_THAT(error_of([&] { wrong_unit.make_frame(f.color, raw_depth(f.depth, 1000), 1); }),
              HasSubstr("camera.depth_factor is 1: set it to the raw units per meter"));
  const cv::Mat unknown = cv::Mat::zeros(f.depth.size(), CV_32FC1);
  EXPECT_NO_THROW(slam.make_frame(f.color, unknown, 2)) << "a frame without any depth is possible";
}

TEST(SlamApi, IgnoredPixelsOfACameraAreLeftOut) {
  const Recording& rec = recording(0, "xyz");
  const auto file = test::own_path("ignored.png");
  cv::Mat lower(240, 320, CV_8UC1, cv::Scalar(0));
  lower.rowRange(160, 240).setTo(255);
  write_png(file, lower);
  Camera camera = rec.sequence->camera();
  camera.ignore = file.string();
  Slam slam(camera, small_options());
  std::filesystem::remove(file);
  const RgbdFrame& f = *rec.frames[0];
  EXPECT_THAT(error_of([&] { slam.push(rec.frames[0]); }), HasSubstr("has ignored pixels"));
  const auto frame = slam.make_frame(f.color, f.depth, f.timestamp);
  EXPECT_EQ(cv::countNonZero(frame->depth.rowRange(160, 240)), 0);
  EXPECT_GT(cv::countNonZero(f.depth.rowRange(160, 240)), 10000);
  slam.push(frame);
  for (const Eigen::Vector3f& p : slam.finish().cloud->points)  // in the first camera's frame
    EXPECT_LT(camera.project(p.cast<double>()).y(), 162);
}

TEST(SlamApi, AFrameThatIsNotRectifiedIsAnError) {
  const Recording& rec = recording(0, "xyz");
  Camera distorted = rec.sequence->camera();
  distorted.distortion << 0.1, -0.05, 0.001, 0, 0;
  Slam slam(distorted, small_options());
  const RgbdFrame& f = *rec.frames[0];
  EXPECT_THAT(error_of([&] { slam.push(rec.frames[0]); }),
              AllOf(HasSubstr("is distorted"), HasSubstr("make_frame()")));
  EXPECT_NO_THROW(slam.push(slam.make_frame(f.color, f.depth, f.timestamp)));
}

TEST(SlamApi, AnEmptyFunctionCannotSubscribe) {
  Slam slam = slam_for(recording(0, "xyz"));
  const auto expected = [](const char* name) { return HasSubstr(std::string("Slam::") + name); };
  EXPECT_THAT(error_of([&] { auto s = slam.on_pose(nullptr); }), expected("on_pose"));
  EXPECT_THAT(error_of([&] { auto s = slam.on_keyframe(nullptr); }), expected("on_keyframe"));
  EXPECT_THAT(error_of([&] { auto s = slam.on_map_changed(nullptr); }), expected("on_map_changed"));
  EXPECT_THAT(error_of([&] { auto s = slam.on_movers(nullptr); }), expected("on_movers"));
}

/// Frames 2, 4 and 6 of eight, as TumFolder selects them.
TEST(SlamApi, TheInputOptionsSelectAndHalveTheFrames) {
  const Recording& rec = recording(0, "xyz");
  Options options = small_options();
  options.input = {.first = 2, .count = 6, .stride = 2, .half_size = true};
  Slam slam(rec.sequence->camera(), options);
  std::vector<std::size_t> used;
  const Subscription on_pose =
      slam.on_pose([&](const PoseUpdate& p) { used.push_back(p.frame_index); });
  for (std::size_t i = 0; i < 10; ++i) slam.push(rec.frames[i]);
  EXPECT_EQ(used, (std::vector<std::size_t>{2, 4, 6}));
  const Results results = slam.finish();
  EXPECT_EQ(results.statistics.frames, 3U);
  EXPECT_EQ(results.statistics.tracked, 3U) << "with the intrinsics of the halved images";
}

TEST(SlamApi, AJournalHoldsTheRunAndIsAStartForAnother) {
  const Recording& rec = recording(2, "xyz");
  const std::filesystem::path file = test::own_path("api.journal");
  std::size_t keyframes = 0;
  {
    Slam slam = slam_for(rec);
    slam.keep_journal(file);
    EXPECT_THAT(error_of([&] { slam.keep_journal("another.journal"); }), HasSubstr("call it once"));
    for (const RgbdFramePtr& frame : rec.frames) slam.push(frame);
    keyframes = slam.finish().keyframes.size();
  }
  EXPECT_EQ(recovered_run(file).frames.size(), rec.frames.size());
  EXPECT_GE(recovered_run(file).map.map.keyframes.size(), keyframes);
  Slam again(rec.sequence->camera(), small_options(), std::make_unique<TrueMasks>(rec.sequence),
             StartMap{.file = file, .extend = false});
  for (const RgbdFramePtr& frame : rec.frames) again.push(frame);
  EXPECT_TRUE(again.snapshot()->newest.T_world_camera.has_value());
  EXPECT_THAT(error_of([&] { again.keep_journal(file); }), HasSubstr("the journal of another run"));
  std::filesystem::remove(file);
}

/// Maps a recording. Returns the file of the map.
std::filesystem::path saved_map_of(const Recording& rec) {
  std::filesystem::path file = test::own_path("api.map");
  Slam slam = slam_for(rec);
  for (const RgbdFramePtr& frame : rec.frames) slam.push(frame);
  slam.save_map(file);
  return file;
}

TEST(SlamApi, AMapIsLoadedWhileTheSystemRuns) {
  const Recording& rec = recording(0, "xyz");
  const std::filesystem::path file = saved_map_of(rec);
  // The second run begins later, so that its world is another one until the maps are merged.
  Slam second = slam_for(rec);
  std::size_t corrections = 0;
  const Subscription on_map_changed =
      second.on_map_changed([&](const MapCorrection&) { ++corrections; });
  for (std::size_t i = 30; i < 60; ++i) EXPECT_FALSE(second.push(rec.frames[i]).in_saved_map);
  EXPECT_EQ(second.load_map(file), "");
  bool in_saved_map = false;
  for (std::size_t i = 60; i < rec.frames.size(); ++i) {
    const PoseUpdate update = second.push(rec.frames[i]);
    EXPECT_GE(update.in_saved_map, in_saved_map) << "it stays in it";
    in_saved_map = update.in_saved_map;
    const Pose truth = rec.sequence->T_world_camera(30).inverse() * rec.sequence->T_world_camera(i);
    const Pose T_world_start =
        in_saved_map ? rec.sequence->T_world_camera(0).inverse() * rec.sequence->T_world_camera(30)
                     : Pose();
    EXPECT_LT((update.T_world_camera->translation() - (T_world_start * truth).translation()).norm(),
              0.05)
        << "in the world that it names";
  }
  EXPECT_TRUE(in_saved_map);
  EXPECT_TRUE(second.newest()->update.in_saved_map);
  EXPECT_GE(corrections, 1U);
  EXPECT_THAT(error_of([&] { second.load_map("/nowhere.map"); }), HasSubstr("/nowhere.map"));
  const Results results = second.finish();
  EXPECT_EQ(results.statistics.maps, 1U);
  const Pose T_world_truth = rec.sequence->T_world_camera(0).inverse();
  for (const StampedPose& e : results.trajectory) {
    const auto index = static_cast<std::size_t>(std::lround(30 * e.timestamp));
    const Pose truth = T_world_truth * rec.sequence->T_world_camera(index);
    EXPECT_LT((e.T_world_camera.translation() - truth.translation()).norm(), 0.05);
  }
  EXPECT_THAT(error_of([&] { second.load_map(file); }), HasSubstr("has ended"));
  std::filesystem::remove(file);
}

TEST(SlamApi, TheMapOfALoadedMapIsUsedAtOnceAndItsKeyframesAreNotRepeated) {
  const Recording& rec = recording(0, "xyz");
  const std::filesystem::path file = test::own_path("api.map");
  Slam slam = slam_for(rec);
  for (std::size_t i = 0; i < 60; ++i) slam.push(rec.frames[i]);
  slam.save_map(file);
  const std::size_t keyframes = slam.snapshot()->keyframes.size();
  const std::size_t points = slam.snapshot()->cloud->points.size();
  EXPECT_EQ(slam.load_map(file), "");
  EXPECT_EQ(slam.load_map(file), "");
  EXPECT_EQ(slam.snapshot()->keyframes.size(), keyframes);
  EXPECT_NEAR(slam.snapshot()->cloud->points.size(), points, 0.02 * points);
  std::size_t until_found = 60;
  while (until_found < 90 && !slam.push(rec.frames[until_found]).in_saved_map) ++until_found;
  EXPECT_LE(until_found, 64U) << "as soon as the updates before it are taken";
  std::filesystem::remove(file);
}

TEST(SlamApi, AMapIsLoadedInTheFirstFrames) {
  const Recording& rec = recording(2, "xyz");
  const std::filesystem::path file = saved_map_of(rec);
  const std::size_t keyframes = read_saved_map(file).map.keyframes.size();
  for (const std::size_t loaded_after : {1U, 10U, 15U}) {
    Slam second = slam_for(rec);
    for (std::size_t i = 0; i < 60; ++i) {
      if (i == loaded_after) second.load_map(file);
      second.push(rec.frames[i]);
    }
    EXPECT_TRUE(second.newest()->update.in_saved_map) << loaded_after;
    second.save_map(test::own_path("again.map"));
    EXPECT_GE(read_saved_map(test::own_path("again.map")).map.keyframes.size(), keyframes);
  }
  std::filesystem::remove(file);
}

TEST(SlamApi, WarningsBeginAndStayWithTheMovers) {
  const Recording& rec = recording(2, "xyz");
  const std::filesystem::path file = test::own_path("rules.yaml");
  const auto write = [&](const std::string& text) { std::ofstream(file) << text; };
  Slam slam = slam_for(rec);
  EXPECT_TRUE(slam.warnings().empty());
  write("distances: [{to: camera, nearer: 50, classes: [persn]}]");
  EXPECT_THAT(error_of([&] { slam.watch(file); }), HasSubstr("'persn'"));
  write("distances: [{to: camera, nearer: 50, classes: [person]}]");
  slam.watch(file);
  std::vector<WarningEvent> told;
  const Subscription on_warning =
      slam.on_warning([&](const WarningEvent& event) { told.push_back(event); });
  std::set<int> persons;
  for (const RgbdFramePtr& frame : rec.frames) {
    slam.push(frame);
    for (const MovingObject& mover : slam.movers())
      if (mover.class_name == "person") persons.insert(mover.id);
    for (const WarningEvent& warning : slam.warnings())
      EXPECT_TRUE(warning.kind != WarningKind::kNear || persons.contains(warning.mover));
  }
  std::set<int> warned;
  for (const WarningEvent& event : told)
    if (event.begins && event.kind == WarningKind::kNear) warned.insert(event.mover);
  EXPECT_EQ(warned, persons);
  EXPECT_FALSE(persons.empty());
  EXPECT_FALSE(slam.warnings().empty());
  std::filesystem::remove(file);
}

TEST(SlamApi, AStereoPairBecomesAFrameWithDepth) {
  constexpr int kDisparity = 12;  // [pixels]
  Camera camera;
  camera.width = 320, camera.height = 240;
  camera.fx = camera.fy = 350, camera.cx = 160, camera.cy = 120;
  Slam with_kinect(camera);
  camera.depth_sensor = find_depth_sensor("stereo");
  camera.baseline = camera.depth_sensor.baseline;
  cv::Mat1b texture(camera.height, camera.width + kDisparity);
  cv::RNG(1).fill(texture, cv::RNG::UNIFORM, 0, 256);
  const cv::Mat left = texture.colRange(0, camera.width);
  const cv::Mat right = texture.colRange(kDisparity, camera.width + kDisparity);
  Slam slam(camera);
  const RgbdFramePtr frame = slam.make_stereo_frame(left, right, 1.0);
  const double depth = camera.fx * camera.baseline / kDisparity;
  const cv::Mat1f found = frame->depth;
  EXPECT_NEAR(found(120, 200), depth, 0.01 * depth);
  EXPECT_EQ(found(120, 2), 0) << "not in the right image";
  EXPECT_EQ(slam.push(frame).frame_index, 0U);
  EXPECT_EQ(slam.make_stereo_frame(left, right, 2.0)->index, 1U);
  Slam exchanged(camera);
  EXPECT_THAT(error_of([&] { exchanged.make_stereo_frame(right, left, 1.0); }),
              HasSubstr("are exchanged"));
  EXPECT_THAT(error_of([&] { with_kinect.make_stereo_frame(left, right, 1.0); }),
              HasSubstr("not a stereo pair"));
  EXPECT_THAT(error_of([&] { slam.make_stereo_frame(left, right.colRange(0, 99), 3.0); }),
              HasSubstr("right image"));
}

TEST(SlamApi, AClassThatDoesNotExistIsAnError) {
  Options options = small_options();
  options.motion.moving_classes = {"persn"};
  EXPECT_THAT(error_of([&] { Slam slam(recording(0, "xyz").sequence->camera(), options); }),
              AllOf(HasSubstr("option motion.moving_classes: there is no class 'persn'"),
                    HasSubstr("did you mean 'person'?")));
}

TEST(SlamApi, CallsInTheWrongOrderAreErrors) {
  const Recording rec = recording(0, "xyz");
  Slam slam = slam_for(rec);
  slam.push(rec.sequence->frame(0));
  slam.finish();
  EXPECT_THAT(error_of([&] { slam.push(rec.sequence->frame(1)); }), HasSubstr("has ended"));
  EXPECT_THAT(error_of([&] { slam.keep_journal("never.journal"); }), HasSubstr("has ended"));
  EXPECT_THAT(error_of([&] { slam.finish(); }), HasSubstr("has ended"));
}

TEST(SlamApi, ACameraOutOfRangeIsAnError) {
  Camera camera = recording(0, "xyz").sequence->camera();
  camera.fx = -1;
  EXPECT_THAT(error_of([&] { Slam slam(camera); }), HasSubstr("fx"));
}

}  // namespace
}  // namespace stillmap
