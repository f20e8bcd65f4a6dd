// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/saved_map.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/section_file.hpp"
#include "stillmap/base/test_memory.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/map/map_file.hpp"
#include "stillmap/pipeline/map_description.hpp"
#include "stillmap/pipeline/merge_maps.hpp"
#include "stillmap/pipeline/visits_test.hpp"

#include <algorithm>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using visits::Outcome;
using visits::run;
using visits::Visit;
using visits::visit;

/// Returns the map of the first visit; its world is the camera of that visit's first frame.
const Outcome& first_visit() {
  static const Outcome made = run(visit("xyz"));
  return made;
}

/// Returns the distance of each pose from the truth in the world of a visit, without alignment [m].
std::vector<double> errors_in_world(const Visit& of_world, const Visit& visited,
                                    const Trajectory& estimate) {
  const Pose T_world_truth = of_world.sequence->T_world_camera(0).inverse();
  std::vector<double> errors;
  for (const StampedPose& e : estimate) {
    const auto index = static_cast<std::size_t>(std::lround(e.timestamp * visited.camera().fps));
    const Pose truth = T_world_truth * visited.sequence->T_world_camera(index);
    errors.push_back((e.T_world_camera.translation() - truth.translation()).norm());
  }
  return errors;
}

/// Returns the same in the world of the first visit.
std::vector<double> errors_in_first_world(const Visit& visited, const Trajectory& estimate) {
  return errors_in_world(visit("xyz"), visited, estimate);
}

/// Returns some frames of one visit followed by all frames of another one, as one recording.
Visit one_after_the_other(const Visit& first, std::size_t frames, const Visit& second) {
  Visit both{first.sequence, {}};
  const auto add = [&](const RgbdFramePtr& frame) {
    auto next = std::make_shared<RgbdFrame>(*frame);
    next->index = both.frames.size();
    next->timestamp = static_cast<double>(next->index) / first.camera().fps;
    both.frames.push_back(next);
  };
  std::for_each_n(first.frames.begin(), frames, add);
  std::for_each(second.frames.begin(), second.frames.end(), add);
  return both;
}

/// Pushes some frames of a visit, loads the map of the first visit, and pushes the others.
struct LoadedWhileRunning {
  std::string not_found;  // what load() returned
  Outcome outcome;
};

LoadedWhileRunning load_after(std::size_t frames, const Visit& visit) {
  SlamSystem slam(visit.camera(), recorded::small_options("static"));
  LoadedWhileRunning loaded;
  for (const auto& frame : visit.frames) {
    if (frame->index == frames) loaded.not_found = slam.load(first_visit().map);
    slam.push(frame);
  }
  loaded.outcome.result = slam.finish();
  loaded.outcome.map = slam.saved_map("test");
  return loaded;
}

/// Returns a map of a few dozen numbers, so that every byte can be altered.
SavedMap tiny_map() {
  SavedMap saved;
  saved.writer = "a test";
  saved.map.camera.width = 32, saved.map.camera.height = 24;
  Map map(saved.map.camera, PyramidShape{});
  Keyframe keyframe;
  auto features = std::make_shared<Features>();
  for (std::uint32_t i = 0; i < 3; ++i) {
    features->keypoints.push_back({.u = 5.5F * static_cast<float>(i), .v = 7, .depth = 2});
    features->descriptors.push_back({i, i + 1, i * i, 42});
  }
  keyframe.static_weight.assign(3, 0.75F);
  keyframe.features = features;
  const KeyframeId id = map.add_keyframe(keyframe).id;
  map.add_landmark({0.1, 0.2, 2.3}, {id, 1});
  saved.map = map.content();
  DenseView view;
  view.camera = saved.map.camera;
  view.camera.width = view.camera.height = 2;
  view.depth = (cv::Mat1w(2, 2) << 5000, 6000, 7000, 8000);
  view.color = cv::Mat3b(2, 2, cv::Vec3b(10, 20, 30));
  view.kind = (cv::Mat1b(2, 2) << 0, 1, 2, 255);
  view.instances = {{"chair", 0.5F}};
  view.visit = 0;
  saved.views = {{id, Pose(so3_exp({0.1, 0.2, 0.3}), {1, 2, 3}), view}};
  return saved;
}

