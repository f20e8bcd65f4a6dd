// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/report_page.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/report/svg.hpp"

#include <cmath>
#include <regex>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

TEST(Report, ShowsTheErrorOfTheEvaluation) {
  const RunRecord record = full_record();
  ASSERT_TRUE(record.evaluation) << record.evaluation_problem;
  const double rmse = record.evaluation->ate.translation.rmse;
  EXPECT_THAT(report_html(record), HasSubstr(fmt::format("RMSE {:.1f} mm", 1000 * rmse)));
  EXPECT_THAT(report_html(record), HasSubstr(fmt::format("<b>{:.4f}</b>", rmse)));
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
