// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/map_changes.hpp"

#include "stillmap/base/test_error.hpp"
#include "stillmap/pipeline/visits_test.hpp"

#include <map>
#include <set>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

using ::testing::HasSubstr;

NamedMap map_of(const std::string& name) {
  static std::map<std::string, SavedMap> made;
  if (!made.contains(name)) made[name] = visits::run(visits::visit(name)).map;
  return {name, made.at(name)};
}

MapChanges changes(const std::string& before, const std::string& after) {
  return find_changes(map_of(before), map_of(after), recorded::small_options("static"));
}

using Boxes = std::map<std::string, Eigen::AlignedBox3f>;

/// Returns the piece of furniture within 20 cm of the center of a surface; empty: there is none.
std::string piece_at(const ChangedSurface& surface, const std::string& world, const Boxes& pieces) {
  const Pose T_truth_map = visits::visit(world).sequence->T_world_camera(0);
  const Eigen::Vector3d center = T_truth_map * surface.box.center();
  for (const auto& [name, box] : pieces) {
    if (!box.isEmpty() && box.cast<double>().exteriorDistance(center) < 0.2) return name;
  }
  return {};
}

/// The furniture that went and that appeared.
using Pieces = std::pair<std::set<std::string>, std::set<std::string>>;

/// @param first, second  the boxes before and after
/// @param world  visit whose world is that of the changes
Pieces changed_pieces(const MapChanges& found, const std::string& world, const Boxes& first,
                      const Boxes& second) {
  Pieces pieces;
  for (const auto& [before, after] : found.changes) {
    if (before) pieces.first.insert(piece_at(*before, world, first));
    if (after) pieces.second.insert(piece_at(*after, world, second));
  }
  return pieces;
}

Boxes boxes_of(Eigen::AlignedBox3f Rearrangement::*time) {
  Boxes boxes;
  for (const Rearrangement& piece : visits::visit("xyz").sequence->scene().rearranged)
    boxes[piece.name] = piece.*time;
  return boxes;
}

const std::set<std::string> kGone{"bin", "printer"}, kNew{"parcel"};

TEST(MapChanges, TheObjectsThatChangedAreFoundAndNoOthers) {
  const Boxes first = boxes_of(&Rearrangement::first), second = boxes_of(&Rearrangement::second);
  const MapChanges found = changes("xyz", "rearranged");
  // Of the shelf and the cabinet, four and five meters away, this path shows edges only.
  EXPECT_EQ(changed_pieces(found, found.world, first, second), Pieces(kGone, kNew))
      << changes_text(found);
  EXPECT_EQ(changes_json(found)["changes"].size(), found.changes.size());
  std::size_t points = 0;
  for (const auto& [before, after] : found.changes)
    points += (before ? before->points.size() : 0) + (after ? after->points.size() : 0);
  EXPECT_EQ(changes_cloud(found).size(), points);
}

/// The old and the new place of the sofa overlap, and at its new place it hides half of the shelf.
TEST(MapChanges, PiecesOfWhichAPartIsSeenAreToldAsMoved) {
  const Boxes first = boxes_of(&Rearrangement::first), second = boxes_of(&Rearrangement::second);
  const MapChanges found = changes("round", "rearranged round");
  const std::string& world = found.world;
  std::set<std::pair<std::string, std::string>> moved;
  for (const auto& [before, after] : found.changes) {
    if (before && after)
      moved.emplace(piece_at(*before, world, first), piece_at(*after, world, second));
  }
  EXPECT_THAT(moved,
              testing::IsSupersetOf({std::pair("sofa", "sofa"), std::pair("shelf", "shelf")}))
      << changes_text(found);
  for (const auto& [before, after] : moved) EXPECT_EQ(before, after);
}

TEST(MapChanges, OfAMapThatExtendsTheOtherAreThoseOfItsOwnVisit) {
  const auto extended = [](const SavedMap& map, const char* visit) {
    return visits::run(visits::visit(visit), StartingMap{map, true}).map;
  };
  const SavedMap first = map_of("xyz").saved, second = extended(first, "rearranged");
  const SavedMap third = extended(second, "slower");
  const MapChanges there =
      find_changes({"1", first}, {"2", second}, recorded::small_options("static"));
  const MapChanges back =
      find_changes({"2", second}, {"3", third}, recorded::small_options("static"));
  const Boxes at_first = boxes_of(&Rearrangement::first), then = boxes_of(&Rearrangement::second);
  EXPECT_EQ(changed_pieces(there, "xyz", at_first, then), Pieces(kGone, kNew));
  EXPECT_EQ(changed_pieces(back, "xyz", then, at_first), Pieces(kNew, kGone));
  EXPECT_THAT(test::error_of([&] {
                find_changes({"2", second}, {"1", first}, recorded::small_options("static"));
              }),
              HasSubstr("name maps of different visits, the earlier one first"));
}

