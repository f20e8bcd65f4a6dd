// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/report_page.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/report/report_charts.hpp"
#include "stillmap/report/svg.hpp"

#include <cmath>
#include <regex>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

Trajectory path(double wobble) {
  Trajectory trajectory;
  for (int i = 0; i < 120; ++i) {
    const double t = 50 + i / 30.0;
    trajectory.push_back(
        {t, Pose(so3_exp({0, 0.1 * std::sin(t), 0}),
                 {std::sin(t), 0.1 * std::cos(t) + wobble * std::sin(11 * t), t - 50})});
  }
  return trajectory;
}

cv::Mat small_image() { return {60, 80, CV_8UC3, cv::Scalar(40, 120, 200)}; }

/// Returns the record of a run that lost frames 40 to 59, with all parts of a report.
RunRecord full_record() {
  RunRecord record;
  record.sequence = "rooms/<kitchen> & co";
  record.machine = "AMD EPYC, 2 cores";
  record.options = read_options("seg-mask");
  record.options.network.model = "<b>&.onnx";
  record.truth = path(0);
  SlamResult& result = record.result;
  result.trajectory = path(0.01);
  result.trajectory.erase(result.trajectory.begin() + 40, result.trajectory.begin() + 60);
  for (std::size_t i = 0; i < record.truth->size(); ++i) {
    FrameRecord frame;
    frame.index = i;
    frame.timestamp = (*record.truth)[i].timestamp;
    frame.state = i >= 40 && i < 60 ? TrackState::kLost : TrackState::kTracking;
    frame.reason = frame.state == TrackState::kLost ? "too few matches" : "";
    result.frames.push_back(frame);
  }
  result.keyframes = {{50.0, Pose()}, {51.0, Pose()}, {53.0, Pose()}};
  result.landmarks = 18204;
  result.maps = 1;
  result.dense.cloud.points.resize(1234567);
  for (int i = 0; i < 100; ++i) result.timing.add("tracking", 8 + 0.02 * i);
  result.timing.add("segment <net>", 55);
  result.detector_skipped = "2 frames without a mask, 0 masks broken or of another size";
  MoverTrack mover;
  mover.id = 1;
  mover.class_name = "person";
  mover.samples.resize(3);
  result.movers = {mover};
  record.frames = 120;
  record.seconds = 4;
  record.skipped = {{50.2, "depth image missing"}, {50.3, "depth image missing"}};
  record.gallery = {{small_image(), "frame 12: 900 inlier landmarks"}};
  evaluate_run(record);
  return record;
}

ReportImages all_images() {
  return {CaptionedImage{small_image(), "static cloud"},
          CaptionedImage{small_image(), "movers"},
          {{small_image(), "ghosts"}},
          {"trajectory.txt", "labels/100 %.png"}};
}

/// Returns whether every opened element is closed in order, except void elements.
std::string unbalanced_element(const std::string& html) {
  std::vector<std::string> open;
  const std::regex tag("<(/?)([a-zA-Z][a-zA-Z0-9]*)([^>]*)>");
  for (auto i = std::sregex_iterator(html.begin(), html.end(), tag); i != std::sregex_iterator();
       ++i) {
    const std::string name = (*i)[2], rest = (*i)[3];
    if (name == "meta" || name == "img" || (!rest.empty() && rest.back() == '/')) continue;
    if ((*i)[1].length() == 0) {
      open.push_back(name);
    } else if (open.empty() || open.back() != name) {
      return name;
    } else {
      open.pop_back();
    }
  }
  return open.empty() ? "" : open.back();
}

TEST(EscapeMarkup, LeavesNothingThatCouldBeMarkup) {
  EXPECT_EQ(escape_markup("<a href=\"x\">&'"), "&lt;a href=&quot;x&quot;&gt;&amp;&#39;");
  EXPECT_EQ(escape_markup("K\u00fcche \u2026"), "K\u00fcche \u2026");
  EXPECT_EQ(escape_markup("bad\xff\xc3"), "bad??");
  EXPECT_EQ(escape_markup(std::string("a\0b", 3)), "a b");
}

TEST(Report, ShowsEverythingThatItIsGiven) {
  const std::string html = report_html(full_record(), all_images());
  for (const char* part : {"from above",
                           "from the side",
                           "Error over time",
                           "Coverage",
                           "100 of 122 frames tracked",
                           "lost: 20 frames",
                           "lost: too few matches",
                           "Time per stage",
                           "Static map",
                           "static cloud",
                           "Moving objects: 1",
                           "900 inlier landmarks",
                           "2 frames without a mask",
                           "ghosts",
                           "Skipped images and lines: 2",
                           "depth image missing",
                           "Options in force",
                           "moving keypoint, not used for the pose",
                           "href=\"trajectory.txt\"",
                           "href=\"labels/100%20%25.png\"",
                           "1\u202f234\u202f567",
                           "1.23\u2009M",
                           "30.0",
                           "9.0"}) {
    EXPECT_THAT(html, HasSubstr(part));
  }
}

