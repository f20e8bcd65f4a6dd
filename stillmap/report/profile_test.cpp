// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/profile.hpp"

#include <map>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

constexpr double kReading = 0.05;  // largest error of a CPU time [ms]

void compute() {
  const auto end = std::chrono::steady_clock::now() + std::chrono::microseconds(300);
  while (std::chrono::steady_clock::now() < end) {
  }
}

/// Records three frames with two functions each, one of which calls a third function that the frame
/// calls as well; and a second thread.
class ProfileOfARun : public ::testing::Test {
 protected:
  void SetUp() override {
    run("camera");
    std::thread(&ProfileOfARun::run, this, "map \"2\"").join();
  }

  void run(const std::string& name) {
    const TraceBinding binding(&trace_.add_track(name));
    for (std::size_t frame = 0; frame < 3; ++frame) {
      trace_frame(frame);
      const TraceScope scope("frame");
      traced("features", [] { traced("blur", compute); });
      traced("pose", [] {
        compute();
        traced("blur", compute);
      });
      trace_count("network", frame);
    }
  }

  Trace trace_;
};

const ProfileRow& row(const ThreadProfile& thread, const std::string& name, int nth = 0) {
  for (const ProfileRow& r : thread.rows) {
    if (r.name == name && nth-- == 0) return r;
  }
  throw std::out_of_range(name);
}

TEST_F(ProfileOfARun, CountsCallsByCaller) {
  const Profile profile = make_profile(trace_, 100);
  ASSERT_EQ(profile.threads.size(), 2U);
  for (const ThreadProfile& thread : profile.threads) {
    std::vector<std::pair<std::string, int>> tree;
    for (const ProfileRow& r : thread.rows) tree.emplace_back(r.name, r.depth);
    EXPECT_EQ(tree, (std::vector<std::pair<std::string, int>>{
                        {"frame", 0}, {"features", 1}, {"blur", 2}, {"pose", 1}, {"blur", 2}}));
    for (const ProfileRow& r : thread.rows) EXPECT_EQ(r.calls, 3U);
  }
}

TEST_F(ProfileOfARun, TimesAddUp) {
  const Profile profile = make_profile(trace_, 100);
  for (const ThreadProfile& thread : profile.threads) {
    const ProfileRow &frame = row(thread, "frame"), &pose = row(thread, "pose");
    const double parts = row(thread, "features").cpu + pose.cpu;
    EXPECT_NEAR(frame.cpu_self, frame.cpu - parts, 1e-6);
    EXPECT_NEAR(pose.cpu_self, pose.cpu - row(thread, "blur", 1).cpu, 1e-6);
    EXPECT_NEAR(thread.cpu, frame.cpu, 1e-9) << "called ones count with their callers";
    for (const ProfileRow& r : thread.rows) {
      EXPECT_LE(r.median, r.p95);
      EXPECT_LE(r.p95, r.max);
      EXPECT_LE(r.max, r.total);
      EXPECT_LE(r.cpu, r.total + 3 * kReading);
      EXPECT_GE(r.cpu_self, 0);
    }
  }
}

TEST_F(ProfileOfARun, UnfinishedSpansAreIgnored) {
  const TraceBinding binding(&trace_.add_track("open"));
  const TraceScope open("open");
  traced("closed", compute);
  const Profile profile = make_profile(trace_, 100);
  ASSERT_EQ(profile.threads.back().rows.size(), 1U);
  EXPECT_EQ(profile.threads.back().rows.front().name, "closed");
  EXPECT_THAT(trace_json(trace_),
              ::testing::Not(::testing::HasSubstr(R"("name":"open","ph":"X")")));
}

TEST_F(ProfileOfARun, TheTraceIsJsonWithAllSpansNestedAsTheyWere) {
  const auto events = nlohmann::json::parse(trace_json(trace_)).at("traceEvents");
  std::map<int, std::string> thread_names;
  std::map<int, std::vector<nlohmann::json>> frames, others;
  std::size_t counters = 0;
  for (const auto& event : events) {
    const int thread = event.at("tid");
    if (event.at("name") == "thread_name") thread_names[thread] = event.at("args").at("name");
    if (event.at("ph") == "C") ++counters;
    if (event.at("ph") != "X") continue;
    EXPECT_GE(event.at("dur").get<double>(), 0);
    EXPECT_GE(event.at("tdur").get<double>(), 0);
    (event.at("name") == "frame" ? frames : others)[thread].push_back(event);
  }
  EXPECT_EQ(thread_names, (std::map<int, std::string>{{1, "camera"}, {2, "map \"2\""}}));
  EXPECT_EQ(counters, 6U);
  constexpr double kRounded = 2e-3;  // microseconds
  for (const auto& [thread, name] : thread_names) {
    ASSERT_EQ(frames[thread].size(), 3U);
    ASSERT_EQ(others[thread].size(), 12U);
    for (const auto& event : others[thread]) {
      const auto& frame = frames[thread].at(event.at("args").at("frame").get<std::size_t>());
      const double begin = frame.at("ts"), end = begin + frame.at("dur").get<double>();
      EXPECT_GE(event.at("ts").get<double>(), begin - kRounded);
      EXPECT_LE(event.at("ts").get<double>() + event.at("dur").get<double>(), end + kRounded);
    }
  }
}

TEST_F(ProfileOfARun, TablesNameEveryThreadAndFunction) {
  const Profile profile = make_profile(trace_, 100);
  const std::string table = profile_text(profile), brief = profile_in_brief(profile);
  for (const char* name : {"camera", "map \"2\"", "blur"}) {
    EXPECT_THAT(table, ::testing::HasSubstr(name));
    EXPECT_THAT(brief, ::testing::HasSubstr(name));
  }
  for (const char* name : {"frame", "features", "pose"})
    EXPECT_THAT(table, ::testing::HasSubstr(name));
}

TEST_F(ProfileOfARun, TheChartShowsThreadsAndFunctions) {
  const std::string chart = profile_chart(trace_).element();
  for (const char* text : {">camera<", ">map &quot;2&quot;<", ">features: ", ">blur: "})
    EXPECT_THAT(chart, ::testing::HasSubstr(text));
  EXPECT_THAT(profile_chart(Trace()).element(),
              ::testing::Not(::testing::HasSubstr("class=\"span\"")));
}

}  // namespace
}  // namespace stillmap
