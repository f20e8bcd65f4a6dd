// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/run_findings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// Returns the record of a good run of ten frames.
RunDetails good_run() {
  RunDetails record;
  record.options = read_options("fused");
  record.frames = 10;
  for (int i = 0; i < 10; ++i) {
    FrameRecord frame;
    frame.state = TrackState::kTracking;
    record.result.frames.push_back(frame);
    record.result.trajectory.push_back({static_cast<double>(i), Pose()});
  }
  record.result.keyframes = record.result.trajectory;
  record.result.maps = 1;
  record.result.segmented = 10;
  record.result.dense.cloud.points.resize(100);
  record.result.dense.cloud.colors.resize(100);
  return record;
}

std::vector<std::string> texts(const RunDetails& run) { return texts_of(run_findings(run)); }

TEST(RunFindings, ThereAreNoneAboutAGoodRun) { EXPECT_THAT(texts(good_run()), IsEmpty()); }

TEST(RunFindings, FewFramesWithAPoseAreToldWithTheMainReason) {
  RunDetails record = good_run();
  record.result.trajectory.resize(5);
  EXPECT_THAT(texts(record), IsEmpty()) << "half of them is enough";
  record.result.trajectory.resize(4);
  record.result.frames[1].reason = "too dark";
  record.result.frames[2].reason = record.result.frames[3].reason = "too few keypoints";
  EXPECT_THAT(texts(record),
              ElementsAre(HasSubstr("4 of 10 frames have a pose (most often: too few keypoints)")));
  EXPECT_THAT(texts(RunDetails{}), ElementsAre(HasSubstr("0 of 0 frames")));
  RunDetails one;
  one.frames = 1;
  EXPECT_THAT(texts(one), ElementsAre(HasSubstr("0 of 1 frame has a pose")));
  record.loaded = LoadedMap{.file = "office.map", .extended = false};
  EXPECT_THAT(texts(record), ElementsAre(HasSubstr("if the camera was in the place of the")));
  record = good_run();
  record.skipped.resize(12, {.timestamp = 7, .reason = "rgb/7.png is damaged"});
  EXPECT_THAT(
      texts(record),
      Contains(HasSubstr("10 of 22 frames have a pose (most often: rgb/7.png is damaged)")));
}

TEST(RunFindings, ALongGapOfTheTrajectoryIsTold) {
  RunDetails record = good_run();
  for (int i = 10; i < 150; ++i) {
    FrameRecord frame;
    const bool lost = i >= 40 && i < 55;
    frame.timestamp = i;
    frame.state = lost ? TrackState::kLost : TrackState::kTracking;
    if (lost) frame.reason = "too dark";
    record.result.frames.push_back(frame);
    if (!lost) record.result.trajectory.push_back({static_cast<double>(i), Pose()});
  }
  record.frames = 150;
  EXPECT_THAT(texts(record),
              ElementsAre(HasSubstr("15 frames in a row have no pose, from 40.000000 s on (too "
                                    "dark)")));
  record.result.frames[50].state = TrackState::kTracking;
  EXPECT_THAT(texts(record), IsEmpty());
}

TEST(RunFindings, FramesThatCouldNotBeReadCount) {
  RunDetails record = good_run();
  record.frames = 10;
  record.skipped.resize(11, {.timestamp = 2, .reason = "is out of order"});
  EXPECT_THAT(texts(record),
              ElementsAre(HasSubstr("10 of 21 frames have a pose"),
                          HasSubstr("11 of 21 frames of the recording could not be used; the "
                                    "first: 2.000000: is out of order")));
  for (SkippedFrame& skipped : record.skipped) skipped.frame_lost = false;
  EXPECT_THAT(texts(record), IsEmpty()) << "only their depth is missing";
}

TEST(RunFindings, ManyUnusableFramesAreToldButNotThoseOfALateReader) {
  RunDetails record = good_run();
  record.frames = 16;
  record.skipped.resize(4, {.timestamp = 2, .reason = "is out of order"});
  EXPECT_THAT(texts(record), IsEmpty()) << "a fifth";
  record.frames = 10;
  EXPECT_THAT(texts(record), ElementsAre(HasSubstr("4 of 14 frames of the recording")));
  for (SkippedFrame& skipped : record.skipped) skipped.late = true;
  EXPECT_LT(worst(run_findings(record)), Severity::kUntrusted) << "dropped from a live camera";
}