/// Reads the bytes and calls every function on the map. Returns the error message; empty if there
/// is none.
std::string error_of(const std::string& bytes) {
  try {
    const SavedMap read = saved_map_from_bytes(bytes, "some.map");
    description_text(describe_map(read));
    description_json(describe_map(read));
    map_graph(read);
    landmark_cloud(read);
    dense_cloud(read);
    Map(read.map).content();
  } catch (const Error& e) {
    EXPECT_THAT(e.where(), HasSubstr("some.map"));
    EXPECT_FALSE(e.fix().empty());
    return e.what();
  }
  return "";
}

TEST(SavedMap, IsReadBackAsItWasWritten) {
  const SavedMap& saved = first_visit().map;
  const std::string bytes = saved_map_bytes(saved);
  const SavedMap read = saved_map_from_bytes(bytes, "");
  EXPECT_EQ(read.writer, "test");
  EXPECT_EQ(read.map.keyframes.size(), saved.map.keyframes.size());
  EXPECT_EQ(read.map.landmarks.size(), first_visit().result.landmarks);
  EXPECT_EQ(read.views.size(), saved.views.size());
  EXPECT_EQ(saved_map_bytes(read), bytes);
}

TEST(SavedMap, IdenticalRunsWriteIdenticalBytes) {
  EXPECT_EQ(saved_map_bytes(run(visit("xyz")).map), saved_map_bytes(first_visit().map));
}

TEST(SavedMap, TheCloudIsTheOneOfTheRunToTheLastBit) {
  const Cloud& of_run = first_visit().result.dense.cloud;
  ASSERT_GT(of_run.size(), 1000U);
  EXPECT_EQ(dense_cloud(saved_map_from_bytes(saved_map_bytes(first_visit().map), "a map")), of_run);
}

TEST(SavedMap, IsTheSameWithAnyMemory) {
  SlamParameters options = recorded::small_options("static");
  options.dense.memory = {0, test::own_path("views")};
  const Outcome little = run(visit("xyz"), std::nullopt, options);
  const DenseStatistics& views = little.result.dense_statistics;
  EXPECT_EQ(views.views_on_disk, views.keyframes);
  EXPECT_EQ(first_visit().result.dense_statistics.views_on_disk, 0U);
  EXPECT_EQ(little.result.dense.cloud, first_visit().result.dense.cloud);
  EXPECT_EQ(saved_map_bytes(little.map), saved_map_bytes(first_visit().map));
  EXPECT_EQ(test::resident_kib(options.dense.memory.folder), 0) << "pages are dropped";
  std::filesystem::remove_all(options.dense.memory.folder);
}

TEST(SavedMap, IsTheSameWithAllKeyframesOnDisk) {
  SlamParameters options = recorded::small_options("static");
  options.keyframe_memory = 0;
  options.dense.memory.folder = test::own_path("keyframes");
  const Outcome little = run(visit("xyz"), std::nullopt, options);
  EXPECT_EQ(saved_map_bytes(little.map), saved_map_bytes(first_visit().map));
  EXPECT_TRUE(std::filesystem::is_directory(options.dense.memory.folder)) << "the file was made";
  std::filesystem::remove_all(options.dense.memory.folder);
}

TEST(SavedMap, ARunThatOnlyLocalizesForAWhileMakesNoKeyframesThenAndIsRepeatable) {
  const auto run_in_parts = [] {
    const Visit& visited = visit("xyz");
    SlamSystem slam(visited.camera(), recorded::small_options("static"));
    for (std::size_t i = 0; i < visited.frames.size(); ++i) {
      if (i == 30) slam.set_extend(false);
      if (i == 60) slam.set_extend(true);
      EXPECT_TRUE(slam.push(visited.frames[i])) << "frame " << i;
    }
    for (const FrameRecord& frame : slam.finish().frames)
      EXPECT_FALSE(frame.keyframe && frame.index >= 30 && frame.index < 60) << frame.index;
    return saved_map_bytes(slam.saved_map("test"));
  };
  const std::string bytes = run_in_parts();
  EXPECT_EQ(run_in_parts(), bytes);
  EXPECT_NE(saved_map_bytes(first_visit().map), bytes);
}

