// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/run_journal.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/pipeline/journal_records.hpp"
#include "stillmap/pipeline/recording_test.hpp"
#include "stillmap/pipeline/recovered_run.hpp"

#include <cstring>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

const JournalHeading kHeading{"a test", "office", "some machine", "some: options"};
constexpr std::chrono::milliseconds kAlways{0};
constexpr std::chrono::hours kNever{1};

std::unique_ptr<Detector> true_masks(const recorded::Recording& recording) {
  return std::make_unique<recorded::TrueMasks>(recording.sequence);
}

/// A run of a sequence with people, and its state after the last frame, before finish().
struct JournaledRun {
  std::filesystem::path file = test::own_path("run.journal");  // stays, as several tests read it
  RecoveredRun recovered;
  SavedMap map;  // of the system itself, in its state of the last record
  std::vector<FrameRecord> frames;
  SlamResult result;
};

MapContent content_of(SlamSystem& slam) {
  MapContent content;
  slam.ask_map([&](const MapMaker& maker) { content = maker.map().content(); }).get();
  return content;
}

const JournaledRun& journaled_run() {
  static const JournaledRun made = [] {
    JournaledRun run;
    const recorded::Recording& recording = recorded::recording(2, "xyz");
    SlamSystem slam(recording.sequence->camera(), recorded::small_options("fused"),
                    true_masks(recording));
    RunJournal journal(slam, run.file, kHeading, kAlways);
    for (const auto& frame : recording.frames) {
      slam.push(frame);
      journal.add_newest();
    }
    journal.flush();
    run.recovered = recovered_run(run.file);
    run.map = {kHeading.writer, content_of(slam), {}};
    run.frames = slam.records();
    run.result = slam.finish();
    return run;
  }();
  return made;
}

TEST(RunJournal, HoldsTheMapAsItWasAtTheLastRecord) {
  const JournaledRun& run = journaled_run();
  EXPECT_GT(run.recovered.map.map.landmarks.size(), 100U);
  const SavedMap without_views{run.recovered.map.writer, run.recovered.map.map, {}};
  EXPECT_EQ(saved_map_bytes(without_views), saved_map_bytes(run.map));
}

TEST(RunJournal, HoldsTheViewsOfTheDenseMap) {
  const JournaledRun& run = journaled_run();
  EXPECT_EQ(run.recovered.map.views.size(), run.result.dense_statistics.keyframes);
  EXPECT_EQ(read_saved_map(run.file).views.size(), run.recovered.map.views.size());
}

TEST(RunJournal, HoldsAllFramesWithPosesInTheMap) {
  const JournaledRun& run = journaled_run();
  const auto& frames = run.recovered.frames;
  ASSERT_EQ(frames.size(), run.frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].index, run.frames[i].index);
    EXPECT_EQ(frames[i].state, run.frames[i].state);
    EXPECT_EQ(frames[i].covariance, run.frames[i].covariance);
    EXPECT_EQ(frames[i].inliers, run.frames[i].inliers);
  }
  const auto poses = camera_poses(FrameLog(frames), Map(run.recovered.map.map), true);
  ASSERT_EQ(poses.size(), run.result.trajectory.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Pose& end = run.result.trajectory[i].T_world_camera;
    EXPECT_LT((poses[i].T_world_camera.translation() - end.translation()).norm(), 0.01) << i;
  }
}

TEST(RunJournal, HoldsTheUpwardDirection) {
  FrameRecord record;
  record.up = {0.1, -0.9, 0.3};
  record.inliers = 7;
  ByteWriter out;
  put_frame(out, record);
  ByteReader in(out.bytes(), "record", "");
  const FrameRecord found = get_frame(in);
  EXPECT_EQ(found.up, record.up);
  EXPECT_EQ(found.inliers, 7);
}