TEST(RunFindings, DroppedFramesAreToldWithTheirReason) {
  RunDetails record = good_run();
  record.dropped.resize(11);
  EXPECT_THAT(texts(record), ElementsAre(HasSubstr("10 of 21 frames have a pose: 11 were "
                                                   "dropped")));
  EXPECT_THAT(texts(record), Not(ElementsAre(HasSubstr("network.mask_delay"))));
  record.options.network.mask_delay = 0;
  EXPECT_THAT(texts(record), ElementsAre(HasSubstr("--set network.mask_delay=-1")));
}

TEST(RunFindings, ManyLateFramesOfARunThatTrackedMostAreANote) {
  RunDetails record = good_run();
  record.dropped.resize(2);
  EXPECT_THAT(run_findings(record), IsEmpty()) << "a sixth";
  record.dropped.resize(8);
  const std::vector<Finding> findings = run_findings(record);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].code, "late-frames");
  EXPECT_EQ(findings[0].severity, Severity::kNote);
  EXPECT_THAT(findings[0].text(),
              AllOf(HasSubstr("8 of 18 frames have no pose"), HasSubstr("--schedule lockstep")));
  record.dropped.resize(11);
  EXPECT_THAT(texts(record), ElementsAre(HasSubstr("11 were dropped"))) << "low-coverage only";
  record.dropped.clear();
  record.skipped.resize(8, {.timestamp = 2, .reason = "dropped", .late = true});
  EXPECT_THAT(texts(record), ElementsAre(HasSubstr("lower frame rate")));
}

TEST(RunFindings, AFocalLengthIsNamedOnlyIfItIsPlausible) {
  RunDetails record = good_run();
  record.result.camera.fx = record.result.camera.fy = 500;
  record.result.camera_errors.focal_length = 600;
  EXPECT_THAT(texts(record), ElementsAre(HasSubstr("500 pixels are given, and about 600")));
  record.result.camera_errors.focal_length = 45;
  EXPECT_THAT(texts(record), ElementsAre(HasSubstr("no focal length near the given one")));
}

TEST(RunFindings, DistancesInPlaceOfDepthsAreTold) {
  RunDetails record = good_run();
  record.result.camera_errors.disparity_bow = -0.1;
  EXPECT_THAT(texts(record), ElementsAre(AllOf(HasSubstr("2.00 m away are 2.50 m there"),
                                               HasSubstr("distances from the camera"))));
}

TEST(RunFindings, UncertainPosesUnconnectedMapsAndAnEmptyMapAreTold) {
  RunDetails record = good_run();
  for (const std::size_t i : {1, 2, 3})
    record.result.frames[i].uncertainty = Uncertainty::kContradiction;
  EXPECT_THAT(texts(record), ElementsAre(HasSubstr("3 of 10 poses contradict the motion")));
  for (const std::size_t i : {1, 2, 3})
    record.result.frames[i].uncertainty = Uncertainty::kMinority;
  EXPECT_THAT(texts(record), IsEmpty());
  record = good_run();
  record.result.maps = 2;
  EXPECT_THAT(texts(record), ElementsAre(HasSubstr("2 maps that are not connected")));
  record.result.keyframes.clear();
  record.result.frames_by_map = {{1, 10}};
  EXPECT_THAT(texts(record), IsEmpty()) << "localized in one of a saved map's";
  record = good_run();
  record.result.dense.cloud = {};
  EXPECT_THAT(texts(record), ElementsAre(HasSubstr("dense map is empty")));
  record.options.dense.enabled = false;
  EXPECT_THAT(texts(record), IsEmpty());
}

TEST(RunFindings, ALoadedMapWithoutACloudIsNoneOfARunThatOnlyLocalizes) {
  RunDetails record = good_run();
  record.result.dense.cloud = {};
  record.result.keyframes.clear();
  EXPECT_THAT(texts(record), IsEmpty());
}

TEST(RunFindings, MasksOfAnotherRecordingAreTold) {
  RunDetails record = good_run();
  record.result.detector_failures = 5;
  record.result.detector_skipped = "5 frames without a mask";
  EXPECT_THAT(texts(record), IsEmpty());
  record.result.detector_failures = 6;
  EXPECT_THAT(texts(record), ElementsAre(HasSubstr("6 of 10 frames have no usable mask")));
  const auto severity = [&] { return worst(run_findings(record)); };
  EXPECT_EQ(severity(), Severity::kWarning) << "this preset finds moving objects without masks";
  record.result.detector_failures = 10;
  EXPECT_EQ(severity(), Severity::kUntrusted) << "none is of this recording";
  record.result.detector_failures = 6;
  record.options = read_options("seg-mask");
  EXPECT_EQ(severity(), Severity::kUntrusted) << "this preset needs masks";
}

