// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/recording_source.hpp"

#include "stillmap/recording/test_recording.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/doctor.hpp"
#include "stillmap/sensor/make_source.hpp"
#include "stillmap/sensor/recorded_image.hpp"
#include "stillmap/sensor/test_sequence.hpp"

#include <cstring>
#include <limits>
#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

using test::error_of;
using test::Kind;
using test::TestCamera;
using test::TestFolder;
using test::TestMessage;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr const char* kImage = "sensor_msgs/msg/Image";

std::vector<std::string> texts(const std::vector<Finding>& findings) {
  std::vector<std::string> texts;
  for (const Finding& finding : findings) texts.push_back(finding.text());
  return texts;
}

std::string bytes_of(const cv::Mat& image) {
  return {reinterpret_cast<const char*>(image.data), image.total() * image.elemSize()};
}

std::string file_of(const std::string& extension, const cv::Mat& image) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(extension, image, bytes);
  return {bytes.begin(), bytes.end()};
}

// A recording of the frames of a TestSequence: depth 5 ms after the color image.
std::vector<TestMessage> messages(int frames, const std::string& depth_frame = "color") {
  const TestCamera color{.frame = "color"}, depth{.frame = depth_frame};
  cv::Mat rgb;
  cv::cvtColor(TestSequence::color_image(), rgb, cv::COLOR_BGR2RGB);
  const cv::Mat meters(48, 64, CV_16UC1, cv::Scalar(2000));
  std::vector<TestMessage> all;
  for (int i = 0; i < frames; ++i) {
    const std::int64_t time = 100'000'000'000 + i * 33'333'333LL, later = time + 5'000'000;
    const auto stamp = [](std::int64_t ns) {
      return std::pair(static_cast<std::uint32_t>(ns / 1'000'000'000),
                       static_cast<std::uint32_t>(ns % 1'000'000'000));
    };
    all.push_back({"/rgb/info/camera_info", "sensor_msgs/msg/CameraInfo",
                   color.info(64, 48, 60, "plumb_bob", {}), time});
    all.push_back(
        {"/rgb/info/image", kImage,
         color.image(stamp(time).first, stamp(time).second, 64, 48, "rgb8", 3, bytes_of(rgb)),
         time});
    all.push_back(
        {"/depth/image", kImage,
         depth.image(stamp(later).first, stamp(later).second, 64, 48, "16UC1", 2, bytes_of(meters)),
         later});
  }
  return all;
}

TEST(RecordingSource, ReturnsTheFramesOfTheFolderWithTheSameImages) {
  const TestFolder folder;
  const auto file = folder.write("a.mcap", test::mcap_of(messages(3), "cdr", "zstd", 4, true));
  const auto source = make_source(file.string());
  EXPECT_EQ(source->camera().fx, 60);
  EXPECT_EQ(source->camera().width, 64);
  EXPECT_EQ(source->camera().fps, 30);
  EXPECT_EQ(source->size(), 3U);
  const auto frames = all_frames(*source);
  ASSERT_THAT(frames, SizeIs(3));
  EXPECT_EQ(frames[1]->timestamp, 100.033333333);
  EXPECT_NEAR(frames[1]->depth_delay, 0.005, 1e-9);
  EXPECT_EQ(cv::norm(frames[1]->color, TestSequence::color_image(), cv::NORM_INF), 0);
  EXPECT_EQ(frames[1]->depth.at<float>(20, 30), 2);
  EXPECT_THAT(source->notes(), ::testing::Contains(HasSubstr("/rgb/info/image, 3 images")));
}

TEST(RecordingSource, ADamagedImageCostsOneFrameAndOneWithoutDepthIsKept) {
  auto all = messages(4);
  all[3 + 1].data.resize(500);  // the color image of the second frame
  all[6 + 2].data.resize(500);  // the depth image of the third frame
  const TestFolder folder;
  RecordingSource source(folder.write_sqlite("a.db3", all), std::nullopt, "");
  const auto frames = all_frames(source);
  ASSERT_THAT(frames, SizeIs(3));
  EXPECT_EQ(cv::countNonZero(frames[1]->depth), 0);
  ASSERT_THAT(source.skipped(), SizeIs(2));
  EXPECT_THAT(source.skipped()[0].reason, HasSubstr("/rgb/info/image: an image is damaged"));
  EXPECT_FALSE(source.skipped()[1].frame_lost);
}

TEST(RecordingSource, UsesTheSelectedRangeAndTheGivenCamera) {
  const TestFolder folder;
  const auto file = folder.write_sqlite("a.db3", messages(8));
  Camera camera = TestSequence::camera();
  camera.depth_factor = 500;
  RecordingSource source(file, camera, "", {.first = 1, .count = 4, .stride = 2});
  const auto frames = all_frames(source);
  ASSERT_THAT(frames, SizeIs(2));
  EXPECT_NEAR(frames[0]->timestamp, 100 + 1 / 30.0, 1e-6);
  EXPECT_EQ(frames[0]->depth.at<float>(20, 30), 4);
  camera.width = 80;
  EXPECT_THAT(error_of([&] { RecordingSource(file, camera, ""); }),
              HasSubstr("is 64 x 48 pixels where the camera has 80 x 48"));
}

TEST(RecordingSource, DepthOfAnotherCameraIsRegistered) {
  auto all = messages(2, "depth");
  const TestFolder folder;
  all.push_back({"/depth/camera_info", "sensor_msgs/msg/CameraInfo",
                 TestCamera{.frame = "depth"}.info(64, 48, 60, "plumb_bob", {}), 1});
  all.push_back({"/tf_static", "tf2_msgs/msg/TFMessage",
                 TestCamera().transform("color", "depth", {0.1, 0, 0, 0, 0, 0, 1}), 2});
  RecordingSource source(folder.write("a.mcap", test::mcap_of(all, "cdr", "", 0, true)),
                         std::nullopt, "");
  const auto frame = source.next();
  ASSERT_NE(frame, nullptr);
  // 0.1 m to the right at 2 m are 3 pixels, where the depth image shows nothing.
  EXPECT_EQ(frame->depth.at<float>(20, 2), 0);
  EXPECT_EQ(frame->depth.at<float>(20, 3), 2);
  EXPECT_THAT(source.notes(), ::testing::Contains(HasSubstr("100.0 mm")));
}

TEST(RecordingSource, ATransformThatTurnsAllDepthOutOfTheImageIsToldAsTheTransform) {
  auto all = messages(2, "depth");
  all.push_back({"/depth/camera_info", "sensor_msgs/msg/CameraInfo",
                 TestCamera{.frame = "depth"}.info(64, 48, 60, "plumb_bob", {}), 1});
  // The depth camera's frame is that of its body: x forward, y left, z up.
  all.push_back({"/tf_static", "tf2_msgs/msg/TFMessage",
                 TestCamera().transform("color", "depth", {0.03, 0, 0, 0.5, -0.5, 0.5, 0.5}), 2});
  const TestFolder folder;
  const auto file = folder.write_sqlite("a.db3", all);
  EXPECT_THAT(error_of([&] { RecordingSource(file, std::nullopt, ""); }),
              ::testing::AllOf(HasSubstr("no depth of /depth/image falls into the images of "
                                         "/rgb/info/image"),
                               HasSubstr("0.030 m away and turned by 120 degrees"),
                               HasSubstr("record the transform between the optical frames")));
}

TEST(RecordingSource, RepeatedDepthMessagesAreNoLostFrames) {
  std::vector<TestMessage> all;
  for (const TestMessage& message : messages(3)) {
    const int copies = message.topic == "/depth/image" ? 3 : 1;
    for (int i = 0; i < copies; ++i) all.push_back(message);
  }
  const TestFolder folder;
  RecordingSource source(folder.write_sqlite("a.db3", all), std::nullopt, "");
  EXPECT_THAT(all_frames(source), SizeIs(3));
  ASSERT_THAT(source.skipped(), SizeIs(6));
  for (const SkippedFrame& skipped : source.skipped()) EXPECT_FALSE(skipped.frame_lost);
}

TEST(RecordingSource, OfARecordingThatWasPlayedInALoopTheLongestStretchIsUsed) {
  const auto pass = messages(60);  // two seconds
  std::vector<TestMessage> all(pass.end() - 3 * 40, pass.end());
  all.insert(all.end(), pass.begin(), pass.end());
  all.insert(all.end(), pass.begin(), pass.begin() + 3 * 45);
  std::int64_t time = 0;
  for (TestMessage& message : all) message.time = ++time;
  const TestFolder folder;
  RecordingSource source(folder.write_sqlite("a.db3", all), std::nullopt, "");
  EXPECT_THAT(all_frames(source), SizeIs(60));
  EXPECT_THAT(source.skipped(), SizeIs(0));
  EXPECT_THAT(texts(source.findings()),
              ElementsAre(HasSubstr("longest stretch is used, 60 of 145 images")));
}

TEST(RecordingSource, AShortLoopIsRecognizedToo) {
  const auto pass = messages(20);  // two thirds of a second
  std::vector<TestMessage> all;
  for (int loop = 0; loop < 4; ++loop) {
    const auto lost = loop > 0 ? 3 * 2 : 0;  // while the playback began again
    all.insert(all.end(), pass.begin() + lost, pass.end());
  }
  std::int64_t time = 0;
  for (TestMessage& message : all) message.time = ++time;
  const TestFolder folder;
  RecordingSource source(folder.write_sqlite("a.db3", all), std::nullopt, "");
  EXPECT_THAT(all_frames(source), SizeIs(20));
  EXPECT_THAT(texts(source.findings()),
              ElementsAre(HasSubstr("longest stretch is used, 20 of 74 images")));
}

constexpr const char* kImu = "sensor_msgs/msg/Imu";

/// Returns samples every 5 ms over a tenth of a second: angular velocities of i and accelerations
/// of 10 i about and along the x axis.
std::vector<TestMessage> imu_messages(const std::string& topic, const std::string& frame,
                                      bool angular_velocities, bool accelerations) {
  std::vector<TestMessage> all;
  for (int i = 0; i < 20; ++i) {
    const std::int64_t time = 100'000'000'000 + i * 5'000'000LL;
    all.push_back({topic, kImu,
                   TestCamera{.frame = frame}.imu(time, {angular_velocities ? 1.0 * i : 0, 0, 0},
                                                  {accelerations ? 10.0 * i : 0, 0, 0}),
                   time});
  }
  return all;
}

std::vector<TestMessage> joined(std::vector<TestMessage> a, const std::vector<TestMessage>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST(RecordingSource, FramesHaveTheSamplesOfTheImuWithItsRecordedPose) {
  auto all = joined(messages(3), imu_messages("/rgb/imu", "imu", true, true));
  all.push_back({"/tf_static", "tf2_msgs/msg/TFMessage",
                 TestCamera().transform("color", "imu", {0.1, 0.02, 0.03, 0, 0, 1, 0}), 2});
  const TestFolder folder;
  const auto source = make_source(folder.write_sqlite("a.db3", all).string());
  const auto& imu = source->camera().imu;
  ASSERT_TRUE(imu);
  EXPECT_TRUE(imu->T_camera_imu.translation().isApprox(Eigen::Vector3d(0.1, 0.02, 0.03)));
  EXPECT_NEAR(imu->T_camera_imu.angle(), M_PI, 1e-9);
  const auto frames = all_frames(*source);
  ASSERT_THAT(frames, SizeIs(3));
  ASSERT_THAT(frames[1]->imu, SizeIs(8));  // to the first one after 33 ms
  EXPECT_EQ(frames[1]->imu[7].angular_velocity.x(), 7);
  EXPECT_EQ(frames[1]->imu[7].acceleration.x(), 70);
  EXPECT_NEAR(frames[1]->imu[7].timestamp, 100.035, 1e-9);
  EXPECT_THAT(source->notes(), ::testing::Contains(HasSubstr("IMU: /rgb/imu")));
}

TEST(RecordingSource, FramesHaveTheOdometryWithTheRecordedPoseOfTheBase) {
  auto all = messages(3);
  for (int i = 0; i < 20; ++i) {
    const std::int64_t time = 100'000'000'000 + i * 5'000'000LL;
    all.push_back({"/odom", "nav_msgs/msg/Odometry",
                   TestCamera().odometry(time, "base", {0.1 * i, 0, 0, 0, 0, 0, 1}), time});
  }
  const TestFolder folder;
  EXPECT_THAT(make_source(folder.write_sqlite("a.db3", all).string())->notes(),
              ::testing::Contains(HasSubstr("no transform from frame color to frame base")));
  all.push_back({"/tf_static", "tf2_msgs/msg/TFMessage",
                 TestCamera().transform("color", "base", {0.1, 0.02, 0.03, 0, 0, 1, 0}), 2});
  const auto source = make_source(folder.write_sqlite("b.db3", all).string());
  ASSERT_TRUE(source->camera().wheels);
  EXPECT_NEAR(source->camera().wheels->T_camera_base.translation().x(), 0.1, 1e-12);
  const auto frames = all_frames(*source);
  ASSERT_THAT(frames[1]->odometry, SizeIs(8));  // to the first one after 33 ms
  EXPECT_NEAR(frames[1]->odometry[7].T_odom_base.translation().x(), 0.7, 1e-12);
}

TEST(RecordingSource, AccelerationsOfASeparateTopicAreInterpolated) {
  auto all = joined(messages(3), imu_messages("/rgb/gyro/sample", "color", true, false));
  auto accelerations = imu_messages("/rgb/accel/sample", "color", false, true);
  for (std::size_t i = 0; i < accelerations.size(); i += 2) all.push_back(accelerations[i]);
  const TestFolder folder;
  const auto source = make_source(folder.write_sqlite("a.db3", all).string());
  const auto frames = all_frames(*source);
  ASSERT_THAT(frames[1]->imu, SizeIs(8));
  EXPECT_EQ(frames[1]->imu[7].angular_velocity.x(), 7);
  EXPECT_NEAR(frames[1]->imu[7].acceleration.x(), 70, 1e-9);
}

TEST(RecordingSource, OfSeveralImusThatOfTheCameraIsTaken) {
  const auto all = joined(joined(messages(3), imu_messages("/body/imu", "color", false, true)),
                          imu_messages("/rgb/imu", "color", true, true));
  const TestFolder folder;
  const auto source = make_source(folder.write_sqlite("a.db3", all).string());
  EXPECT_THAT(source->notes(), ::testing::Contains(HasSubstr("IMU: /rgb/imu")));
}

TEST(RecordingSource, AnImuOfUnknownPoseIsToldAndNotUsed) {
  const auto all = joined(messages(3), imu_messages("/rgb/imu", "imu", true, true));
  const TestFolder folder;
  const auto file = folder.write_sqlite("a.db3", all);
  const auto source = make_source(file.string());
  EXPECT_FALSE(source->camera().imu);
  EXPECT_THAT(all_frames(*source)[1]->imu, SizeIs(0));
  EXPECT_THAT(
      source->notes(),
      ::testing::Contains(HasSubstr("no transform from frame color to frame imu is recorded")));
  Camera camera = TestSequence::camera();
  camera.imu = find_imu("d435i");
  const auto camera_file = folder.write("camera.yaml", "");
  write_camera(camera_file, camera);
  SourceOptions options;
  options.camera = camera_file.string();
  EXPECT_THAT(all_frames(*make_source(file.string(), options))[1]->imu, SizeIs(8));
}

TEST(RecordingSource, MessagesInAnyOrderAreSortedByTheirStamps) {
  const auto ordered = messages(12);
  std::vector<TestMessage> all;
  for (const int frame : {7, 2, 11, 0, 5, 9, 3, 10, 1, 8, 4, 6})
    all.insert(all.end(), ordered.begin() + 3 * frame, ordered.begin() + 3 * (frame + 1));
  std::int64_t time = 0;
  for (TestMessage& message : all) message.time = ++time;
  const TestFolder folder;
  RecordingSource source(folder.write_sqlite("a.db3", all), std::nullopt, "");
  const auto frames = all_frames(source);
  ASSERT_THAT(frames, SizeIs(12));
  EXPECT_NEAR(frames[11]->timestamp - frames[0]->timestamp, 11 / 30.0, 1e-6);
  EXPECT_THAT(source.skipped(), SizeIs(0));
  EXPECT_EQ(source.camera().fps, 30);
  EXPECT_THAT(texts(source.findings()),
              AllOf(::testing::Not(IsEmpty()), ::testing::Each(HasSubstr("sorted by them"))));
}

TEST(RecordingSource, AGivenCameraMayLackTheSizeOfTheImages) {
  const TestFolder folder;
  SourceOptions options;
  options.camera =
      folder.write("camera.yaml", "camera_matrix: {data: [60, 0, 31.5, 0, 60, 23.5, 0, 0, 1]}\n")
          .string();
  const auto source = make_source(folder.write_sqlite("a.db3", messages(2)).string(), options);
  EXPECT_EQ(source->camera().width, 64);
  EXPECT_THAT(all_frames(*source), SizeIs(2));
}

// Two frames with this depth everywhere, of a camera with this name.
std::vector<TestMessage> messages_with_depth(const std::string& name, std::uint16_t raw,
                                             const std::string& depth_topic = "/depth/image") {
  const std::string pixels = bytes_of(cv::Mat1w(48, 64, raw));
  auto all = messages(2);
  std::uint32_t time = 0;  // ns
  for (TestMessage& message : all) {
    message.topic = "/" + name + message.topic;
    if (!message.topic.ends_with("/depth/image")) continue;
    message.topic = fmt::format("/{}{}", name, depth_topic);
    message.data = TestCamera{.frame = "color"}.image(100, time, 64, 48, "16UC1", 2, pixels);
    time += 33'333'333;
  }
  return all;
}

TEST(RecordingSource, TheDepthOfAD405IsInItsUnitUnlessItWasConverted) {
  const TestFolder folder;
  RecordingSource own(folder.write_sqlite("a.db3", messages_with_depth("d405", 3000)), std::nullopt,
                      "");
  EXPECT_EQ(own.camera().depth_factor, 10000);
  EXPECT_THAT(
      texts(own.findings()),
      ElementsAre(AllOf(HasSubstr("depth unit: 0.1 mm, as the topics name a RealSense D405"),
                        HasSubstr("'depth_factor: 1000'"))));
  RecordingSource converted(folder.write_sqlite("b.db3", messages_with_depth("d405", 300)),
                            std::nullopt, "");
  EXPECT_EQ(converted.camera().depth_factor, 1000);
}

// realsense-ros converts to millimeters, so that 1.5 m are 1500; readings of 12000 cannot be.
TEST(RecordingSource, TheDriversDepthOfAD405IsInMillimetersUnlessItIsTooFar) {
  const TestFolder folder;
  const char* driver = "/aligned_depth_to_color/image_raw";
  RecordingSource converted(folder.write_sqlite("a.db3", messages_with_depth("d405", 1500, driver)),
                            std::nullopt, "");
  EXPECT_EQ(converted.camera().depth_factor, 1000);
  RecordingSource own(folder.write_sqlite("b.db3", messages_with_depth("d405", 12000, driver)),
                      std::nullopt, "");
  EXPECT_EQ(own.camera().depth_factor, 10000);
}

TEST(RecordingSource, DepthsBeyondTheSensorAreToldWithAFactorThatFits) {
  const TestFolder folder;
  RecordingSource source(folder.write_sqlite("a.db3", messages_with_depth("camera", 9000)),
                         std::nullopt, "");
  const Diagnosis diagnosis = diagnose(source, 10);
  const auto told = std::find_if(
      diagnosis.findings.begin(), diagnosis.findings.end(),
      [](const Finding& f) { return f.fix.find("depth_factor: 10000") != std::string::npos; });
  ASSERT_NE(told, diagnosis.findings.end());
  EXPECT_EQ(told->severity, Severity::kWarning);
  EXPECT_THAT(told->fix, HasSubstr("if it should be 0.90 m"));
  RecordingSource usual(folder.write_sqlite("b.db3", messages(2)), std::nullopt, "");
  EXPECT_THAT(usual.findings(), IsEmpty());
}

TEST(RecordingSource, OneImageWithTheStampOfAnotherTimeIsLeftOutAlone) {
  auto all = messages(20);
  std::swap(all[1], all[3 * 10 + 1]);  // color images one third of a second apart
  const TestFolder folder;
  RecordingSource source(folder.write_sqlite("a.db3", all), std::nullopt, "");
  EXPECT_THAT(all_frames(source), SizeIs(18));
  EXPECT_THAT(source.findings(), IsEmpty());
}

TEST(RecordingSource, ARecordingWithoutACameraNeedsOne) {
  auto all = messages(2);
  std::erase_if(all,
                [](const TestMessage& message) { return message.topic.ends_with("camera_info"); });
  const TestFolder folder;
  const auto file = folder.write_sqlite("a.db3", all);
  EXPECT_THAT(error_of([&] { RecordingSource(file, std::nullopt, ""); }), HasSubstr("--camera"));
  EXPECT_EQ(RecordingSource(file, TestSequence::camera(), "").size(), 2U);
}

TEST(RecordingSource, ACameraThatIsNotCalibratedIsAnErrorThatSaysSo) {
  auto all = messages(2);
  for (TestMessage& message : all) {
    if (message.topic.ends_with("camera_info"))
      message.data = TestCamera{.frame = "color"}.info(64, 48, 0, "", {});
  }
  const TestFolder folder;
  const auto file = folder.write_sqlite("a.db3", all);
  EXPECT_THAT(
      error_of([&] { RecordingSource(file, std::nullopt, ""); }),
      ::testing::AllOf(HasSubstr("K of /rgb/info/camera_info is 0"), HasSubstr("--camera")));
}

// ---- stereo pairs

constexpr double kFocal = 450, kBaseline = 0.12;  // pixels, m
constexpr int kDisparity = 24;                    // pixels

// Two frames of a stereo pair that looks at a wall.
// @param delay  of the right images [ns]
// @param sign  of the baseline in P of the right camera; ROS requires a negative one
std::vector<TestMessage> pair_messages(std::int64_t delay = 0, double sign = -1) {
  cv::Mat wall(160, 400, CV_8UC1);
  cv::theRNG().state = 5;
  cv::randu(wall, 0, 255);
  cv::GaussianBlur(wall, wall, {5, 5}, 0);
  std::vector<TestMessage> all;
  for (int i = 0; i < 2; ++i) {
    for (const bool left : {true, false}) {
      const std::string name = left ? "/left" : "/right";
      const TestCamera camera{.frame = name};
      const cv::Mat image = wall.colRange(left ? 0 : kDisparity, left ? 320 : 320 + kDisparity);
      const std::int64_t time = 1'000'000'000 + i * 100'000'000 + (left ? 0 : delay);
      all.push_back(
          {name + "/camera_info", "sensor_msgs/msg/CameraInfo",
           camera.info(320, 160, kFocal / 2, "plumb_bob", {}, left ? 0 : sign * kFocal * kBaseline),
           time});
      all.push_back({name + "/image_rect", kImage,
                     camera.image(1, static_cast<std::uint32_t>(time - 1'000'000'000), 320, 160,
                                  "mono8", 1, bytes_of(image.clone())),
                     time});
    }
  }
  return all;
}

constexpr const char* kPair = "/left/image_rect,/right/image_rect";

TEST(RecordingSource, IgnoredPixelsHaveNoDepth) {
  const TestFolder folder;
  const std::string ignore = folder.path("ignore.png").string();
  cv::Mat left(48, 64, CV_8UC1, cv::Scalar(0));
  left.colRange(0, 24).setTo(255);
  cv::imwrite(ignore, left);
  RecordingSource source(folder.write_sqlite("a.db3", messages(1)), std::nullopt, "", {}, ignore);
  const auto frame = source.next();
  EXPECT_EQ(cv::norm(frame->ignored, left, cv::NORM_INF), 0);
  EXPECT_EQ(frame->depth.at<float>(20, 23), 0);
  EXPECT_EQ(frame->depth.at<float>(20, 24), 2);
  EXPECT_THAT(source.notes(), ::testing::Contains(HasSubstr("ignored: 37.5 %")));
}

TEST(RecordingSource, AStereoPairGivesTheLeftImagesWithDepth) {
  const TestFolder folder;
  RecordingSource source(folder.write_sqlite("a.db3", pair_messages()), std::nullopt, kPair);
  EXPECT_EQ(source.camera().fx, kFocal);
  EXPECT_NEAR(source.camera().baseline, kBaseline, 1e-12);
  EXPECT_EQ(source.camera().depth_sensor.name, "stereo");
  EXPECT_THAT(source.notes(), ::testing::Contains(HasSubstr("baseline 0.120 m, rectified")));
  const auto frames = all_frames(source);
  ASSERT_THAT(frames, SizeIs(2));
  const double depth = kFocal * kBaseline / kDisparity;  // m
  EXPECT_NEAR(frames[0]->depth.at<float>(80, 200), depth, 0.01 * depth);
  EXPECT_EQ(frames[1]->depth_delay, 0);
}

TEST(RecordingSource, ABaselineOfTheWrongSignIsTurnedAsTheImagesTell) {
  const TestFolder folder;
  const auto file = folder.write_sqlite("a.db3", pair_messages(0, /*sign=*/1));
  RecordingSource source(file, std::nullopt, kPair);
  EXPECT_THAT(texts(source.findings()), ElementsAre(HasSubstr("it is used with the other sign")));
  const auto frames = all_frames(source);
  ASSERT_THAT(frames, SizeIs(2));
  const double depth = kFocal * kBaseline / kDisparity;  // m
  EXPECT_NEAR(frames[0]->depth.at<float>(80, 200), depth, 0.01 * depth);
  SourceOptions options;
  options.topics = kPair;
  EXPECT_NEAR(recorded_camera(file.string(), options).baseline, kBaseline, 1e-12);
}

TEST(RecordingSource, TopicsOfAPairInTheWrongOrderAreAnError) {
  const TestFolder folder;
  const auto file = folder.write_sqlite("a.db3", pair_messages());
  EXPECT_THAT(
      error_of([&] { RecordingSource(file, std::nullopt, "/right/image_rect,/left/image_rect"); }),
      HasSubstr("name the left camera first"));
}

TEST(RecordingSource, ImagesOfAStereoPairMustBeOfTheSameInstant) {
  const TestFolder folder;
  const auto file = folder.write_sqlite("a.db3", pair_messages(5'000'000));
  EXPECT_THAT(
      error_of([&] { RecordingSource(file, std::nullopt, kPair); }),
      HasSubstr("no image of /left/image_rect has one of /right/image_rect within 0.002 s"));
}

TEST(RecordingSource, ADamagedRightImageLeavesAFrameWithoutDepth) {
  auto all = pair_messages();
  all[7].data.resize(500);
  const TestFolder folder;
  RecordingSource source(folder.write_sqlite("a.db3", all), std::nullopt, kPair);
  const auto frames = all_frames(source);
  ASSERT_THAT(frames, SizeIs(2));
  EXPECT_EQ(cv::countNonZero(frames[1]->depth), 0);
  ASSERT_THAT(source.skipped(), SizeIs(1));
  EXPECT_FALSE(source.skipped()[0].frame_lost);
}

TEST(RecordingSource, AStereoPairRefusesAnotherCamera) {
  const TestFolder folder;
  const auto file = folder.write_sqlite("a.db3", pair_messages());
  EXPECT_THAT(error_of([&] { RecordingSource(file, TestSequence::camera(), kPair); }),
              HasSubstr("leave --camera out"));
}

// ---- pixel formats ------------------------------------------------------------------------------

// Decodes an image message without compression in every encoding of messages.
ImageRead decode(const std::string& format, int pixel_bytes, const std::string& pixels, Kind kind,
                 bool depth) {
  const std::string bytes = TestCamera{.kind = kind}.image(1, 2, 4, 2, format, pixel_bytes, pixels);
  const ByteSpan span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  const ImageStream stream{.encoding = format};
  const std::string encoding = kind == Kind::kRos1 ? "ros1" : "cdr";
  return depth ? decode_recorded_depth(stream, encoding, span, {4, 2})
               : decode_recorded_color(stream, encoding, span, {4, 2});
}

TEST(RecordedImage, PixelFormatsBecomeBgr) {
  const auto repeated = [](const std::string& pixel) {
    std::string all;
    for (int i = 0; i < 8; ++i) all += pixel;
    return all;
  };
  for (const Kind kind : {Kind::kRos1, Kind::kLittleCdr, Kind::kBigCdr}) {
    for (const auto& [format, pixel] :
         std::vector<std::pair<std::string, std::string>>{{"rgb8", "\x03\x02\x01"},
                                                          {"bgr8", "\x01\x02\x03"},
                                                          {"rgba8", "\x03\x02\x01\x09"},
                                                          {"bgra8", "\x01\x02\x03\x09"}}) {
      const auto read =
          decode(format, static_cast<int>(pixel.size()), repeated(pixel), kind, false);
      ASSERT_EQ(read.problem, "") << format;
      EXPECT_EQ(read.image.at<cv::Vec3b>(1, 3), cv::Vec3b(1, 2, 3)) << format;
    }
    EXPECT_EQ(decode("mono8", 1, repeated("\x07"), kind, false).image.at<cv::Vec3b>(1, 3),
              cv::Vec3b(7, 7, 7));
    EXPECT_NE(decode("rgb16", 6, repeated("123456"), kind, false).problem, "");
    EXPECT_NE(decode("rgb8", 3, repeated("12"), kind, false).problem, "");
  }
}

TEST(RecordedImage, BayerPatternsAreCalledByTheirFirstTwoPixels) {
  for (const auto& [format, row, column, channel] :
       {std::tuple("bayer_rggb8", 0, 0, 2), std::tuple("bayer_bggr8", 0, 0, 0),
        std::tuple("bayer_grbg8", 0, 1, 2), std::tuple("bayer_gbrg8", 0, 1, 0)}) {
    cv::Mat1b pattern(8, 8, uchar{0});  // Only the pixels of one color are bright.
    for (int y = row; y < 8; y += 2)
      for (int x = column; x < 8; x += 2) pattern(y, x) = 200;
    const std::string bytes = TestCamera().image(1, 2, 8, 8, format, 1, bytes_of(pattern));
    const ByteSpan span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    const ImageStream stream{.encoding = format};
    const ImageRead read = decode_recorded_color(stream, "cdr", span, {8, 8});
    ASSERT_EQ(read.problem, "");
    cv::Vec3b expected(0, 0, 0);
    expected[channel] = 200;
    EXPECT_EQ(read.image.at<cv::Vec3b>(4 + row, 4 + column), expected) << format;
  }
}

TEST(RecordedImage, DepthIsReadInBothByteOrders) {
  const std::string little("\x10\x27\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 16);
  const std::string big("\x27\x10\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 16);
  for (const char* format : {"16UC1", "mono16"}) {
    EXPECT_EQ(decode(format, 2, little, Kind::kLittleCdr, true).image.at<std::uint16_t>(0, 0),
              10000);
    EXPECT_EQ(decode(format, 2, big, Kind::kBigCdr, true).image.at<std::uint16_t>(0, 0), 10000);
  }
  const cv::Mat1f meters(2, 4, 1.5F);
  EXPECT_EQ(decode("32FC1", 4, bytes_of(meters), Kind::kRos1, true).image.at<float>(1, 3), 1.5F);
  EXPECT_NE(decode("rgb8", 3, std::string(24, 'x'), Kind::kRos1, true).problem, "");
}

// Encodes RVL as described at decode_rvl().
class RvlWriter {
 public:
  explicit RvlWriter(const cv::Mat1w& image) {
    bytes_ = test::le(static_cast<std::uint32_t>(image.cols)) +
             test::le(static_cast<std::uint32_t>(image.rows));
    const auto* pixel = image[0];
    const auto* const end = pixel + image.total();
    std::int64_t last = 0;
    while (pixel < end) {
      const auto* const first = std::find_if(pixel, end, [](auto value) { return value != 0; });
      const auto* const run_end = std::find(first, end, 0);
      number(first - pixel);
      number(run_end - first);
      for (pixel = first; pixel < run_end; ++pixel) {
        const std::int64_t difference = *pixel - last;
        number(difference >= 0 ? 2 * difference : -2 * difference - 1);
        last = *pixel;
      }
    }
    while (nibbles_ % 8 != 0) nibble(0);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  void number(std::int64_t value) {
    for (; value >= 8; value /= 8) nibble(static_cast<std::uint32_t>(value % 8 + 8));
    nibble(static_cast<std::uint32_t>(value));
  }
  void nibble(std::uint32_t value) {
    word_ = word_ * 16 + value;
    if (++nibbles_ % 8 == 0) bytes_ += test::le(word_);
  }

  std::string bytes_;
  std::uint32_t word_ = 0;
  int nibbles_ = 0;
};

cv::Mat1w depth_with_holes() {
  cv::Mat1w raw(30, 40);
  cv::randu(raw, 0, 65536);
  raw.rowRange(5, 9) = 0;
  raw(0, 0) = 65535;
  raw(29, 39) = 0;
  return raw;
}

ImageRead decode_rvl_message(const std::string& code, const std::string& format = "16UC1") {
  const std::string bytes = TestCamera().compressed_image(1, 2, format + "; compressedDepth rvl",
                                                          std::string(12, '\0') + code);
  const ByteSpan span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  const ImageStream stream{.storage = ImageStorage::kCompressedDepth, .encoding = format};
  return decode_recorded_depth(stream, "cdr", span, {40, 30});
}

TEST(RecordedImage, DepthInRvlIsRead) {
  const cv::Mat1w raw = depth_with_holes();
  const ImageRead read = decode_rvl_message(RvlWriter(raw).bytes());
  ASSERT_EQ(read.problem, "");
  EXPECT_EQ(cv::norm(read.image, raw, cv::NORM_INF), 0);
  EXPECT_EQ(
      cv::countNonZero(decode_rvl_message(RvlWriter(cv::Mat1w(30, 40, ushort{0})).bytes()).image),
      0);
  EXPECT_THAT(decode_rvl_message(RvlWriter(cv::Mat1w(20, 40, ushort{7})).bytes()).problem,
              HasSubstr("40 x 20 pixels"));
}

TEST(RecordedImage, DamagedRvlIsAProblemOrAnotherImage) {
  const std::string code = RvlWriter(depth_with_holes()).bytes();
  for (std::size_t n = 0; n < code.size(); ++n)
    EXPECT_NE(decode_rvl_message(code.substr(0, n)).problem, "") << n;
  std::mt19937 random(4);
  int problems = 0;
  for (int i = 0; i < 5000; ++i) {
    std::string altered = code;
    for (int k = 0; k < 3; ++k)
      altered[8 + random() % (code.size() - 8)] = static_cast<char>(random());
    const ImageRead read = decode_rvl_message(altered);
    problems += read.problem.empty() ? 0 : 1;
    EXPECT_TRUE(!read.problem.empty() || read.image.size() == cv::Size(40, 30));
  }
  EXPECT_GT(problems, 0);
}

TEST(RecordedImage, CompressedDepthIsReadInMillimetersAndAsInverseDepth) {
  cv::Mat raw(2, 4, CV_16UC1, cv::Scalar(1234));
  raw.at<std::uint16_t>(0, 0) = 0;
  // As compressed_depth_image_transport quantizes: a = q (q + 1), b = 1 - a / longest depth.
  const float a = 100 * 101, b = 1 - a / 10;
  for (const bool inverse : {false, true}) {
    std::string data(12, '\0');
    std::memcpy(data.data() + 4, &a, 4);
    std::memcpy(data.data() + 8, &b, 4);
    data += file_of(".png", raw);
    const std::string format = inverse ? "32FC1" : "16UC1";
    const std::string bytes =
        TestCamera().compressed_image(1, 2, format + "; compressedDepth png", data);
    const ByteSpan span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    const ImageStream stream{.storage = ImageStorage::kCompressedDepth, .encoding = format};
    const ImageRead read = decode_recorded_depth(stream, "cdr", span, {4, 2});
    ASSERT_EQ(read.problem, "");
    if (inverse) {
      EXPECT_FLOAT_EQ(read.image.at<float>(1, 2), a / (1234 - b));
      EXPECT_EQ(read.image.at<float>(0, 0), 0);
    } else {
      EXPECT_EQ(read.image.at<std::uint16_t>(1, 2), 1234);
    }
    EXPECT_NE(decode_recorded_depth(stream, "cdr", span.first(70), {4, 2}).problem, "");
    EXPECT_NE(decode_recorded_depth(stream, "cdr", span, {5, 2}).problem, "");
  }
}

}  // namespace
}  // namespace stillmap