TEST(RunJournal, HoldsTheMovers) {
  const JournaledRun& run = journaled_run();
  ASSERT_FALSE(run.result.movers.empty());
  ASSERT_EQ(run.recovered.movers.size(), run.result.movers.size());
  for (std::size_t i = 0; i < run.result.movers.size(); ++i) {
    EXPECT_EQ(run.recovered.movers[i].id, run.result.movers[i].id);
    EXPECT_EQ(run.recovered.movers[i].class_name, run.result.movers[i].class_name);
    // The newest frames may still have been in the queue of the movers' thread.
    const auto &some = run.recovered.movers[i].samples, &all = run.result.movers[i].samples;
    ASSERT_GE(some.size() + 10, all.size());
    for (std::size_t k = 0; k < some.size(); ++k) {
      EXPECT_EQ(some[k].frame_index, all[k].frame_index);
      EXPECT_LT((some[k].centroid - all[k].centroid).norm(), 0.02) << k;
    }
  }
}

TEST(RunJournal, HoldsTheHeading) {
  const JournalHeading& heading = journaled_run().recovered.heading;
  EXPECT_EQ(heading.sequence, kHeading.sequence);
  EXPECT_EQ(heading.machine, kHeading.machine);
  EXPECT_EQ(heading.options, kHeading.options);
}

/// A truncated journal is the state at an earlier record.
TEST(RunJournal, IsReadableWhereverItIsTruncated) {
  const std::string whole = read_file(journaled_run().file);
  const std::filesystem::path file = test::own_path("truncated.journal");
  std::size_t frames = 0, different = 0;
  for (int part = 1; part <= 24; ++part) {
    write_file(file, whole.substr(0, 2000 + part * (whole.size() - 2000) / 24));
    const RecoveredRun run = recovered_run(file);
    EXPECT_GE(run.frames.size(), frames);
    different += run.frames.size() > frames ? 1 : 0;
    frames = run.frames.size();
    for (const FrameRecord& frame : run.frames) {
      const bool in_map = frame.reference.slot < run.map.map.keyframes.size();
      EXPECT_EQ(in_map, frame.reference.valid());
    }
  }
  EXPECT_EQ(frames, journaled_run().frames.size());
  EXPECT_GT(different, 5U);
}

TEST(RunJournal, TellsThatADamagedRecordHidesTheLaterOnes) {
  std::string bytes = read_file(journaled_run().file);
  const std::filesystem::path file = test::own_path("damaged.journal");
  write_file(file, bytes.substr(0, bytes.size() - 1));
  EXPECT_EQ(recovered_run(file).map.damage, "");
  // Within the record that holds the middle of the file, behind its header.
  std::size_t at = 12, next = 12;
  while (next < bytes.size() / 2) {
    at = next;
    std::uint64_t packed = 0;
    std::memcpy(&packed, bytes.data() + at, sizeof packed);
    next = at + 20 + packed;
  }
  bytes[at + 20] = static_cast<char>(bytes[at + 20] ^ 1);
  write_file(file, bytes);
  EXPECT_THAT(recovered_run(file).map.damage,
              testing::HasSubstr(fmt::format("its last {} bytes are not read", bytes.size() - at)));
  std::filesystem::remove(file);
}

TEST(RunJournal, WithoutOutdatedEntriesIsTheSameRun) {
  const std::filesystem::path file = test::own_path("compacted.journal");
  const recorded::Recording& recording = recorded::recording(2, "xyz");
  SlamSystem slam(recording.sequence->camera(), recorded::small_options("fused"),
                  true_masks(recording));
  constexpr std::uint64_t kSmall = 100000;  // bytes, so that it is compacted often
  RunJournal journal(slam, file, kHeading, kAlways, kSmall);
  for (const auto& frame : recording.frames) {
    slam.push(frame);
    journal.add_newest();
  }
  journal.flush();
  const RecoveredRun &compacted = recovered_run(file), &whole = journaled_run().recovered;
  EXPECT_LT(std::filesystem::file_size(file), std::filesystem::file_size(journaled_run().file));
  EXPECT_EQ(saved_map_bytes(compacted.map), saved_map_bytes(whole.map));
  EXPECT_EQ(compacted.frames.size(), whole.frames.size());
  std::filesystem::remove(file);
}

