// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/report.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/evaluate/svg.hpp"

#include <cmath>
#include <filesystem>
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

/// A run that lost frames 40 to 59.
ReportData full_report() {
  ReportData data;
  data.sequence = "rooms/<kitchen> & co";
  data.preset = "seg-mask";
  data.options = "tracker:\n  name: \"<b>&\"\n";
  data.truth = path(0);
  data.trajectory = path(0.01);
  data.trajectory.erase(data.trajectory.begin() + 40, data.trajectory.begin() + 60);
  data.evaluation = evaluate_trajectory(*data.truth, data.trajectory, 120);
  data.coverage = data.evaluation->coverage;
  for (const auto& [stamp, T] : *data.truth) data.frame_stamps.push_back(stamp);
  data.keyframe_stamps = {50.0, 51.0, 53.0};
  data.keyframes = 3;
  data.landmarks = 18204;
  data.cloud_points = 1234567;
  data.frames_per_second = 31.4;
  data.tracking_median = 9.26;
  StageTimes timing;
  for (int i = 0; i < 100; ++i) timing.add("track", 8 + 0.02 * i);
  timing.add("segment <net>", 55);
  data.timing = timing.stages();
  data.events = {{51.4, "lost"}, {52.0, "new map"}};
  data.skipped = {{50.2, "depth image missing"}, {50.3, "depth image missing"}};
  const cv::Mat image(60, 80, CV_8UC3, cv::Scalar(40, 120, 200));
  data.gallery = {{image, "frame 12: 900 kept, 100 dropped"}};
  data.cloud = ReportImage{image, "static cloud"};
  data.figures = {{image, "ghosts"}};
  data.facts = {{"landmarks", "18 204"}};
  data.files = {{"trajectory.txt", "pose of every frame"}};
  return data;
}

/// Whether every opened element is closed in order; void elements aside.
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
  const std::string html = report_html(full_report());
  for (const char* part :
       {"from above", "from the side", "Error over time", "Coverage", "100 of 120 frames tracked",
        "lost: 20 frames", "Time per stage", "Static map", "900 kept, 100 dropped", "new map",
        "Skipped frames: 2", "depth image missing", "Options in force", "trajectory.txt",
        "1\u202f234\u202f567", "1.23\u2009M", "31.4", "9.3"}) {
    EXPECT_THAT(html, HasSubstr(part));
  }
}

TEST(Report, ShowsTheErrorOfTheEvaluation) {
  ReportData data = full_report();
  const double rmse = data.evaluation->ate.translation.rmse;
  EXPECT_THAT(report_html(data), HasSubstr(fmt::format("RMSE {:.1f} mm", 1000 * rmse)));
  EXPECT_THAT(report_html(data), HasSubstr(fmt::format("<b>{:.4f}</b>", rmse)));
}

TEST(Report, EscapesWhatComesFromOutside) {
  const std::string html = report_html(full_report());
  EXPECT_THAT(html, Not(HasSubstr("<kitchen>")));
  EXPECT_THAT(html, HasSubstr("&lt;kitchen&gt; &amp; co"));
  EXPECT_THAT(html, HasSubstr("segment &lt;net&gt;"));
}

TEST(Report, IsSelfContainedAndWellFormed) {
  const std::string html = report_html(full_report());
  EXPECT_THAT(html, Not(HasSubstr("http")));
  EXPECT_THAT(html, Not(HasSubstr("<script")));
  EXPECT_THAT(html, Not(HasSubstr("<link")));
  EXPECT_THAT(html, Not(HasSubstr("nan")));
  EXPECT_THAT(html, HasSubstr("data:image/jpeg;base64,/9j/"));  // every JPEG begins so
  EXPECT_EQ(unbalanced_element(html), "");
}

TEST(Report, LeavesOutWhatThereIsNot) {
  const std::string empty = report_html({});
  EXPECT_EQ(unbalanced_element(empty), "");
  for (const char* part : {"<svg", "<img", "<table", "Coverage", "Skipped", "Options"}) {
    EXPECT_THAT(empty.substr(empty.find("<body>")), Not(HasSubstr(part)));
  }
}

TEST(Report, DrawsThePathWithoutATruth) {
  ReportData data;
  data.trajectory = path(0);
  const std::string html = report_html(data);
  EXPECT_THAT(html, HasSubstr("from above"));
  EXPECT_THAT(html, Not(HasSubstr("colored by its error")));
}

TEST(Report, TakesDegenerateRuns) {
  ReportData data;
  data.trajectory = {{5, Pose()}};  // one pose, no extent, no time
  data.frame_stamps = {5, 5.1};
  data.timing = {StageTiming{"idle", 0, 0, 0, 0, 0, 0, 0}};
  const std::string html = report_html(data);
  EXPECT_THAT(html, Not(HasSubstr("nan")));
  EXPECT_THAT(html, Not(HasSubstr("\"inf")));
  EXPECT_EQ(unbalanced_element(html), "");
}

TEST(Report, AThousandLinesAlikeAreCounted) {
  ReportData data;
  for (int i = 0; i < 1000; ++i) data.events.push_back({static_cast<double>(i), "lost"});
  EXPECT_THAT(report_html(data), HasSubstr("and 988 more"));
}

TEST(Report, IsWrittenOrSaysWhyNot) {
  const auto file = test::own_path("report.html");
  write_report(file, full_report());
  EXPECT_EQ(read_file(file), report_html(full_report()));
  std::filesystem::remove(file);
  EXPECT_THROW(write_report("/nonexistent/report.html", {}), Error);
}

}  // namespace
}  // namespace stillmap