TEST(MapChanges, OfTheSameRecordingAreAnError) {
  const auto error = [](const char* name, SavedMap after) {
    return test::error_of([&] {
      find_changes(map_of(name), {"after", std::move(after)}, recorded::small_options("static"));
    });
  };
  const SavedMap first = map_of("xyz").saved;
  EXPECT_THAT(error("xyz", first), HasSubstr("has no visit that xyz does not have"));
  SavedMap again = visits::run(visits::visit("xyz"), StartingMap{first, true}).map;
  again.views.push_back(first.views.front());
  again.views.back().view.visit = 1;
  EXPECT_THAT(error("xyz", again), HasSubstr("made of a recording that xyz was made of"));
}

TEST(MapChanges, OfMapsThatShowNoCommonSurfaceAreAnError) {
  MergedMap merged =
      merge_maps({map_of("xyz"), map_of("corner")}, recorded::small_options("static"), "");
  SavedMap both = std::move(merged.saved);
  std::erase_if(both.views, [&](const AnchoredView& view) {
    return merged.names[both.map.keyframes[view.anchor.slot].session] == "xyz";
  });
  EXPECT_THAT(test::error_of([&] {
                find_changes(map_of("xyz"), {"both", both}, recorded::small_options("static"));
              }),
              HasSubstr("shows no surface that xyz shows, too"));
}

TEST(MapChanges, OfTheNewestVisitAreFoundInAMapOfBoth) {
  const SavedMap first = map_of("xyz").saved;
  SlamSystem slam(visits::visit("rearranged").camera(), recorded::small_options("static"), nullptr,
                  StartingMap{first, true});
  for (const auto& frame : visits::visit("rearranged").frames) slam.push(frame);
  slam.wait_for_map();
  const MapChanges found{newest_changes(slam.saved_map("test"), {}), {}, {}, {}};
  EXPECT_EQ(changed_pieces(found, "xyz", boxes_of(&Rearrangement::first),
                           boxes_of(&Rearrangement::second)),
            Pieces(kGone, kNew));
  EXPECT_TRUE(newest_changes(first, {}).empty());
}

TEST(MapChanges, AnotherPathIsNoChange) {
  const MapChanges found = changes("xyz", "slower");
  EXPECT_TRUE(found.changes.empty()) << changes_text(found);
  EXPECT_GT(found.before.compared, 0.9);
  EXPECT_GT(found.after.compared, 0.9);
}

TEST(MapChanges, WhatASingleViewShowsIsNoObject) {
  // The edge of somebody who moved: a surface in front of all others, in one view or in two.
  const auto changes_with = [](std::size_t views) {
    NamedMap after = map_of("slower");
    after.saved.views.resize(2);
    for (std::size_t i = 0; i < views; ++i) {
      DenseView& view = after.saved.views[i].view;
      view.depth = view.depth.clone();
      view.kind = view.kind.clone();
      const cv::Rect patch(view.depth.cols / 2 - 15, view.depth.rows / 2 - 15, 30, 30);
      view.depth(patch) = static_cast<std::uint16_t>(0.8 / DenseView::kDepthUnit);
      view.kind(patch) = kStaticSurface;
      view.pages = nullptr;
    }
    return find_changes(map_of("xyz"), std::move(after), recorded::small_options("static")).changes;
  };
  EXPECT_EQ(changes_with(2).size(), 1U);
  EXPECT_TRUE(changes_with(1).empty());
}

TEST(MapChanges, MapsOfOtherPlacesOrWithoutViewsAreErrors) {
  EXPECT_THAT(test::error_of([] { changes("rpy", "corner"); }), HasSubstr("shows no place of"));
  NamedMap slim = map_of("xyz");
  slim.saved.views.clear();
  EXPECT_THAT(test::error_of([&] {
                find_changes(map_of("slower"), std::move(slim), recorded::small_options("static"));
              }),
              HasSubstr("contains no dense map"));
}

}  // namespace
}  // namespace stillmap
