// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/calibrate_recording.hpp"

#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/sensor/depth_image.hpp"
#include "stillmap/sensor/tum_folder.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// Disparity offset of the rendered sensor [pixels], and [1/m].
constexpr double kOffsetPixels = 1.5;
double offset() {
  const DepthSensor& sensor = find_depth_sensor("kinect_v1");
  return kOffsetPixels / (sensor.focal * sensor.baseline);
}

/// Frames of a rendered sequence as a recording: the depth is corrected as the camera says.
class RenderedSource final : public FrameSource {
 public:
  RenderedSource(const std::vector<RgbdFramePtr>& frames, const Camera& recorded)
      : frames_(frames), bias_(recorded.disparity_bias), camera_(recorded) {
    camera_.disparity_bias = {};
  }
  const Camera& camera() const override { return camera_; }
  RgbdFramePtr next() override {
    if (next_ == frames_.size()) return nullptr;
    auto frame = std::make_shared<RgbdFrame>(*frames_[next_++]);
    frame->depth = frame->depth.clone();
    correct_disparity(bias_, camera_, frame->depth);
    return frame;
  }
  std::optional<std::size_t> size() const override { return frames_.size() - next_; }
  const std::vector<SkippedFrame>& skipped() const override { return skipped_; }

 private:
  const std::vector<RgbdFramePtr>& frames_;
  DisparityBias bias_;
  Camera camera_;
  std::size_t next_ = 0;
  std::vector<SkippedFrame> skipped_;
};

struct Rendered {
  Camera camera;
  std::vector<RgbdFramePtr> frames;
};

Rendered rendered(const std::string& motion, double offset_pixels) {
  SimulationOptions options;
  options.people = 0;
  options.camera = motion;
  options.frames = 120;
  options.width = 320;
  options.height = 240;
  options.depth_bias.offset = offset_pixels;
  const SimulatedSequence sequence(options);
  Rendered result{sequence.camera(), {}};
  for (std::size_t i = 0; i < sequence.frames(); ++i) result.frames.push_back(sequence.frame(i));
  return result;
}

CalibrationReport calibrate(const Rendered& recording, const Camera& given) {
  const auto open = [&](const Camera& camera) {
    return std::make_unique<RenderedSource>(recording.frames, camera);
  };
  return calibrate_recording(open, given, parameters_of(read_options("static")));
}

/// Returns the calibration of a recording from a camera whose focal lengths are wrong by a factor.
CalibrationReport calibrate_from(const Rendered& recording, double focal_factor) {
  Camera given = recording.camera;
  given.fx *= focal_factor, given.fy *= focal_factor;
  return calibrate(recording, given);
}

const CalibratedParameter& find(const CalibrationReport& report, const std::string& key) {
  return *std::find_if(report.parameters.begin(), report.parameters.end(),
                       [&](const auto& p) { return p.key == key; });
}

TEST(CalibrateRecording, FindsTheDisparityOffset) {
  const Rendered recording = rendered("loop", kOffsetPixels);
  const CalibrationReport report = calibrate(recording, recording.camera);
  const CalibratedParameter& p = find(report, "disparity_offset");
  EXPECT_EQ(p.verdict, CalibrationVerdict::kCorrected);
  EXPECT_NEAR(p.estimated, offset(), 3 * p.sigma);
  EXPECT_LT(p.sigma, 0.2 * offset());
  EXPECT_EQ(report.camera.disparity_bias.offset, p.estimated);
  EXPECT_THAT(calibration_findings(report),
              testing::Contains(testing::HasSubstr("% short at 4 m")));
}

TEST(CalibrateRecording, FindsIntrinsicsOffByOnePercent) {
  const Rendered recording = rendered("rpy", 0);
  const CalibrationReport report = calibrate_from(recording, 1.01);
  for (const char* key : {"fx", "fy"}) {
    const CalibratedParameter& p = find(report, key);
    EXPECT_NEAR(p.estimated, recording.camera.fx, 3 * p.sigma) << key;
    EXPECT_LT(p.sigma, 0.01 * recording.camera.fx) << key;
  }
}

TEST(CalibrateRecording, FindsFocalLengthsThatAreWrongByAQuarter) {
  const Rendered recording = rendered("rpy", 0);
  const CalibrationReport report = calibrate_from(recording, 1.25);
  for (const char* key : {"fx", "fy"}) {
    const CalibratedParameter& p = find(report, key);
    EXPECT_EQ(p.verdict, CalibrationVerdict::kCorrected) << key;
    EXPECT_NEAR(p.estimated, recording.camera.fx, 0.05 * recording.camera.fx) << key;
  }
}

