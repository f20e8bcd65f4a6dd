// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/motion_files.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/base/test_error.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/base/warning.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/make_source.hpp"
#include "stillmap/sensor/sample_buffer.hpp"
#include "stillmap/sensor/test_sequence.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using test::error_of;
using ::testing::HasSubstr;
using ::testing::SizeIs;

class ImuFile : public ::testing::Test {
 protected:
  TestSequence sequence_{3};
  std::filesystem::path file_ = sequence_.path("imu.csv");

  std::vector<ImuSample> read(const std::string& text) const {
    write_file(file_, text);
    return read_imu(file_);
  }
  std::string error(const std::string& text) const {
    return error_of([&] { read(text); });
  }
};

TEST_F(ImuFile, IsReadAsItIsWritten) {
  const std::vector<ImuSample> samples{{100.005, {0.1, -0.2, 0.3}, {0.5, -9.8, 0.25}},
                                       {100.010, {0.2, -0.3, 0.4}, {0.6, -9.7, 0.5}}};
  write_imu(file_, samples);
  const auto found = read_imu(file_);
  ASSERT_THAT(found, SizeIs(2));
  EXPECT_NEAR(found[1].timestamp, 100.010, 1e-9);
  EXPECT_EQ(found[1].angular_velocity, samples[1].angular_velocity);
  EXPECT_EQ(found[1].acceleration, samples[1].acceleration);
}

TEST_F(ImuFile, TimesAreSecondsOrNanoseconds) {
  EXPECT_EQ(read("12.5,0,0,0,0,9.8,0\n").front().timestamp, 12.5);
  EXPECT_NEAR(read("1305031229500000000 0 0 0 0 9.8 0\n").front().timestamp, 1305031229.5, 1e-6);
  EXPECT_EQ(read("1305031229.5 0 0 0 0 9.8 0\n").front().timestamp, 1305031229.5);
}

TEST_F(ImuFile, RepeatedSamplesDoNotHideNanoseconds) {
  const auto samples =
      read("5000000000,0,0,0,0,9.8,0\n5000000000,0,0,0,0,9.8,0\n5005000000,0,0,0,0,9.8,0\n");
  ASSERT_THAT(samples, SizeIs(2));
  EXPECT_NEAR(samples[0].timestamp, 5, 1e-9);
  EXPECT_NEAR(samples[1].timestamp, 5.005, 1e-9);
}

TEST_F(ImuFile, OdometryWithoutRotationsIsAnError) {
  write_file(sequence_.path("odometry.txt"), "# t x y yaw\n1 0 0 0.1\n2 0 0 0.2\n");
  EXPECT_THAT(error_of([&] { read_odometry(sequence_.path("odometry.txt")); }),
              HasSubstr("odometry.txt:2"));
}

TEST_F(ImuFile, OtherTextIsAnErrorWithItsLine) {
  EXPECT_THAT(error("1,0,0,0,0,0,0\n2,0,0\n"), HasSubstr("imu.csv:2"));
  EXPECT_THAT(error("1,0,0,x,0,0,0\n"), HasSubstr("'x' is not a number"));
  EXPECT_THAT(error("# heading\n"), HasSubstr("contains no sample"));
}

TEST_F(ImuFile, SamplesThatCannotBeUsedAreLeftOut) {
  EXPECT_THAT(read("1,0,0,0,0,0,0\n3,0,0,0,0,0,0\n2,0,0,0,0,0,0\n4,nan,0,0,0,0,0\n"), SizeIs(2));
}

TEST_F(ImuFile, FramesHaveTheSamplesOfTheLastSecondByTheClockOfTheImages) {
  Camera camera = TestSequence::camera();
  camera.imu = find_imu("d435i");
  camera.imu->time_offset = 0.5;
  camera.imu->T_camera_imu = Pose(so3_exp({0, 0, 0.1}), {0.01, 0.02, 0.03});
  write_camera(sequence_.path("camera.yaml"), camera);
  std::vector<ImuSample> samples;
  for (int i = 0; i < 400; ++i) samples.push_back({.timestamp = 98.5 + 0.01 * i + 0.5});
  write_imu(file_, samples);
  const auto source = make_source(sequence_.folder().string());
  ASSERT_TRUE(source->camera().imu);
  EXPECT_NEAR(source->camera().imu->T_camera_imu.translation().z(), 0.03, 1e-12);
  EXPECT_NEAR(so3_log(source->camera().imu->T_camera_imu.quaternion()).z(), 0.1, 1e-9);
  const auto frames = all_frames(*source);
  ASSERT_THAT(frames, SizeIs(3));
  for (const auto& frame : frames) {
    EXPECT_GE(frame->imu.back().timestamp, frame->timestamp);
    EXPECT_LT(frame->imu.back().timestamp, frame->timestamp + 0.0101);
    EXPECT_NEAR(frame->imu.front().timestamp, frame->timestamp - 1, 0.0101);
  }
}

