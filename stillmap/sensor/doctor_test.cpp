// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/doctor.hpp"

#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/test_sequence.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Doctor : public ::testing::Test {
 protected:
  TestSequence sequence_{12};

  Doctor() {  // A plausible recording: texture, indoor depths, a true trajectory.
    cv::Mat color(48, 64, CV_8UC3), depth(48, 64, CV_16UC1);
    cv::theRNG().state = 7;
    cv::randu(color, 60, 200);
    cv::randu(depth, 1.0 * 5000, 3.0 * 5000);
    std::string truth;
    for (int i = 0; i < 12; ++i) {
      sequence_.write_image(TestSequence::color_name(i), color);
      sequence_.write_image(TestSequence::depth_name(i), depth);
      truth += fmt::format("{:.6f} {} 0 0 0 0 0 1\n", TestSequence::stamp(i), 0.01 * i);
    }
    sequence_.write("groundtruth.txt", truth);
    write_camera(sequence_.path("camera.yaml"), TestSequence::camera());
  }

  Diagnosis diagnose() const { return stillmap::diagnose(sequence_.folder()); }
  // Returns the findings of this severity, one per line: "message -> fix".
  static std::string of(const Diagnosis& diagnosis, Severity severity) {
    std::string text;
    for (const auto& finding : diagnosis.findings) {
      if (finding.severity == severity) text += finding.message + " -> " + finding.fix + "\n";
    }
    return text;
  }
  std::string warnings() const { return of(diagnose(), Severity::kWarning); }
  std::string untrusted() const { return of(diagnose(), Severity::kUntrusted); }
  std::string errors() const { return of(diagnose(), Severity::kError); }
  // Rewrites a list with changed timestamps.
  template <typename Change>
  void restamp(const std::string& list, const char* kind, const Change& change) const {
    std::string text;
    for (int i = 0; i < 12; ++i) {
      text += fmt::format("{:.6f} {}/{}.png\n", change(TestSequence::stamp(i)), kind, i);
    }
    sequence_.write(list, text);
  }
};

TEST_F(Doctor, TellsExchangedCoordinatesOfThePrincipalPoint) {
  Camera camera = TestSequence::camera();
  camera.cx = camera.height / 2.0;
  camera.cy = camera.width / 2.0;
  write_camera(sequence_.path("camera.yaml"), camera);
  EXPECT_THAT(untrusted(), HasSubstr("with cx and cy exchanged"));
}

TEST_F(Doctor, KnowsTheDepthFactorOfAKinectByTheStepsOfItsDepths) {
  cv::Mat1w depth(48, 64);
  double disparity = 8 * 580 * 0.075 / 5;  // 5 m
  for (std::uint16_t& raw : depth) {
    raw = static_cast<std::uint16_t>(std::lround(5000 * 8 * 580 * 0.075 / disparity));
    disparity = raw < 5000 ? 8 * 580 * 0.075 / 5 : disparity + 1;
  }
  for (int i = 0; i < 12; ++i) sequence_.write_image(TestSequence::depth_name(i), depth);
  EXPECT_THAT(of(diagnose(), Severity::kOk), HasSubstr("confirm the depth factor"));
  Camera camera = TestSequence::camera();
  camera.depth_factor = 10000;  // half the distances, which are plausible, too
  write_camera(sequence_.path("camera.yaml"), camera);
  EXPECT_THAT(untrusted(), HasSubstr("all distances would be 0.5 times the true ones"));
  EXPECT_THAT(untrusted(), HasSubstr("set the depth factor to 5000"));
}

TEST_F(Doctor, ReadsDepthInMeters) {
  cv::Mat1f meters(48, 64);
  cv::randu(meters, 1.0, 3.0);
  for (int i = 0; i < 12; ++i) {
    sequence_.write_image("depth.tiff", meters);
    fs::rename(sequence_.path("depth.tiff"), sequence_.path(TestSequence::depth_name(i)));
  }
  EXPECT_EQ(warnings(), "");
  EXPECT_NEAR(diagnose().median_depth, 2, 0.1);
}