TEST(RunFindings, ANetworkWithoutMasksIsToldForThePresetsThatNeedThem) {
  RunDetails record = good_run();
  record.detector_gives_boxes_only = true;
  EXPECT_THAT(texts(record), IsEmpty());
  record.options = read_options("seg-mask");
  record.detector = "a network";
  EXPECT_THAT(texts(record), ElementsAre(HasSubstr("boxes only")));
}

TEST(RunFindings, APaperPresetWithoutItsDetectorIsTold) {
  RunDetails record = good_run();
  for (const char* preset : {"seg-mask", "box-flow", "gated-seg", "box-epipolar"}) {
    record.options = read_options(preset);
    EXPECT_THAT(texts(record), ElementsAre(HasSubstr("neither a network nor masks"))) << preset;
  }
  record.detector = "a network";
  EXPECT_THAT(texts(record), IsEmpty());
}

TEST(RunFindings, MasksThatDoNotBelongToTheImagesAreTold) {
  RunDetails record = good_run();
  record.result.detector_finding = make_finding("masks-unrelated", "of another moment");
  EXPECT_THAT(run_findings(record), ElementsAre(*record.result.detector_finding));
}

TEST(RunFindings, APlaceThatOnlyLooksLikeTheLoadedMapIsTold) {
  RunDetails record = good_run();
  record.result.texture = {.regions = 100, .alike = 29};
  EXPECT_THAT(run_findings(record), ElementsAre(testing::Field(&Finding::code, "another-place")));
  EXPECT_THAT(texts(record), ElementsAre(HasSubstr("29 % of the descriptors")));
  record.result.texture.regions = 99;
  EXPECT_THAT(texts(record), IsEmpty()) << "too few regions";
  record.result.texture = {.regions = 100, .alike = 31};
  EXPECT_THAT(texts(record), IsEmpty());
}

TEST(RunFindings, PosesThatFollowWhatTheCameraCarries) {
  RunDetails record = good_run();
  record.result.carried_parts = make_finding("carried-parts", "the poses follow the robot");
  EXPECT_THAT(run_findings(record), ElementsAre(*record.result.carried_parts));
}

TEST(RunFindings, ACloudOfAFewPointsIsTold) {
  RunDetails record = good_run();
  record.result.dense.cloud.points.resize(27);
  record.result.dense.cloud.colors.resize(27);
  EXPECT_THAT(texts(record), IsEmpty()) << "of ten frames";
  while (record.result.trajectory.size() < 30)
    record.result.trajectory.push_back(record.result.trajectory.back());
  record.frames = 30;
  EXPECT_THAT(texts(record), ElementsAre(HasSubstr("only 27 points")));
}

TEST(RunFindings, IntrinsicsThatHardlyAnyCameraHasAreTold) {
  RunDetails record = good_run();
  const Camera usual{.width = 640, .height = 480, .fx = 525, .fy = 524, .cx = 319, .cy = 239};
  record.result.camera = usual;
  EXPECT_THAT(texts(record), IsEmpty());
  const auto told = [&](double Camera::*parameter, double value) {
    record.result.camera = usual;
    record.result.camera.*parameter = value;
    EXPECT_THAT(texts(record), ElementsAre(HasSubstr("intrinsics"))) << value;
  };
  told(&Camera::fx, 52.5);
  told(&Camera::fy, 5240);
  told(&Camera::cx, 31.9);
  told(&Camera::cy, 479);
}

TEST(RunFindings, ExchangedCoordinatesOfThePrincipalPointAreTold) {
  RunDetails record = good_run();
  record.result.camera = {
      .width = 640, .height = 480, .fx = 517, .fy = 516, .cx = 255.3, .cy = 318.6};
  record.result.camera_errors.center = {320, 250};
  EXPECT_THAT(texts(record), ElementsAre(HasSubstr("with cx and cy exchanged")));
  record.result.camera.cx = 400;
  EXPECT_THAT(texts(record), ElementsAre(HasSubstr("about (320, 250) fits better")));
  record.result.camera_errors.center.reset();
  EXPECT_THAT(texts(record), IsEmpty()) << "images cut out of larger ones";
}

TEST(RunFindings, AShortTimeWithoutDepthAtTheStartIsNone) {
  RunDetails record = good_run();
  const SkippedFrame skipped{.timestamp = 99.5, .reason = "no depth image, and none before"};
  record.result.frames.front().timestamp = 100;
  record.skipped.resize(9, skipped);
  EXPECT_THAT(texts(record), IsEmpty());
  record.skipped.front().timestamp = record.skipped.back().timestamp = 100.5;
  record.skipped[1].timestamp = record.skipped[2].timestamp = 101;
  EXPECT_THAT(texts(record), ElementsAre(HasSubstr("9 of 19 frames"))) << "four during the run";
}

}  // namespace
}  // namespace stillmap