TEST(SavedMap, OfAMomentDoesNotChangeTheRun) {
  SlamSystem slam(visit("xyz").camera(), recorded::small_options("static"));
  SavedMap early;
  for (const auto& frame : visit("xyz").frames) {
    slam.push(frame);
    if (frame->index == 45) early = slam.saved_map("test");
  }
  slam.finish();
  EXPECT_EQ(saved_map_bytes(slam.saved_map("test")), saved_map_bytes(first_visit().map));
  const SavedMap read = saved_map_from_bytes(saved_map_bytes(early), "early.map");
  EXPECT_FALSE(read.views.empty());
  const Outcome again = run(visit("xyz"), StartingMap{read, false});
  EXPECT_GT(again.result.tracked(), visit("xyz").frames.size() / 2);
}

TEST(SavedMap, EveryAlteredByteAndEveryOtherLengthIsNoticed) {
  const std::string bytes = saved_map_bytes(tiny_map());
  ASSERT_EQ(error_of(bytes), "");
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    for (const int bits : {0x01, 0x80, 0xff}) {
      std::string altered = bytes;
      altered[i] = static_cast<char>(altered[i] ^ bits);
      EXPECT_NE(error_of(altered), "") << "byte " << i;
    }
    EXPECT_NE(error_of(bytes.substr(0, i)), "") << "cut to " << i;
  }
  EXPECT_THAT(error_of(bytes + bytes), HasSubstr("bytes too many"));
}

TEST(SavedMap, BytesOfNoMapAreAnError) {
  EXPECT_THAT(error_of("ply\nformat binary_little_endian 1.0\n"), HasSubstr("is not a saved map"));
  EXPECT_THAT(error_of(""), HasSubstr("is not a saved map"));
  std::string newer = saved_map_bytes(tiny_map());
  newer[8] = 9;
  EXPECT_THAT(error_of(newer), HasSubstr("version 9, and this program reads versions 2 to 5"));
}

/// The sections are corrupted and get new checksums, so that checksums do not reveal it.
TEST(SavedMap, CorruptionWithValidChecksumsNeverGivesABrokenMap) {
  const auto sections = unpack_sections(kMapFormat, saved_map_bytes(tiny_map()), "");
  std::mt19937_64 random(7);
  for (std::size_t s = 0; s < sections.size(); ++s) {
    for (std::size_t i = 0; i < sections[s].bytes.size(); ++i) {
      for (int round = 0; round < 4; ++round) {
        auto altered = sections;
        altered[s].bytes[i] = static_cast<char>(random());
        error_of(pack_sections(kMapFormat, altered));
      }
    }
  }
}

/// Alters, removes or adds bytes at random positions of a section.
void scramble(std::string& bytes, std::mt19937_64& random) {
  const auto place = [&] { return bytes.empty() ? 0 : random() % bytes.size(); };
  switch (random() % 4) {
    case 0:
      bytes.resize(place());
      break;
    case 1:
      bytes.insert(place(), 1 + random() % 64, static_cast<char>(random()));
      break;
    default:
      for (std::size_t n = 1 + random() % 8; n > 0 && !bytes.empty(); --n) {
        bytes[place()] = static_cast<char>(random());
      }
  }
}

TEST(SavedMap, ARealMapDamagedAtRandomIsAnErrorAndNeverACrash) {
  const std::string bytes = saved_map_bytes(first_visit().map);
  std::mt19937_64 random(11);
  for (int round = 0; round < 60; ++round) {
    std::string damaged = bytes;
    scramble(damaged, random);
    if (damaged == bytes) continue;
    EXPECT_THROW(saved_map_from_bytes(damaged, "some.map"), Error) << round;
  }
}