TEST_F(Doctor, AcceptsAValidSequence) {
  const Diagnosis diagnosis = diagnose();
  EXPECT_EQ(diagnosis.conclusion(), Severity::kOk) << warnings() << errors();
  EXPECT_EQ(diagnosis.frames, 12u);
  EXPECT_EQ(diagnosis.usable_frames, 12u);
  EXPECT_NEAR(diagnosis.frame_rate, 30, 0.1);
  EXPECT_NEAR(diagnosis.duration, 11 / 30.0, 1e-5);
  EXPECT_NEAR(diagnosis.median_depth, 2, 0.1);
  EXPECT_NEAR(diagnosis.depth_share, 1, 1e-9);
  EXPECT_NEAR(diagnosis.median_offset, 0.005, 1e-5);
}

TEST_F(Doctor, ReportsMissingPartsOfAFolder) {
  fs::remove(sequence_.path("depth.txt"));
  EXPECT_THAT(errors(), HasSubstr("contains rgb.txt but no depth.txt -> add depth.txt"));
}

TEST_F(Doctor, SuggestsThePlausibleDepthFactor) {
  Camera camera = TestSequence::camera();
  camera.depth_factor = 1000;  // 2 m become 10 m.
  write_camera(sequence_.path("camera.yaml"), camera);
  EXPECT_THAT(untrusted(), HasSubstr("set the depth factor (1000) to 5000"));
  cv::Mat millimeters(48, 64, CV_16UC1);
  cv::randu(millimeters, 1000, 3000);
  for (int i = 0; i < 12; ++i) sequence_.write_image(TestSequence::depth_name(i), millimeters);
  EXPECT_THAT(untrusted(), "");
  camera.depth_factor = 5000;
  write_camera(sequence_.path("camera.yaml"), camera);
  EXPECT_THAT(untrusted(), HasSubstr("set the depth factor (5000) to 1000"));
}

// A RealSense D405 at 1.2 m, in 0.1 mm.
TEST_F(Doctor, SuggestsEachOfTwoDepthFactorsThatAreEquallyPlausible) {
  Camera camera = TestSequence::camera();
  camera.depth_factor = 1000;
  write_camera(sequence_.path("camera.yaml"), camera);
  for (int i = 0; i < 12; ++i)
    sequence_.write_image(TestSequence::depth_name(i), cv::Mat1w(48, 64, std::uint16_t{12000}));
  EXPECT_THAT(untrusted(), HasSubstr("(1000) to 5000 if the median depth should be 2.40 m, or to "
                                     "10000 if the median depth should be 1.20 m"));
}

TEST_F(Doctor, DoubtsAUnitInWhichMostDepthsAreOutOfTheRangeOfTheSensor) {
  Camera camera = TestSequence::camera();  // the depths are 1 to 3 m
  EXPECT_FALSE(depth_unit_finding(sequence_.folder(), camera));
  camera.depth_factor = 50000;
  EXPECT_THAT(depth_unit_finding(sequence_.folder(), camera).value_or(Finding()).text(),
              HasSubstr("outside 0.45 to 7.5 m"));
  camera.depth_factor = 500;
  EXPECT_THAT(depth_unit_finding(sequence_.folder(), camera).value_or(Finding()).text(),
              HasSubstr("outside 0.45 to 7.5 m"));
}

TEST_F(Doctor, DoubtsAUnitInWhichAQuarterOfTheDepthsIsTooNearForTheSensor) {
  Camera camera = TestSequence::camera();  // the depths are 1 to 3 m
  camera.depth_sensor = find_depth_sensor("azure_kinect");
  EXPECT_FALSE(depth_unit_finding(sequence_.folder(), camera));
  camera.depth_factor = 17000;  // 0.3 to 0.9 m
  EXPECT_THAT(depth_unit_finding(sequence_.folder(), camera).value_or(Finding()).text(),
              HasSubstr("a quarter of the depth readings is below 0.4"));
}