TEST(RunJournal, OfARunWithoutFramesHasNone) {
  const std::filesystem::path file = test::own_path("empty.journal");
  const recorded::Recording& recording = recorded::recording(0, "xyz");
  SlamSystem slam(recording.sequence->camera(), recorded::small_options("static"));
  RunJournal(slam, file, kHeading, kNever).flush();
  EXPECT_TRUE(recovered_run(file).frames.empty());
  write_file(file, read_file(file).substr(0, 12));
  EXPECT_THROW(recovered_run(file), Error);
}

TEST(RunJournal, DoesNotChangeTheResults) {
  const recorded::Recording& recording = recorded::recording(2, "xyz");
  SlamSystem slam(recording.sequence->camera(), recorded::small_options("fused"),
                  true_masks(recording));
  for (const auto& frame : recording.frames) slam.push(frame);
  const Trajectory without = slam.finish().trajectory, &with = journaled_run().result.trajectory;
  ASSERT_EQ(without.size(), with.size());
  for (std::size_t i = 0; i < with.size(); ++i) {
    EXPECT_EQ(with[i].T_world_camera.translation(), without[i].T_world_camera.translation()) << i;
  }
}

using Entries = std::map<JournalKey, std::string>;

Entries entries_in(const std::filesystem::path& file) {
  Entries entries;
  JournalContent(file).for_each(
      [&](JournalKey key, std::string_view bytes) { entries.emplace(key, bytes); });
  return entries;
}

Entries entries_of(const std::vector<std::string>& records) {
  const std::filesystem::path file = test::own_path("records.journal");
  JournalWriter writer(file);
  for (const std::string& record : records) writer.append(record);
  return entries_in(file);
}

TEST(JournalPart, TakesChangesOnly) {
  JournalPart part;
  part.put({JournalKind::kFrame, 1}, "a");
  part.put({JournalKind::kFrame, 2}, "b");
  part.put({JournalKind::kView, 7}, "view");
  std::vector<std::string> records{part.take()};
  part.put({JournalKind::kFrame, 1}, "a");
  part.keep({JournalKind::kFrame, 2});
  part.remove_others(JournalKind::kFrame);
  EXPECT_EQ(part.take(), "");
  part.put({JournalKind::kFrame, 1}, "A");
  part.remove_others(JournalKind::kFrame);
  records.push_back(part.take());
  const Entries expected{{{JournalKind::kFrame, 1}, "A"}, {{JournalKind::kView, 7}, "view"}};
  EXPECT_EQ(entries_of(records), expected);
  EXPECT_THROW(entries_of({"xx"}), Error);
}

TEST(JournalContent, IsTheSameAfterWritingItAnew) {
  const std::filesystem::path file = test::own_path("some.journal"),
                              other = test::own_path("other.journal");
  JournalPart part;
  JournalWriter writer(file);
  Entries expected;
  for (std::uint64_t round = 0; round < 3; ++round) {
    for (std::uint64_t id = 0; id < 6; ++id) {
      const std::string view(3U << 20, static_cast<char>('a' + 7 * round + id));
      if (id <= 3 + round) part.put({JournalKind::kView, id}, view);
      if (id <= 3 + round) expected[{JournalKind::kView, id}] = view;
    }
    EXPECT_TRUE(part.full());
    writer.append(part.take());
  }
  JournalWriter anew(other);
  JournalContent(file).write_to(anew);
  EXPECT_EQ(entries_in(other), expected);
  JournalReader records(other);
  std::size_t count = 0;
  for (; const auto record = records.next(); ++count) EXPECT_LE(record->size(), 12U << 20);
  EXPECT_EQ(count, 2U) << "18 MiB are two records";
  for (const auto& path : {file, other}) std::filesystem::remove(path);
}

}  // namespace
}  // namespace stillmap