/// Checksums are valid here: every map that is read without an error must be usable.
TEST(SavedMap, CorruptionOfARealMapIsAnErrorOrAUsableMap) {
  const auto sections = unpack_sections(kMapFormat, saved_map_bytes(first_visit().map), "");
  std::mt19937_64 random(13);
  int used = 0;
  for (int round = 0; round < 80; ++round) {
    auto altered = sections;
    scramble(altered[random() % altered.size()].bytes, random);
    const std::string bytes = pack_sections(kMapFormat, altered);
    if (!error_of(bytes).empty()) continue;
    ++used;
    const bool extend = round % 2 == 0;
    SlamSystem slam(visit("xyz").camera(), recorded::small_options("static"), nullptr,
                    StartingMap{saved_map_from_bytes(bytes, ""), extend});
    for (std::size_t i = 0; i < 6; ++i) slam.push(visit("xyz").frames[i]);
    slam.finish();
  }
  EXPECT_GT(used, 5);
}

/// Returns a map whose views together are larger than a section of the file.
SavedMap large_map() {
  SavedMap saved = tiny_map();
  saved.map.camera.width = 2000, saved.map.camera.height = 1000;
  DenseView& view = saved.views[0].view;
  const cv::Size size(2000, 1000);
  view.camera.width = size.width, view.camera.height = size.height;
  view.depth = cv::Mat1w(size);
  view.color = cv::Mat3b(size);
  view.kind = cv::Mat1b(size, std::uint8_t{1});
  cv::RNG random(5);
  for (int i = 0; i < 4; ++i) {
    if (i > 0) saved.views.push_back(saved.views[0]);
    DenseView& other = saved.views.back().view;
    other.depth = other.depth.clone();
    other.color = other.color.clone();
    random.fill(other.depth, cv::RNG::UNIFORM, 0, 65535);
    random.fill(other.color, cv::RNG::UNIFORM, 0, 255);
  }
  return saved;
}

bool is_dense(const Section& section) { return std::string_view(section.name.data(), 4) == "DENS"; }

TEST(SavedMap, OfManyViewsHasSeveralSectionsOfThem) {
  const SavedMap saved = large_map();
  const std::string bytes = saved_map_bytes(saved);
  const auto sections = unpack_sections(kMapFormat, bytes, "");
  EXPECT_EQ(std::count_if(sections.begin(), sections.end(), is_dense), 4);
  for (const Section& section : sections) EXPECT_LE(section.bytes.size(), 16U << 20);
  const SavedMap read = saved_map_from_bytes(bytes, "");
  ASSERT_EQ(read.views.size(), saved.views.size());
  for (std::size_t i = 0; i < read.views.size(); ++i) {
    EXPECT_EQ(cv::countNonZero(read.views[i].view.depth != saved.views[i].view.depth), 0) << i;
  }
  EXPECT_EQ(saved_map_bytes(read), bytes);
}

TEST(SavedMap, IsReadAndWrittenWithLittleMemory) {
  const SavedMap saved = large_map();
  const std::string bytes = saved_map_bytes(saved);
  const std::size_t one = saved.views[0].view.bytes_in_memory();
  const MemoryLimit memory{one, test::own_path("views")};
  const SavedMap read = saved_map_from_bytes(bytes, "", memory);
  std::size_t in_memory = 0;
  for (const AnchoredView& view : read.views) in_memory += view.view.bytes_in_memory();
  EXPECT_EQ(in_memory, one);
  EXPECT_EQ(saved_map_bytes(read), bytes);
  EXPECT_EQ(test::resident_kib(memory.folder), 0) << "pages are dropped after their use";
  std::filesystem::remove_all(memory.folder);
}

/// Version 3 had no photos; version 2 had all views in one section, and no visits.
TEST(SavedMap, OfFormerVersionsIsRead) {
  const std::string bytes = saved_map_bytes(tiny_map());
  for (const std::uint32_t version : {2U, 3U}) {
    SectionFormat former = kMapFormat;
    former.version = version;
    auto sections = unpack_sections(kMapFormat, bytes, "");
    for (Section& section : sections) {
      if (is_dense(section)) section.bytes.resize(section.bytes.size() - 4);  // no size of a photo
    }
    if (version == 2) std::erase_if(sections, [](const Section& s) { return s.name[0] == 'V'; });
    const SavedMap read = saved_map_from_bytes(pack_sections(former, sections), "");
    EXPECT_EQ(describe_map(read).version, version);
    EXPECT_EQ(saved_map_bytes(read), bytes) << "it is written in the present one";
  }
}