TEST(CalibrateRecording, KeepsTheOtherFocalLengthIfOneIsWrong) {
  const Rendered recording = rendered("rpy", 0);
  Camera given = recording.camera;
  given.fx *= 1.15;
  const CalibrationReport report = calibrate(recording, given);
  EXPECT_EQ(find(report, "fx").verdict, CalibrationVerdict::kCorrected);
  for (const double f : {report.camera.fx, report.camera.fy})
    EXPECT_NEAR(f, recording.camera.fx, 0.04 * recording.camera.fx);
}

TEST(CalibrateRecording, KeepsThePerfectCamera) {
  const Rendered recording = rendered("loop", 0);
  const CalibrationReport report = calibrate(recording, recording.camera);
  EXPECT_EQ(report.camera.fx, recording.camera.fx);
  EXPECT_EQ(report.camera.cx, recording.camera.cx);
  EXPECT_EQ(report.camera.disparity_bias, DisparityBias{});
  EXPECT_EQ(report.camera.shutter, recording.camera.shutter);
  EXPECT_EQ(find(report, "disparity_bow").verdict, CalibrationVerdict::kKept);
  EXPECT_TRUE(calibration_findings(report).empty());
}

TEST(CalibrateRecording, ACameraAtRestShowsNoIntrinsics) {
  const Rendered recording = rendered("static", kOffsetPixels);
  const CalibrationReport report = calibrate(recording, recording.camera);
  for (const char* key : {"fx", "fy", "cx", "cy", "disparity_offset"})
    EXPECT_EQ(find(report, key).verdict, CalibrationVerdict::kNotObservable) << key;
}

/// Returns the camera errors that a run with this camera finds.
CameraErrors errors_with(const Rendered& recording, const Camera& given) {
  SlamSystem slam(given, parameters_of(read_options("static")));
  for (const RgbdFramePtr& frame : recording.frames) slam.push(frame);
  return slam.finish().camera_errors;
}

/// Returns the focal length that fits the map of a run with focal lengths wrong by a factor.
std::optional<double> fitting_focal_length(const Rendered& recording, double focal_factor) {
  Camera given = recording.camera;
  given.fx *= focal_factor, given.fy *= focal_factor;
  return errors_with(recording, given).focal_length;
}

TEST(CameraCheck, ARunTellsFocalLengthsThatAreWrongByFifteenPercent) {
  const Rendered recording = rendered("rpy", 0);
  EXPECT_FALSE(fitting_focal_length(recording, 1));
  for (const double factor : {0.85, 1.15}) {
    const double given = factor * recording.camera.fx;
    const auto fitting = fitting_focal_length(recording, factor);
    ASSERT_TRUE(fitting) << factor;
    EXPECT_LT(std::abs(*fitting - recording.camera.fx),
              0.6 * std::abs(given - recording.camera.fx));
  }
}

TEST(CameraCheck, ARunTellsAPrincipalPointThatIsWrongByATenthOfTheWidth) {
  const Rendered recording = rendered("rpy", 0);
  EXPECT_FALSE(errors_with(recording, recording.camera).center);
  Camera given = recording.camera;
  given.cx += 32;
  const auto center = errors_with(recording, given).center;
  ASSERT_TRUE(center);
  EXPECT_NEAR(center->x(), recording.camera.cx, 16);
  EXPECT_NEAR(center->y(), recording.camera.cy, 8);
}

/// Returns the camera errors that a run finds.
/// @param distances  whether the depths are replaced by distances from the camera
CameraErrors errors_of_run(const Rendered& recording, bool distances) {
  const Camera& c = recording.camera;
  SlamSystem slam(c, parameters_of(read_options("static")));
  for (const RgbdFramePtr& frame : recording.frames) {
    RgbdFrame changed = *frame;
    changed.depth = frame->depth.clone();
    for (int v = 0; distances && v < c.height; ++v) {
      for (int u = 0; u < c.width; ++u)
        changed.depth.at<float>(v, u) *=
            static_cast<float>(std::hypot(1, (u - c.cx) / c.fx, (v - c.cy) / c.fy));
    }
    slam.push(std::make_shared<const RgbdFrame>(changed));
  }
  return slam.finish().camera_errors;
}

TEST(CameraCheck, ARunTellsDistancesInPlaceOfDepths) {
  const Rendered recording = rendered("rpy", 0);
  EXPECT_FALSE(errors_of_run(recording, false).disparity_bow);
  const auto bow = errors_of_run(recording, true).disparity_bow;
  ASSERT_TRUE(bow);
  EXPECT_LT(*bow, -0.03);
  EXPECT_GT(*bow, -0.5);
}

TEST(CameraCheck, ACameraAtRestShowsNone) {
  EXPECT_FALSE(fitting_focal_length(rendered("static", kOffsetPixels), 1));
}

}  // namespace
}  // namespace stillmap