TEST_F(ImuFile, CameraFilesKeepTheNoise) {
  Camera camera = TestSequence::camera();
  camera.imu = find_imu("d435i");
  camera.imu->gyro_noise = 0.25;
  camera.imu->accel_walk = 0.125;
  const auto file = sequence_.path("camera.yaml");
  write_camera(file, camera);
  const Camera found = read_camera(file.string());
  EXPECT_EQ(found.imu->gyro_noise, 0.25);
  EXPECT_EQ(found.imu->accel_walk, 0.125);
  EXPECT_EQ(found.imu->accel_noise, find_imu("d435i").accel_noise);
  EXPECT_THAT(read_file(file), testing::Not(HasSubstr("accelerometer_noise_density")));
}

TEST_F(ImuFile, FramesHaveTheOdometryOfAFolderWhoseCameraIsOnWheels) {
  Camera camera = TestSequence::camera();
  const std::vector<OdometrySample> samples{{99.9, Pose()},
                                            {100.09, Pose(so3_exp({0, 0, 0.2}), {1, 2, 0})}};
  write_odometry(sequence_.path("odometry.txt"), samples);
  write_camera(sequence_.path("camera.yaml"), camera);
  const auto without = make_source(sequence_.folder().string());
  EXPECT_TRUE(without->next()->odometry.empty());
  ASSERT_THAT(without->findings(), SizeIs(1));
  EXPECT_THAT(without->findings()[0].message, HasSubstr("odometry.txt is not used"));
  EXPECT_EQ(without->findings()[0].severity, Severity::kNote);
  camera.wheels = Wheels{.T_camera_base = Pose(so3_exp({1.5, 0, 0}), {0, 0.4, 0.1})};
  write_camera(sequence_.path("camera.yaml"), camera);
  const auto source = make_source(sequence_.folder().string());
  const Pose& T_camera_base = source->camera().wheels->T_camera_base;
  EXPECT_THAT(source->findings(), ::testing::IsEmpty());
  EXPECT_TRUE((T_camera_base.inverse() * camera.wheels->T_camera_base).log().isZero(1e-9));
  const auto found = source->next()->odometry;
  ASSERT_THAT(found, SizeIs(2));
  EXPECT_TRUE((found[1].T_odom_base.inverse() * samples[1].T_odom_base).log().isZero(1e-8));
}

TEST(SampleBuffer, SortsSamplesAndForgetsOldOnes) {
  SampleBuffer<ImuSample> buffer;
  for (const double time : {1.0, 3.0, 2.0, 3.0, 4.0}) buffer.add({.timestamp = time});
  std::vector<double> times;
  for (const ImuSample& sample : samples_until(buffer.samples(), 3.5))
    times.push_back(sample.timestamp);
  EXPECT_THAT(times, ::testing::ElementsAre(3, 4));
  for (int i = 0; i < 3000; ++i) buffer.add({.timestamp = 5 + 0.01 * i});
  EXPECT_LE(buffer.samples().size(), 2100U);
  EXPECT_GT(buffer.samples().front().timestamp, 5);
}

TEST(SampleBuffer, CountsSamplesThatComeAfterTheirFrame) {
  SampleBuffer<ImuSample> buffer;
  for (const double time : {1.0, 2.0, 4.0}) buffer.add({.timestamp = time});
  EXPECT_THAT(buffer.take_until(2.5), SizeIs(2)) << "of the last second, and the next one";
  for (const double time : {2.25, 2.5, 3.0, 1.5, 4.0}) buffer.add({.timestamp = time});
  EXPECT_EQ(buffer.late().added, 7U) << "4.0 is there";
  EXPECT_EQ(buffer.late().late, 3U);
  EXPECT_EQ(buffer.late().longest, 1.0);
}

TEST_F(ImuFile, CameraFilesNameTheUnit) {
  const auto with = [&](const std::string& lines) {
    write_camera(sequence_.path("camera.yaml"), TestSequence::camera());
    write_file(sequence_.path("camera.yaml"), read_file(sequence_.path("camera.yaml")) + lines);
    return error_of([&] { read_camera(sequence_.path("camera.yaml").string()); });
  };
  EXPECT_THAT(with("imu: d435\n"), HasSubstr("d435i"));
  EXPECT_THAT(with("imu_time_offset: 0.1\n"), HasSubstr("is given without an imu"));
  EXPECT_THAT(with("gyroscope_random_walk: 0.1\n"), HasSubstr("is given without an imu"));
  EXPECT_THAT(with("imu: d455\ngyroscope_random_walk: -1\n"), HasSubstr("not positive"));
  EXPECT_THAT(with("imu: d455\nT_camera_imu: [2,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n"),
              HasSubstr("is no rigid motion"));
}

}  // namespace
}  // namespace stillmap