TEST(SavedMap, KeepsThePhotosOfItsViews) {
  SavedMap saved = tiny_map();
  saved.views[0].view.photo = photo_of(cv::Mat3b(4, 4, cv::Vec3b(10, 20, 30)));
  const SavedMap read = saved_map_from_bytes(saved_map_bytes(saved), "");
  EXPECT_EQ(image_of(read.views[0].view.photo).size(), cv::Size(4, 4));
  EXPECT_EQ(saved_map_bytes(read), saved_map_bytes(saved));
}

TEST(SavedMap, WithoutASectionOfViewsIsAnError) {
  auto sections = unpack_sections(kMapFormat, saved_map_bytes(tiny_map()), "");
  std::erase_if(sections, is_dense);
  EXPECT_THAT(error_of(pack_sections(kMapFormat, sections)), HasSubstr("DENS"));
}

TEST(SavedMap, OfARunWithoutFramesIsEmptyAndCanBeExtended) {
  const Visit& seen = visit("xyz");
  SlamSystem blind(seen.camera(), recorded::small_options("static"));
  blind.finish();
  const SavedMap read = saved_map_from_bytes(saved_map_bytes(blind.saved_map("test")), "");
  EXPECT_EQ(error_of(saved_map_bytes(read)), "");
  const Outcome r = run(seen, StartingMap{read, true});
  EXPECT_GE(r.result.tracked(), seen.frames.size() - 15);
}

TEST(SavedMap, AFolderAMissingFileAndOneWithoutRoomAreErrors) {
  EXPECT_THROW(read_saved_map("no/such.map"), Error);
  EXPECT_THROW(read_saved_map("."), Error) << "a folder without a map";
  EXPECT_THROW(write_saved_map("no/such/folder.map", tiny_map()), Error);
}

TEST(SavedMap, AnotherPyramidIsAnError) {
  SlamParameters options = recorded::small_options("static");
  options.orb.levels = 6;
  const StartingMap start{first_visit().map, false};
  EXPECT_THROW(SlamSystem(visit("xyz").camera(), options, nullptr, start), Error);
}

TEST(Localizing, FindsTheSameFramesWhereTheyWere) {
  const Outcome again = run(visit("xyz"), StartingMap{first_visit().map, false});
  const Trajectory& before = first_visit().result.trajectory;
  const Trajectory& now = again.result.trajectory;
  ASSERT_EQ(now.size(), before.size());
  for (std::size_t i = 0; i < now.size(); ++i) {
    const Pose difference = before[i].T_world_camera.inverse() * now[i].T_world_camera;
    EXPECT_LT(difference.translation().norm(), 0.01) << i;
    EXPECT_LT(difference.angle(), 0.01) << i;
  }
}

TEST(Localizing, AnotherWayThroughTheMapIsWithinACentimeterOfTheTruth) {
  const Visit& second = visit("slower");
  const Outcome r = run(second, StartingMap{first_visit().map, false});
  EXPECT_EQ(r.result.tracked(), second.frames.size());
  EXPECT_EQ(r.result.maps, 1U);
  for (const double error : errors_in_first_world(second, r.result.trajectory)) {
    EXPECT_LT(error, 0.01);
  }
}

TEST(Localizing, WithAnotherCameraIsWithinACentimeterOfTheTruth) {
  const Visit& other = visit("longer");
  ASSERT_GT(other.camera().fx, 1.3 * visit("xyz").camera().fx);
  ASSERT_NE(other.camera().width, visit("xyz").camera().width);
  const Outcome r = run(other, StartingMap{first_visit().map, false});
  EXPECT_EQ(r.result.tracked(), other.frames.size());
  for (const double error : errors_in_first_world(other, r.result.trajectory))
    EXPECT_LT(error, 0.01);
}

