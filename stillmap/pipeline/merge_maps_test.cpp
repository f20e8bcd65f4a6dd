// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/merge_maps.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/pipeline/map_description.hpp"
#include "stillmap/pipeline/saved_views.hpp"
#include "stillmap/pipeline/visits_test.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

using visits::run;
using visits::visit;

const SavedMap& map_of(const std::string& name) {
  static std::map<std::string, SavedMap> made;
  if (!made.contains(name)) made[name] = run(visit(name)).map;
  return made.at(name);
}

MergedMap merged(const std::vector<std::string>& names) {
  std::vector<NamedMap> maps;
  for (const std::string& name : names) maps.push_back({name, map_of(name)});
  return merge_maps(std::move(maps), recorded::small_options("static"), "test");
}

/// Returns the root mean square distance of all keyframes from the truth after one alignment of all
/// sessions together [m].
double error_of(const MergedMap& map) {
  std::vector<Eigen::Vector3d> truth, estimate;
  for (const auto& [session, keyframes] : keyframe_trajectories(map.saved.map)) {
    const visits::Visit& visited = visit(map.names.at(session));
    for (const StampedPose& k : keyframes) {
      const auto frame = static_cast<std::size_t>(std::lround(k.timestamp * visited.camera().fps));
      truth.push_back(visited.sequence->T_world_camera(frame).translation());
      estimate.push_back(k.T_world_camera.translation());
    }
  }
  const auto matrix = [](const std::vector<Eigen::Vector3d>& points) {
    return Eigen::Matrix3Xd(
        Eigen::Map<const Eigen::Matrix3Xd>(points.front().data(), 3, std::ssize(points)));
  };
  const Pose T_truth_map = align_points(matrix(truth), matrix(estimate));
  double sum = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    sum += (truth[i] - T_truth_map * estimate[i]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

TEST(MergeMaps, VisitsOfOneRoomLieInOneWorld) {
  const MergedMap map = merged({"xyz", "rpy", "slower"});
  EXPECT_EQ(map.saved.map.first.size(), 1U) << "one component";
  EXPECT_LT(error_of(map), 0.005);
  ASSERT_EQ(map.pairs.size(), 3U);
  for (const MapPair& pair : map.pairs) {
    EXPECT_TRUE(pair.connected);
    EXPECT_GE(pair.places, 2U);
    EXPECT_GE(pair.inliers, 50);
    EXPECT_EQ(pair.reason, "");
  }
  const std::size_t landmarks = map_of("xyz").map.landmarks.size() +
                                map_of("rpy").map.landmarks.size() +
                                map_of("slower").map.landmarks.size();
  EXPECT_LT(map.saved.map.landmarks.size(), landmarks * 3 / 4) << "the same points are one";
}

TEST(MergeMaps, TheOrderOfTheMapsDoesNotMatter) {
  const std::string bytes = saved_map_bytes(merged({"xyz", "rpy", "slower", "corner"}).saved);
  EXPECT_EQ(saved_map_bytes(merged({"corner", "slower", "xyz", "rpy"}).saved), bytes);
  EXPECT_EQ(saved_map_bytes(merged({"rpy", "corner", "slower", "xyz"}).saved), bytes);
}

TEST(MergeMaps, AMergedMapLocalizesTheCamera) {
  const MergedMap map = merged({"xyz", "rpy"});
  const SavedMap read = saved_map_from_bytes(saved_map_bytes(map.saved), "");
  EXPECT_EQ(read.views.size(), map_of("xyz").views.size() + map_of("rpy").views.size());
  const visits::Outcome r = run(visit("slower"), StartingMap{read, false});
  EXPECT_EQ(r.result.tracked(), visit("slower").frames.size());
}

TEST(MergeMaps, MapsOfDifferentPlacesStayApartAndTheReasonIsGiven) {
  const MergedMap map = merged({"xyz", "corner"});
  EXPECT_EQ(map.saved.map.first.size(), 2U);
  ASSERT_EQ(map.pairs.size(), 1U);
  EXPECT_FALSE(map.pairs[0].connected);
  EXPECT_EQ(map.pairs[0].places, 0U);
  EXPECT_NE(map.pairs[0].reason, "");
  EXPECT_THAT(merge_text(map), ::testing::HasSubstr("not connected: " + map.pairs[0].reason));
  EXPECT_EQ(merge_json(map)["pairs"][0]["connected"], false);
  ASSERT_EQ(map.names.size(), 2U);
  for (const auto& [component, name] :
       {std::pair("0", map.names[0]), std::pair("1", map.names[1])}) {
    EXPECT_EQ(merge_json(map)["components"][component], nlohmann::json({name}));
    EXPECT_THAT(merge_text(map), ::testing::HasSubstr(std::string("component ") + component +
                                                      ": keyframes of " + name + "\n"));
  }
}

TEST(MergeMaps, MergedMapsAreMergedAgainAndCommonKeyframesKeptOnce) {
  const SavedMap first = merged({"xyz", "rpy"}).saved, second = merged({"rpy", "slower"}).saved;
  const MergedMap map =
      merge_maps({{"first", first}, {"second", second}}, recorded::small_options("static"), "test");
  EXPECT_EQ(map.saved.map.first.size(), 1U);
  EXPECT_GE(map.repeated, map_of("rpy").map.keyframes.size() / 2);
  std::set<std::pair<double, Descriptor>> frames;
  for (const Keyframe& k : map.saved.map.keyframes) {
    EXPECT_TRUE(frames.emplace(k.timestamp, k.features->descriptors[0]).second)
        << "the keyframe of " << k.timestamp << " s is there twice";
  }
  std::set<std::uint64_t> images;
  for (const AnchoredView& view : map.saved.views) images.insert(image_hash(view.view));
  EXPECT_EQ(images.size(), map.saved.views.size()) << "every view is there once";
  std::set<std::uint64_t> given;
  for (const SavedMap* each : {&first, &second})
    for (const AnchoredView& view : each->views) given.insert(image_hash(view.view));
  EXPECT_EQ(images, given);
}

/// Returns the map of a visit as if it had been made later.
NamedMap later(const std::string& visit, int hours) {
  NamedMap map{fmt::format("{}+{}h", visit, hours), map_of(visit)};
  for (Keyframe& k : map.saved.map.keyframes) k.timestamp += 3600 * hours;
  for (AnchoredView& view : map.saved.views)  // another image
    view.view.color(0, 0) = cv::Vec3b::all(static_cast<std::uint8_t>(hours));
  return map;
}

TEST(MergeMaps, MoreThanTenMapsAreMergedInGroupsAndEachPairIsReported) {
  std::vector<NamedMap> maps = {later("corner", 0)};
  for (int hours = 1; hours <= 11; ++hours) maps.push_back(later("xyz", hours));
  std::reverse(maps.begin(), maps.end());
  const MergedMap map = merge_maps(std::move(maps), recorded::small_options("static"), "test");
  EXPECT_EQ(map.saved.map.first.size(), 2U);
  ASSERT_EQ(map.names.size(), 12U);
  EXPECT_EQ(map.names.front(), "corner+0h");
  ASSERT_EQ(map.pairs.size(), 66U);
  for (const MapPair& pair : map.pairs) {
    EXPECT_LT(pair.a, pair.b);
    EXPECT_EQ(pair.connected, pair.a > 0) << pair.a << " and " << pair.b;
    EXPECT_EQ(pair.reason == "connected by other maps", pair.connected && pair.places == 0);
  }
  std::set<std::uint32_t> sessions;
  for (const Keyframe& k : map.saved.map.keyframes) {
    sessions.insert(k.session);
    EXPECT_EQ(k.session, static_cast<std::uint32_t>(k.timestamp / 3600)) << "position of its map";
  }
  EXPECT_TRUE(sessions.contains(0));
  EXPECT_GT(*sessions.rbegin(), 6U) << "of the second group, too";
  EXPECT_LT(map.saved.map.keyframes.size(), 4 * map_of("xyz").map.keyframes.size());
  EXPECT_THAT(map.first_sessions, ::testing::ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11));
  const std::string text = merge_text(map);
  EXPECT_THAT(text, ::testing::HasSubstr("one world: corner+0h (1 map)\n"
                                         "  closest to another: corner+0h - xyz+"));
  EXPECT_THAT(text, ::testing::HasSubstr("one world: xyz+1h, xyz+2h, "));
  EXPECT_THAT(text, ::testing::HasSubstr(", xyz+11h (11 maps)\n"));
  EXPECT_THAT(text, ::testing::HasSubstr("component 0 is in the world of corner+0h\n"));
}

TEST(MergeMaps, ACameraOfAnotherFocalLengthJoinsToo) {
  const MergedMap map = merged({"xyz", "longer"});
  EXPECT_EQ(map.saved.map.first.size(), 1U);
  EXPECT_LT(error_of(map), 0.005);
  const SavedMap read = saved_map_from_bytes(saved_map_bytes(map.saved), "");
  EXPECT_EQ(saved_map_bytes(read), saved_map_bytes(map.saved));
}

TEST(MergeMaps, OneMapTheSameMapTwiceAndOtherPyramidsAreErrors) {
  EXPECT_THROW(merged({"xyz"}), Error);
  EXPECT_THROW(merged({"xyz", "rpy", "xyz"}), Error);
  SavedMap other = map_of("rpy");
  other.map.pyramid.levels = 6;
  EXPECT_THROW(
      merge_maps({{"a", map_of("xyz")}, {"b", other}}, recorded::small_options("static"), "test"),
      Error);
}

}  // namespace
}  // namespace stillmap
