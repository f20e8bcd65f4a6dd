// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/run_folder.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/machine.hpp"
#include "stillmap/base/test_error.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"
#include "stillmap/write_results.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {
namespace fs = std::filesystem;

using test::error_of;
using ::testing::HasSubstr;

/// Returns a short sequence of a rendered scene without movers.
const SimulatedSequence& small_sequence() {
  static const SimulatedSequence sequence = [] {
    SimulationOptions scene;
    scene.people = 0;
    scene.frames = 12;
    scene.width = 320;
    scene.height = 240;
    return SimulatedSequence(scene);
  }();
  return sequence;
}

Options small_options() {
  Options options;
  options.features.keypoints = 500;
  return options;
}

/// Returns the record of a run on the short sequence.
const RunRecord& small_run() {
  static const RunRecord record = [] {
    const SimulatedSequence& sequence = small_sequence();
    RunRecord made;
    made.sequence = "rendered";
    made.machine = machine_description();
    made.options = small_options();
    made.truth = sequence.trajectory();
    SlamSystem slam(sequence.camera(), parameters_of(made.options));
    for (std::size_t i = 0; i < sequence.frames(); ++i) slam.push(sequence.at(i).frame);
    made.result = slam.finish();
    made.map = slam.saved_map("test");
    made.frames = sequence.frames();
    made.seconds = 0.5;
    evaluate_run(made);
    return made;
  }();
  return record;
}

/// A temporary folder, removed at the end.
class RunFolder : public ::testing::Test {
 protected:
  ~RunFolder() override { fs::remove_all(folder_); }
  bool has(const std::string& name) { return fs::exists(folder_ / name); }
  const fs::path folder_ = test::own_path("run_folder");
};

TEST_F(RunFolder, HoldsAllFilesOfARun) {
  RunOutputs outputs;
  outputs.dense.mesh = {"ply", "glb"};
  outputs.save_map = folder_ / "kept.map";
  const auto written = write_run_folder(small_run(), folder_, outputs);
  for (const char* name :
       {"trajectory.txt", "trajectory_covariance.txt", "keyframes.txt", "frames.csv", "movers.csv",
        "movers.jsonl", "cloud.ply", "cloud.png", "cloud_before_after.png", "mesh.ply", "mesh.glb",
        "mesh.png", "run.map", "options.yaml", "timing.txt", "summary.json", "report.html",
        "kept.map"}) {
    EXPECT_TRUE(has(name)) << name;
    EXPECT_NE(std::find(written.begin(), written.end(), folder_ / name), written.end()) << name;
  }
  EXPECT_EQ(read_trajectory(folder_ / "trajectory.txt").size(),
            small_run().result.trajectory.size());
  EXPECT_EQ(read_saved_map(folder_ / "run.map").views.size(), small_run().map->views.size());
  EXPECT_THAT(read_file(folder_ / "report.html"), HasSubstr("Error over time"));
}

TEST_F(RunFolder, TheNamesKnownBeforeTheRunAreThoseWritten) {
  RunOutputs outputs;
  outputs.dense.mesh = {"obj"};
  outputs.dense.planner = true;
  const auto possible = possible_run_files(small_run().options, outputs);
  for (const fs::path& file : write_run_folder(small_run(), folder_, outputs)) {
    const std::string name = file.lexically_relative(folder_).string();
    EXPECT_NE(std::find(possible.begin(), possible.end(), name), possible.end()) << name;
  }
}

TEST_F(RunFolder, ASlimMapHasNoViews) {
  RunOutputs outputs;
  outputs.save_map = folder_ / "slim.map";
  outputs.slim_map = true;
  write_run_folder(small_run(), folder_, outputs);
  EXPECT_TRUE(read_saved_map(outputs.save_map).views.empty());
  EXPECT_FALSE(read_saved_map(folder_ / "run.map").views.empty());
}

TEST_F(RunFolder, AnotherRunReplacesAllFiles) {
  RunOutputs outputs;
  outputs.dense.mesh = {"ply"};
  write_run_folder(small_run(), folder_, outputs);
  ASSERT_TRUE(has("mesh.ply"));
  write_run_folder(small_run(), folder_);
  EXPECT_FALSE(has("mesh.ply"));
  EXPECT_FALSE(has("mesh.png"));
  EXPECT_TRUE(has("cloud.ply"));
}

TEST_F(RunFolder, ARunThatDidNotEndIsToldByItsJournal) {
  std::filesystem::create_directories(folder_);
  EXPECT_NO_THROW(require_ended_run(folder_));
  write_file(folder_ / kRunJournal, "begun");
  EXPECT_THROW(require_ended_run(folder_), Error);
}