/// Where few landmarks of the map are in view, from farther away than in the map, the matches of
/// books in shelves are wrong.
TEST(Localizing, FollowsTheOdometryWhereLandmarksContradictIt) {
  const SlamParameters options = parameters_of(read_options("fused"));
  const Visit& mapped = visit("loop");
  const Visit& all = visit("halfsphere");
  const Visit second{all.sequence, {all.frames.begin() + 80, all.frames.end()}};
  const SavedMap map = run(mapped, std::nullopt, options).map;
  const Outcome r = run(second, StartingMap{map, false}, options);
  EXPECT_GE(r.result.tracked(), second.frames.size() - 5);
  for (const double error : errors_in_world(mapped, second, r.result.trajectory))
    EXPECT_LT(error, 0.1);
}

TEST(Localizing, LeavesTheMapAsItIs) {
  const SavedMap before = saved_map_from_bytes(saved_map_bytes(first_visit().map), "");
  const SavedMap after = run(visit("slower"), StartingMap{before, false}).map;
  EXPECT_EQ(saved_map_bytes(after), saved_map_bytes(first_visit().map));
}

TEST(Localizing, ShowsTheCloudOfTheMap) {
  const SavedMap saved = saved_map_from_bytes(saved_map_bytes(first_visit().map), "");
  SlamParameters options = recorded::small_options("static");
  for (const bool realtime : {false, true}) {
    options.schedule.realtime = realtime;
    SlamSystem slam(visit("slower").camera(), options, nullptr, StartingMap{saved, false});
    for (const auto& frame : visit("slower").frames) slam.push(frame);
    const std::size_t live = slam.snapshot()->cloud->size();
    const SlamResult result = slam.finish();
    EXPECT_EQ(result.dense.cloud.size(), first_visit().result.dense.cloud.size());
    // The live map has voxels of twice the side.
    EXPECT_GT(live, result.dense.cloud.size() / 8);
    EXPECT_LT(live, result.dense.cloud.size());
  }
}

TEST(Localizing, RecognizesNothingAtAnUnknownPlace) {
  const Outcome r = run(visit("corner"), StartingMap{first_visit().map, false});
  EXPECT_EQ(r.result.tracked(), 0U);
  EXPECT_EQ(r.result.maps, 1U) << "none is begun";
  EXPECT_THAT(r.result.frames.back().reason, HasSubstr("not recognized"));
}

TEST(Localizing, InAPlaceThatOnlyLooksSimilarIsTold) {
  const Outcome yard = run(visit("yard"));
  for (const bool extend : {false, true}) {
    const auto texture_in = [&](const std::string& name) {
      return run(visit(name), StartingMap{yard.map, extend}).result.texture;
    };
    const TextureAgreement same = texture_in("yard"), other = texture_in("twin yard");
    EXPECT_TRUE(other.of_another_place() || extend);
    EXPECT_GE(other.regions, 50);
    EXPECT_LT(other.alike, 0.35 * other.regions);
    EXPECT_GE(same.regions, 20);
    EXPECT_GT(same.alike, 0.4 * same.regions);
  }
  EXPECT_EQ(yard.result.texture.regions, 0) << "without a loaded map";
}

TEST(Localizing, WorksInRealTimeToo) {
  SlamParameters options = recorded::small_options("static");
  options.schedule.realtime = true;
  const Visit& second = visit("slower");
  const Outcome r = run(second, StartingMap{first_visit().map, false}, options);
  EXPECT_GE(r.result.tracked(), 1U);
  for (const double error : errors_in_first_world(second, r.result.trajectory)) {
    EXPECT_LT(error, 0.02);
  }
}

TEST(Extending, AddsASessionInTheSameWorld) {
  const Visit& second = visit("rpy");
  const Outcome r = run(second, StartingMap{first_visit().map, true});
  EXPECT_EQ(r.result.tracked(), second.frames.size());
  EXPECT_EQ(r.map.map.first.size(), 1U) << "one component";
  EXPECT_GT(r.map.map.landmarks.size(), first_visit().map.map.landmarks.size());
  EXPECT_GT(r.map.views.size(), first_visit().map.views.size());
  const auto sessions = keyframe_trajectories(r.map.map);
  ASSERT_EQ(sessions.size(), 2U);
  EXPECT_EQ(sessions.at(1).size(), r.result.keyframes.size());
  for (const double error : errors_in_first_world(second, r.result.trajectory)) {
    EXPECT_LT(error, 0.015);
  }
}