TEST_F(Doctor, DoubtsAListThatWasSortedAsText) {
  EXPECT_FALSE(order_finding(sequence_.folder()));
  cv::Mat color(48, 64, CV_8UC3, cv::Scalar(90, 90, 90)), depth(48, 64, CV_16UC1, cv::Scalar(9000));
  std::vector<std::string> names;
  for (int i = 0; i < 40; ++i) names.push_back(fmt::format("view{}.png", i));
  std::sort(names.begin(), names.end());
  std::string colors, depths;
  for (std::size_t i = 0; i < names.size(); ++i) {
    sequence_.write_image("rgb/" + names[i], color);
    sequence_.write_image("depth/" + names[i], depth);
    colors += fmt::format("{:.6f} rgb/{}\n", TestSequence::stamp(static_cast<int>(i)), names[i]);
    depths += fmt::format("{:.6f} depth/{}\n", TestSequence::stamp(static_cast<int>(i)), names[i]);
  }
  sequence_.write("rgb.txt", colors);
  sequence_.write("depth.txt", depths);
  EXPECT_THAT(order_finding(sequence_.folder()).value_or(Finding()).text(),
              HasSubstr("(view2.png follows view19.png)"));
  EXPECT_THAT(untrusted(), HasSubstr("as if the list had been sorted as text"));
}

TEST_F(Doctor, ReportsAMissingCamera) {
  fs::remove(sequence_.path("camera.yaml"));
  EXPECT_THAT(errors(), HasSubstr("no camera was named"));
  sequence_.write("camera.yaml", "fx: -1\n");
  EXPECT_THAT(errors(), HasSubstr("camera.yaml"));
  EXPECT_GT(diagnose().findings.size(), 3u);  // The other checks still run.
}

TEST_F(Doctor, DetectsAnotherImageSize) {
  Camera camera = TestSequence::camera();
  camera.width = 128;
  write_camera(sequence_.path("camera.yaml"), camera);
  EXPECT_THAT(errors(), HasSubstr("is 64 x 48 pixels where the camera has 128 x 48"));
}

TEST_F(Doctor, CountsMissingTruncatedAndWrongFiles) {
  fs::rename(sequence_.path("rgb/1.png"), sequence_.path("rgb/1.jpg"));
  fs::remove(sequence_.path("depth/5.png"));
  sequence_.truncate("depth/2.png", 0.7);
  sequence_.write_image("depth/3.png", cv::Mat(48, 64, CV_8UC1, cv::Scalar(9)));
  const std::string text = warnings();
  EXPECT_THAT(
      text,
      HasSubstr("2 files, the first: rgb/1.png is missing -> the list should name rgb/1.jpg"));
  EXPECT_THAT(text, HasSubstr("depth/2.png is truncated"));
  EXPECT_THAT(text, HasSubstr("depth/3.png has 1 channel of 8 bits"));
  EXPECT_EQ(diagnose().usable_frames, 8u);
}

TEST_F(Doctor, DoubtsARecordingOfWhichManyFramesAreUnusable) {
  for (int i : {1, 2}) fs::remove(sequence_.path(TestSequence::color_name(i)));
  EXPECT_THAT(warnings(), HasSubstr("2 files, the first: rgb/1.png is missing")) << "a sixth";
  EXPECT_EQ(untrusted(), "");
  fs::remove(sequence_.path(TestSequence::color_name(3)));
  EXPECT_THAT(untrusted(), HasSubstr("3 files, the first: rgb/1.png is missing")) << "a quarter";
}