/// Returns the record of a run with a dynamics gate, whose scene is highly dynamic from 1 to 2 s.
RunRecord gated_record() {
  RunRecord record = full_record();
  for (FrameRecord& frame : record.result.frames)
    frame.dynamics = frame.index >= 30 && frame.index < 60 ? Dynamics::kHigh : Dynamics::kLow;
  return record;
}

TEST(Report, ShowsWhenTheSceneWasHighlyDynamic) {
  const std::string page = report_html(gated_record(), all_images());
  EXPECT_THAT(page, HasSubstr("high dynamics, 1.00 to 2.00 s"));
  EXPECT_THAT(page, HasSubstr("low dynamics, 0.00 to 1.00 s"));
  EXPECT_THAT(report_html(full_record(), all_images()), Not(HasSubstr("dynamics,")));
}

TEST(DynamicsPeriods, EndWhereTheVerdictChanges) {
  const auto periods = dynamics_periods(gated_record().result);
  ASSERT_EQ(periods.size(), 3U);
  EXPECT_EQ(periods[1].dynamics, Dynamics::kHigh);
  EXPECT_DOUBLE_EQ(periods[1].begin, 51);
  EXPECT_DOUBLE_EQ(periods[1].end, 52);
  EXPECT_TRUE(dynamics_periods(full_record().result).empty());
}

TEST(RunEvents, TellEachChangeOfTheDynamics) {
  std::vector<std::string> texts;
  for (const RunEvent& event : run_events(gated_record().result)) {
    if (event.text.find("dynamic") != std::string::npos) texts.push_back(event.text);
  }
  EXPECT_THAT(texts,
              ::testing::ElementsAre("scene highly dynamic", "scene no longer highly dynamic"));
}

TEST(FramesCsv, HasALinePerFrame) {
  RunRecord record = gated_record();
  record.result.frames.resize(31);
  FrameRecord& last = record.result.frames.back();
  last.keypoints = 900;
  last.moving_keypoints = 40;
  last.inliers = 300;
  last.mask_age = 2;
  last.keyframe = true;
  last.component = 0;
  const std::string csv = frames_csv(record.result);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 32);
  EXPECT_THAT(csv, HasSubstr("frame,timestamp,state,keypoints,moving,inliers,mask_age,uncertain,"
                             "keyframe,highly_dynamic,component\n"));
  EXPECT_THAT(csv, ::testing::EndsWith("\n30,51.000000,tracking,900,40,300,2,0,1,1,0\n"));
  record.result.frames.back().dynamics = Dynamics::kUnknown;
  record.result.frames.back().component.reset();
  EXPECT_THAT(frames_csv(record.result), ::testing::EndsWith(",0,1,,\n"));
}

TEST(Report, ShowsTheErrorOfTheEvaluation) {
  const RunRecord record = full_record();
  ASSERT_TRUE(record.evaluation) << record.evaluation_problem;
  const double rmse = record.evaluation->ate.translation.rmse;
  EXPECT_THAT(report_html(record), HasSubstr(fmt::format("RMSE {:.1f} mm", 1000 * rmse)));
  EXPECT_THAT(report_html(record), HasSubstr(fmt::format("<b>{:.4f}</b>", rmse)));
}

/// Returns the record of a run of which every second frame was dropped.
RunRecord late_record() {
  RunRecord record = full_record();
  record.result.trajectory = path(0.01);
  record.skipped.clear();
  for (std::size_t i = 1; i < record.result.frames.size(); ++i)
    record.dropped.push_back(record.result.frames[i].timestamp - 1 / 60.0);
  evaluate_run(record);
  return record;
}

TEST(Report, DroppedFramesAreNoTrackedOnes) {
  const std::string html = report_html(late_record());
  EXPECT_THAT(html, HasSubstr("120 of 239 frames tracked, 119 dropped late"));
  EXPECT_THAT(html, HasSubstr("<title>dropped: 1 frame, "));
  EXPECT_THAT(html, HasSubstr("</i>dropped late</span>"));
  double green = 0;  // pixels of the strip, which is 900 wide
  const std::regex bar("width=\"([0-9.]+)\" height=\"26.0\"[^>]*class=\"tracked\"");
  for (auto i = std::sregex_iterator(html.begin(), html.end(), bar); i != std::sregex_iterator();
       ++i)
    green += std::stod((*i)[1]);
  EXPECT_NEAR(green, 450, 10);
  EXPECT_THAT(report_html(full_record()), Not(HasSubstr("dropped late</span>")));
}

TEST(Report, FramesThatALiveCameraLostAreDroppedOnes) {
  RunRecord record = full_record();
  record.skipped = {{.timestamp = 51.01, .reason = "dropped", .late = true}};
  EXPECT_THAT(report_html(record), HasSubstr("dropped: 1 frame, 1.01 to"));
}

TEST(Report, TheTruthIsDrawnDuringTheRunOnly) {
  RunRecord record = full_record();
  const std::string before = trajectory_chart(record, PathView::kFromAbove);
  for (int i = 1; i < 100; ++i)
    record.truth->push_back({54 + i / 30.0, Pose(Eigen::Quaterniond::Identity(), {0, 0, 9.0 * i})});
  EXPECT_EQ(trajectory_chart(record, PathView::kFromAbove), before);
}