TEST(Extending, OnTheSamePathAgainAndAgainTheDenseMapGrowsNoFurther) {
  std::vector<std::size_t> views;
  Outcome r = run(visit("slower"), StartingMap{first_visit().map, true});
  for (int visits = 0; visits < 4; ++visits) {
    views.push_back(r.map.views.size());
    r = run(visit("slower"), StartingMap{std::move(r.map), true});
  }
  EXPECT_LE(r.map.views.size(), views[1] + 2) << testing::PrintToString(views);
  EXPECT_GT(10 * r.result.dense.cloud.size(), 9 * run(visit("slower")).result.dense.cloud.size());
}

std::vector<std::uint16_t> visits_of(const SavedMap& map) {
  std::vector<std::uint16_t> visits;
  for (const AnchoredView& view : map.views) visits.push_back(view.view.visit);
  return visits;
}

TEST(Extending, WithAnotherCameraGivesAMapThatIsReadBack) {
  EXPECT_THAT(visits_of(first_visit().map), testing::Each(0));
  const Outcome r = run(visit("longer"), StartingMap{first_visit().map, true});
  EXPECT_THAT(visits_of(r.map), testing::IsSupersetOf({0, 1}));
  EXPECT_THAT(visits_of(r.map), testing::Each(testing::Le(1)));
  EXPECT_EQ(r.map.map.first.size(), 1U) << "one component";
  EXPECT_EQ(r.map.map.camera.width, visit("longer").camera().width);
  const SavedMap read = saved_map_from_bytes(saved_map_bytes(r.map), "");
  EXPECT_EQ(saved_map_bytes(read), saved_map_bytes(r.map));
  EXPECT_EQ(visits_of(read), visits_of(r.map));
}

TEST(Extending, ANewPlaceBecomesAComponentOfItsOwn) {
  const Visit& elsewhere = visit("corner");
  const Outcome r = run(elsewhere, StartingMap{first_visit().map, true});
  EXPECT_GE(r.result.tracked(), 75U) << "all but those during relocalization";
  EXPECT_EQ(r.map.map.first.size(), 2U);
  const SavedMap read = saved_map_from_bytes(saved_map_bytes(r.map), "");
  EXPECT_EQ(describe_map(read).components.size(), 2U) << "both are kept";
  const Outcome back = run(elsewhere, StartingMap{read, false});
  EXPECT_GE(back.result.tracked(), 88U) << "and recognized";
}

TEST(Extending, KeepsALoadedMapThatTrackedOnlyAFewFrames) {
  const std::size_t moments = 8;
  ASSERT_LT(moments, static_cast<std::size_t>(kMinMapFrames));
  const Visit briefly = one_after_the_other(visit("xyz"), moments, visit("corner"));
  const Outcome r = run(briefly, StartingMap{first_visit().map, true});
  EXPECT_EQ(r.map.map.first.size(), 2U);
  EXPECT_TRUE(r.result.events.empty()) << "no map is dropped or merged";
  EXPECT_GE(describe_map(r.map).components[0].keyframes,
            describe_map(first_visit().map).components[0].keyframes);
  EXPECT_GE(r.result.tracked(), briefly.frames.size() - 20);
}

TEST(MapDescription, CountsTheContent) {
  const MapDescription d = describe_map(first_visit().map);
  EXPECT_EQ(d.sessions, 1U);
  EXPECT_EQ(d.keyframes, first_visit().result.keyframes.size());
  EXPECT_EQ(d.landmarks, first_visit().result.landmarks);
  ASSERT_EQ(d.components.size(), 1U);
  EXPECT_EQ(d.components[0].keyframes, d.keyframes);
  EXPECT_EQ(d.visits, 1U);
  EXPECT_GT(d.components[0].extent.sizes().maxCoeff(), 1);
  EXPECT_LT(d.components[0].extent.sizes().maxCoeff(), 20);
  const auto graph = map_graph(first_visit().map);
  EXPECT_EQ(graph["keyframes"].size(), d.keyframes);
  EXPECT_GE(graph["covisible"].size(), d.keyframes - 1) << "the covisibility graph is connected";
  EXPECT_THAT(description_text(d), HasSubstr("written by test"));
}