TEST_F(RunFolder, ARunThatGoesOnIsNotToldToHaveEnded) {
  const ResultFolder results(folder_);
  write_file(folder_ / kRunJournal, "begun");
  EXPECT_THAT(error_of([&] { require_ended_run(folder_); }), HasSubstr("wait for its end"));
}

TEST_F(RunFolder, TheJournalGoesOnceItsResultsAreWritten) {
  Options options;
  options.dense.enabled = options.movers.enabled = false;
  ResultFolder results(folder_);
  for (const char* name : {kRunJournal, "trajectory.txt", "keyframes.txt"})
    results.write_text(name, "");
  results.write("cloud.png", [](const fs::path& file) { throw Error("disk full", file, ""); });
  remove_journal(options, results);
  EXPECT_TRUE(has(kRunJournal)) << "there is no summary";
  results.write_text(kRunSummary, "{}");
  remove_journal(options, results);
  EXPECT_FALSE(has(kRunJournal));
  ResultFolder lost(folder_);
  lost.write_text(kRunJournal, "");
  remove_journal({}, lost);  // nothing to write, such as the map of a run that was lost
  EXPECT_FALSE(has(kRunJournal));
}

TEST_F(RunFolder, AForeignFileIsLeftAloneWithoutForce) {
  fs::create_directories(folder_);
  write_file(folder_ / "trajectory.txt", "mine");
  EXPECT_THROW(write_run_folder(small_run(), folder_), Error);
  EXPECT_EQ(read_file(folder_ / "trajectory.txt"), "mine");
  EXPECT_FALSE(has("cloud.ply")) << "nothing is written";
  write_run_folder(small_run(), folder_, {}, ResultFolder::Foreign::kOverwrite);
  EXPECT_NE(read_file(folder_ / "trajectory.txt"), "mine");
}

TEST_F(RunFolder, ThatALibraryUserWritesHasTheFilesOfTheCommand) {
  Slam slam(small_sequence().camera(), small_options());
  for (std::size_t i = 0; i < small_sequence().frames(); ++i)
    slam.push(small_sequence().at(i).frame);
  const Results results = slam.finish();
  const auto written = write_results(results, folder_, "My <room>");
  EXPECT_EQ(written, write_run_folder(small_run(), folder_));
  EXPECT_EQ(write_results(results, folder_), written);
  EXPECT_EQ(read_trajectory(folder_ / "trajectory.txt").size(), results.trajectory.size());
  const auto summary = nlohmann::json::parse(read_file(folder_ / "summary.json"));
  EXPECT_EQ(summary["sequence"], folder_.filename().string());
  EXPECT_EQ(summary["frames"]["total"], 12);
  EXPECT_EQ(summary["options"]["features"]["keypoints"], 500);
  EXPECT_GT(summary["seconds"], 0);
  EXPECT_FALSE(read_saved_map(folder_ / kRunMap).views.empty());
}

TEST_F(RunFolder, ThatALibraryUserWritesKeepsForeignFiles) {
  fs::create_directories(folder_);
  write_file(folder_ / "report.html", "mine");
  Slam slam(small_sequence().camera(), small_options());
  slam.push(small_sequence().at(0).frame);
  EXPECT_THROW(write_results(slam.finish(), folder_), Error);
  EXPECT_EQ(read_file(folder_ / "report.html"), "mine");
}