TEST(Report, TellsTheWarningsOfTheRun) {
  RunRecord record = full_record();
  record.warnings = {{51.5, "person 3 is in zone <gate>"}};
  const std::string html = report_html(record);
  EXPECT_THAT(html, HasSubstr("Warnings and changes: 1"));
  EXPECT_THAT(html, HasSubstr("1.50 s</td><td class=\"text\">person 3 is in zone &lt;gate&gt;"));
  EXPECT_THAT(report_html(full_record()), Not(HasSubstr("Warnings and changes")));
}

TEST(Report, TellsWhenPosesAreUncertain) {
  RunRecord record = full_record();
  for (const std::size_t i : {30, 31, 32, 90})
    record.result.frames[i].uncertainty = Uncertainty::kContradiction;
  EXPECT_THAT(report_html(record), HasSubstr("4 uncertain poses (1.00 to 1.07 s, 3.00 s)"));
  EXPECT_THAT(run_summary_text(record), HasSubstr("4 uncertain poses (1.00 to 1.07 s, 3.00 s)"));
}

TEST(Report, HasOnePeakOfTheMemory) {
  RunRecord record = full_record();
  record.peak_memory_mib = 417;
  EXPECT_THAT(report_html(record), HasSubstr("417 MiB"));
  EXPECT_THAT(run_summary_text(record), HasSubstr("417 MiB peak"));
  EXPECT_EQ(run_summary_json(record)["peak_memory_mib"], 417);
}

TEST(Report, EscapesTextFromTheData) {
  const std::string html = report_html(full_record(), all_images());
  EXPECT_THAT(html, Not(HasSubstr("<kitchen>")));
  EXPECT_THAT(html, HasSubstr("&lt;kitchen&gt; &amp; co"));
  EXPECT_THAT(html, HasSubstr("segment &lt;net&gt;"));
}

TEST(Report, IsSelfContainedAndWellFormed) {
  const std::string html = report_html(full_record(), all_images());
  EXPECT_THAT(html, Not(HasSubstr("http")));
  EXPECT_THAT(html, Not(HasSubstr("<script")));
  EXPECT_THAT(html, Not(HasSubstr("<link")));
  EXPECT_FALSE(std::regex_search(html, std::regex("[ \",:(]-?nan[ \",;)]")));
  EXPECT_THAT(html, HasSubstr("data:image/jpeg;base64,/9j/"));  // every JPEG begins so
  EXPECT_EQ(unbalanced_element(html), "");
}

TEST(Report, LeavesOutPartsWithoutData) {
  const std::string empty = report_html({});
  EXPECT_EQ(unbalanced_element(empty), "");
  for (const char* part : {"<svg", "<img", "Coverage", "Skipped", "Moving objects", "Events"}) {
    EXPECT_THAT(empty.substr(empty.find("<body>")), Not(HasSubstr(part)));
  }
}

TEST(Report, DrawsThePathWithoutATruth) {
  RunRecord record;
  record.result.trajectory = path(0);
  const std::string html = report_html(record);
  EXPECT_THAT(html, HasSubstr("from above"));
  EXPECT_THAT(html, Not(HasSubstr("colored by its error")));
}

TEST(Report, ShowsDegenerateRuns) {
  RunRecord record;
  record.result.trajectory = {{5, Pose()}};  // one pose, no extent, no duration
  record.result.frames.resize(2);
  record.result.frames[0].timestamp = 5;
  record.result.frames[1].timestamp = 5.1;
  record.result.timing.add("idle", 0);
  const std::string html = report_html(record);
  EXPECT_FALSE(std::regex_search(html, std::regex("[ \",:(]-?nan[ \",;)]")));
  EXPECT_THAT(html, Not(HasSubstr("\"inf")));
  EXPECT_EQ(unbalanced_element(html), "");
}

TEST(Report, LongListsAreCutOffAndCounted) {
  RunRecord record;
  for (std::size_t i = 0; i < 1000; ++i) {
    MapEvent event;
    event.timestamp = static_cast<double>(i);
    record.result.events.push_back(event);
  }
  EXPECT_THAT(report_html(record), HasSubstr("and 988 more"));
}

TEST(Report, TheNamesOfStagesAndTheirShortTimesAreVisible) {
  RunRecord record;
  const std::string name = "waiting for network and map of the place";
  record.result.timing.add(name, 0.3);
  record.result.timing.add("dense composition", 3000);
  const std::string html = report_html(record);
  const std::regex label("<text x=\"([0-9.]+)\"[^>]*>" + name);
  std::smatch found;
  ASSERT_TRUE(std::regex_search(html, found, label));
  EXPECT_GT(std::stod(found[1]), 6.5 * static_cast<double>(name.size())) << "the label is cut off";
  const std::regex bar("<rect x=\"[0-9.]+\" y=\"[0-9.]+\" width=\"([0-9.]+)\"[^>]*class=\"bar\"");
  ASSERT_TRUE(std::regex_search(html, found, bar));
  EXPECT_GT(std::stod(found[1]), 50) << "the axis is ruled by the longest stage";
}

}  // namespace
}  // namespace stillmap