TEST(SavedMap, IsMergedWithTheMapOfTheRunThatLoadsIt) {
  const Visit& visited = visit("slower");
  const LoadedWhileRunning loaded = load_after(40, visited);
  EXPECT_EQ(loaded.not_found, "");
  const SlamResult& result = loaded.outcome.result;
  EXPECT_EQ(result.trajectory.size(), visited.frames.size());
  EXPECT_EQ(result.maps, 1u);
  const std::vector<double> errors = errors_in_first_world(visited, result.trajectory);
  EXPECT_LT(*std::max_element(errors.begin(), errors.end()), 0.05);
  const auto of_first = describe_map(first_visit().map), all = describe_map(loaded.outcome.map);
  EXPECT_EQ(all.sessions, of_first.sessions + 1);
  EXPECT_GT(all.keyframes, of_first.keyframes);
  EXPECT_GT(all.views, of_first.views);
  EXPECT_EQ(result.keyframes.size() + of_first.keyframes, all.keyframes)
      << "the loaded keyframes do not count as keyframes of the run";
}

TEST(SavedMap, LoadedWhileRunningGivesTheSameBytesInEveryRun) {
  const auto bytes = [] { return saved_map_bytes(load_after(40, visit("slower")).outcome.map); };
  EXPECT_EQ(bytes(), bytes());
}

TEST(SavedMap, LoadedElsewhereIsFoundWhenTheCameraGetsThere) {
  const Visit way = one_after_the_other(visit("corner"), 40, visit("slower"));
  const LoadedWhileRunning loaded = load_after(30, way);
  EXPECT_THAT(loaded.not_found, Not(IsEmpty()));
  std::vector<double> errors;
  for (const StampedPose& e : loaded.outcome.result.trajectory) {
    const auto index = std::lround(e.timestamp * way.camera().fps) - 40;
    if (index < 0) continue;
    const Pose truth = visit("xyz").sequence->T_world_camera(0).inverse() *
                       visit("slower").sequence->T_world_camera(static_cast<std::size_t>(index));
    errors.push_back((e.T_world_camera.translation() - truth.translation()).norm());
  }
  ASSERT_GT(errors.size(), 60u);
  EXPECT_LT(*std::max_element(errors.begin(), errors.end()), 0.05);
}

TEST(SavedMap, CanBeLoadedBeforeTheFirstFrame) {
  const LoadedWhileRunning loaded = load_after(0, visit("slower"));
  EXPECT_EQ(loaded.not_found, "no keyframe has been made yet");
  EXPECT_EQ(loaded.outcome.result.maps, 1u);
  const std::vector<double> errors =
      errors_in_first_world(visit("slower"), loaded.outcome.result.trajectory);
  EXPECT_LT(*std::max_element(errors.begin(), errors.end()), 0.05);
}

TEST(SavedMap, TheCloudOfALocalizedRunIsOfTheComponentThatItIsIn) {
  std::vector<NamedMap> maps = {{"corner", run(visit("corner")).map}, {"xyz", first_visit().map}};
  const SavedMap both = merge_maps(maps, recorded::small_options("static"), "test").saved;
  ASSERT_EQ(both.map.first.size(), 2U);
  const auto shown = keyframe_trajectories(both.map, main_component(both));
  ASSERT_EQ(shown.size(), 1U) << "of one of the maps";
  EXPECT_EQ(landmark_cloud(both).size(), maps[shown.begin()->first].saved.map.landmarks.size());
  for (const NamedMap& place : maps) {
    const Outcome r = run(visit(place.name), StartingMap{both, false});
    ASSERT_EQ(r.result.frames_by_map.size(), 1U);
    const std::size_t alone =
        run(visit(place.name), StartingMap{place.saved, false}).result.dense.cloud.size();
    EXPECT_EQ(r.result.dense.cloud.size(), alone) << place.name;
  }
}

}  // namespace
}  // namespace stillmap