TEST(RunSummary, HasTheFiguresOfTheRecord) {
  RunRecord record = small_run();
  record.result.detector_skipped = "3 frames without a mask";
  record.loaded = LoadedMap{"office.map", false, 0.25};
  record.result.maps = 2;
  record.result.frames_by_map = {{0, 1}, {1, 11}};
  const nlohmann::json json = run_summary_json(record);
  for (const char* key : {"stillmap",        "machine",
                          "sequence",        "preset",
                          "schedule",        "detector",
                          "interrupted",     "maps",
                          "loops",           "merges",
                          "dropped_maps",    "relocalizations",
                          "landmarks",       "refinement",
                          "movers",          "cloud_points",
                          "seconds",         "tracking_median_ms",
                          "slowest_frame",   "medians_of_tenths_ms",
                          "first_pose_s",    "mapping_memory_mib",
                          "peak_memory_mib", "timing_ms",
                          "options",         "camera"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  EXPECT_EQ(json["frames"]["total"], 12);
  EXPECT_EQ(json["frames"]["tracked"], record.result.trajectory.size());
  EXPECT_EQ(json["keyframes"], record.result.keyframes.size());
  EXPECT_EQ(json["frames_per_second"], 24);
  EXPECT_EQ(json["frames_without_masks"], "3 frames without a mask");
  EXPECT_EQ(json["loaded_map"]["extended"], false);
  EXPECT_EQ(json["loaded_map"]["frames_by_component"], nlohmann::json({{"0", 1}, {"1", 11}}));
  EXPECT_THAT(run_summary_text(record),
              HasSubstr(", localized in component 0 (1 frame), component 1 (11 frames)"));
  EXPECT_EQ(json["evaluation"], nlohmann::json(*record.evaluation));
}

TEST(RunSummary, TellsTheTimingOfTheShuttersAndItsOrigin) {
  RunRecord record = small_run();
  EXPECT_EQ(run_summary_json(record)["camera"]["shutter"]["origin"], "none found");
  EXPECT_EQ(run_summary_json(record)["camera"]["size"][0], small_sequence().camera().width);
  EXPECT_THAT(run_summary_text(record), ::testing::Not(HasSubstr("rolling shutter")));
  record.result.shutter = {.readout = 0.027, .depth_delay = 0.004};
  EXPECT_EQ(run_summary_json(record)["camera"]["shutter"]["origin"],
            "estimated from the recording");
  EXPECT_THAT(run_summary_text(record),
              HasSubstr("rolling shutter, as last estimated: readout 27.0 ms, depth delay 4.0 ms"));
  record.result.camera.shutter = record.result.shutter;
  EXPECT_EQ(run_summary_json(record)["camera"]["shutter"]["origin"], "camera file");
  EXPECT_THAT(run_summary_text(record), ::testing::Not(HasSubstr("rolling shutter")));
}

TEST(RunSummary, CountsDepthImagesThatCouldNotBeReadApartFromFrames) {
  RunRecord record = small_run();
  record.result.frames[3].uncertainty = Uncertainty::kMinority;
  record.skipped = {{1.0, "rgb/1.png is missing"},
                    {.timestamp = 2.0, .reason = "depth/2.png is empty", .frame_lost = false}};
  EXPECT_EQ(record.total_frames(), 13);
  EXPECT_EQ(run_summary_json(record)["frames"]["skipped"], 1);
  EXPECT_EQ(run_summary_json(record)["frames"]["depth_images_skipped"], 1);
  EXPECT_EQ(run_summary_json(record)["frames"]["uncertain_at"],
            nlohmann::json({record.result.frames[3].timestamp}));
  EXPECT_THAT(run_summary_text(record), HasSubstr("1 frame skipped; the first: 1.0"));
  EXPECT_THAT(run_summary_text(record), HasSubstr("1 depth image skipped"));
}

TEST(RunSummary, NamesLibraryDeviceAndScheduleOfTheNetwork) {
  RunRecord record = small_run();
  record.result.detector = std::nullopt;
  EXPECT_TRUE(run_summary_json(record)["network"].is_null());
  record.result.detector = DetectorUse{InferenceInfo{"ONNX Runtime", "1.31.1", "cuda"}, 1, 0};
  EXPECT_EQ(run_summary_json(record)["network"], nlohmann::json({{"backend", "ONNX Runtime"},
                                                                 {"version", "1.31.1"},
                                                                 {"device", "cuda"},
                                                                 {"every", 1},
                                                                 {"mask_delay", 0}}));
  record.result.detector = DetectorUse{std::nullopt, 3, 2};
  const nlohmann::json masks = run_summary_json(record)["network"];
  EXPECT_TRUE(masks["backend"].is_null());
  EXPECT_EQ(masks["every"], 3);
}

TEST(RunSummary, TheTextNamesFramesWithoutMasks) {
  RunRecord record = small_run();
  EXPECT_THAT(run_summary_text(record), HasSubstr("12 of 12 frames tracked (100.0 %)"));
  EXPECT_THAT(run_summary_text(record), ::testing::Not(HasSubstr("without a mask")));
  record.result.detector_skipped = "3 frames without a mask";
  EXPECT_THAT(run_summary_text(record), HasSubstr("3 frames without a mask"));
}

TEST(RunEvents, AreOrderedByTimeWithLossesAndLoops) {
  SlamResult result;
  for (int i = 0; i < 6; ++i) {
    FrameRecord frame;
    frame.index = static_cast<std::size_t>(i);
    frame.timestamp = i;
    frame.state = i == 0   ? TrackState::kStarted
                  : i == 3 ? TrackState::kLost
                           : TrackState::kTracking;
    frame.reason = "too dark";
    result.frames.push_back(frame);
  }
  MapEvent loop;
  loop.timestamp = 2;
  result.events = {loop};
  const std::vector<RunEvent> events = run_events(result);
  ASSERT_EQ(events.size(), 3U);
  EXPECT_THAT(events[0].text, HasSubstr("loop closed"));
  EXPECT_EQ(events[1].text, "lost: too dark");
  EXPECT_EQ(events[2].text, "tracking again");
  EXPECT_EQ(map_events_text(result), "1 loop closed");
}

}  // namespace
}  // namespace stillmap