TEST_F(Doctor, DoubtsAClockThatWasSetBack) {
  const auto set_back = [](double t) { return t < 100.25 ? t : t - 0.15; };  // 4 of 12 are skipped
  restamp("rgb.txt", "rgb", set_back);
  restamp("depth.txt", "depth", set_back);
  EXPECT_THAT(untrusted(), HasSubstr("lines of the lists without a frame; the first:"));
}

TEST_F(Doctor, DetectsOtherTimeUnitsGapsAndRates) {
  restamp("rgb.txt", "rgb", [](double t) { return t * 1e9; });
  restamp("depth.txt", "depth", [](double t) { return t * 1e9; });
  EXPECT_THAT(errors(), HasSubstr("nanoseconds"));
  const auto with_gap = [](double t) { return t < 100.2 ? t : t + 1; };
  restamp("rgb.txt", "rgb", with_gap);
  restamp("depth.txt", "depth", with_gap);
  EXPECT_THAT(warnings(), HasSubstr("gaps in the timestamps: 1, the longest 1.033 s"));
  const auto slow = [](double t) { return 100 + 3 * (t - 100); };
  restamp("rgb.txt", "rgb", slow);
  restamp("depth.txt", "depth", slow);
  EXPECT_THAT(warnings(), HasSubstr("set fps to 10"));
}

TEST_F(Doctor, DetectsDelayedDepth) {
  restamp("depth.txt", "depth", [](double t) { return t + 0.015; });
  EXPECT_THAT(warnings(), HasSubstr("depth is 15.0 ms after color"));
}

TEST_F(Doctor, ChecksTheImages) {
  const cv::Mat dark(48, 64, CV_8UC3, cv::Scalar::all(3));
  cv::Mat sparse(48, 64, CV_16UC1, cv::Scalar(0));
  sparse.rowRange(0, 8).setTo(10000);
  for (int i = 0; i < 12; ++i) {
    sequence_.write_image(TestSequence::color_name(i), dark);
    sequence_.write_image(TestSequence::depth_name(i), sparse);
  }
  EXPECT_THAT(warnings(), HasSubstr("12 of 12 sampled color images are nearly black"));
  EXPECT_THAT(warnings(), HasSubstr("blurred or without texture"));
  EXPECT_THAT(warnings(), HasSubstr("17 % of the pixels have depth"));
  for (int i = 0; i < 12; ++i) {
    sequence_.write_image(TestSequence::depth_name(i), cv::Mat(48, 64, CV_16UC1, cv::Scalar(0)));
  }
  EXPECT_THAT(errors(), HasSubstr("contain no depth"));
}

TEST_F(Doctor, ComparesTheGroundTruthWithTheImages) {
  sequence_.write("groundtruth.txt", "5 0 0 0 0 0 0 1\n6 0 0 0 0 0 0 1\n");
  EXPECT_THAT(warnings(), HasSubstr("it runs from 5.000 to 6.000 s, the images from 100.000"));
  std::string truth;
  for (int i = 0; i < 8; ++i) {
    truth += fmt::format("{:.6f} {} 0 0 0 0 0 1\n", TestSequence::stamp(i), i < 5 ? 0 : 1);
  }
  sequence_.write("groundtruth.txt", truth);
  EXPECT_THAT(warnings(), HasSubstr("66.7 % of the frames"));
  EXPECT_THAT(warnings(), HasSubstr("(faster than 3 m/s): 1, the first at 100.166667"));
  sequence_.write("groundtruth.txt", "100 0 0 0 0\n");
  EXPECT_THAT(warnings(), HasSubstr("groundtruth.txt:1: expected 8 numbers"));
  EXPECT_EQ(errors(), "");
}

TEST_F(Doctor, CountsMasks) {
  fs::create_directories(sequence_.path("mask"));
  sequence_.write_image("mask/0.png", cv::Mat(48, 64, CV_8UC1, cv::Scalar(0)));
  EXPECT_THAT(warnings(), HasSubstr("mask/ holds masks for 1 of 12 frames"));
}

}  // namespace
}  // namespace stillmap
