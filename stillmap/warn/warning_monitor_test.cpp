// SPDX-License-Identifier: Apache-2.0
#include "stillmap/warn/warning_monitor.hpp"

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr double kFrame = 0.1;  // time between two frames [s]

/// A square of two meters around the origin, on the floor y = 1 (y points down).
Zone square() {
  return {
      .name = "gate", .polygon = {{-1, 1, -1}, {1, 1, -1}, {1, 1, 1}, {-1, 1, 1}}, .classes = {}};
}

/// A person of 0.4 m x 1.8 m x 0.4 m who stands on the floor.
WatchedMover person(double x, double z, const Eigen::Vector3d& velocity = {0, 0, 0}) {
  const Eigen::Vector3d centroid(x, 0.1, z), half(0.2, 0.9, 0.2);
  return {.id = 3,
          .class_name = "person",
          .confidence = 0.8,
          .observed = true,
          .centroid = centroid,
          .velocity = velocity,
          .box = Eigen::AlignedBox3d(centroid - half, centroid + half)};
}

/// Feeds frames to a monitor, and collects short descriptions of the events.
class Watch {
 public:
  explicit Watch(const WarningRules& rules) : monitor_(rules) {}

  void frame(std::vector<WatchedMover> movers, const std::optional<Pose>& pose = Pose()) {
    WatchedFrame frame{.index = index_,
                       .timestamp = kFrame * static_cast<double>(index_),
                       .T_world_camera = pose,
                       .movers = std::move(movers)};
    add(frame);
  }
  void add(WatchedFrame frame) {
    frame.index = index_;
    frame.timestamp = kFrame * static_cast<double>(index_++);
    for (const WarningEvent& event : monitor_.update(frame))
      texts_.push_back(std::to_string(event.frame) + " " + warning_text(event));
  }
  std::vector<std::string> texts() const { return texts_; }

 private:
  WarningMonitor monitor_;
  std::size_t index_ = 0;
  std::vector<std::string> texts_;
};

TEST(Zone, DistancesAreMeasuredAlongTheFloor) {
  EXPECT_EQ(level_distance(square(), {0.5, -7, 0.5}), 0);
  EXPECT_NEAR(level_distance(square(), {3, 5, 0}), 2, 1e-12);
  EXPECT_NEAR(level_distance(square(), {4, 0, 5}), 5, 1e-12);
}

TEST(Zone, ANotchOfAPolygonIsOutside) {
  Zone zone = square();
  zone.polygon.insert(zone.polygon.begin() + 3, {0, 1, 0});  // (1, 1) -> (0, 0) -> (-1, 1)
  EXPECT_GT(level_distance(zone, {0, 1, 0.9}), 0.1);
  EXPECT_EQ(level_distance(zone, {0, 1, -0.5}), 0);
}

TEST(Zone, AnObjectAboveOrBelowItsHeightsIsOutside) {
  Zone zone = square();
  zone.low = 2.2;
  zone.high = 4;
  const WatchedMover standing = person(0, 0);  // up to a height of 1.8 m
  const UprightCylinder space = cylinder_in(standing.box, standing.centroid, zone.up);
  EXPECT_FALSE(reaches_into(zone, space));
  zone.low = 1.5;
  EXPECT_TRUE(reaches_into(zone, space));
}

TEST(UprightCylinder, IsThatOfTheBoxInEveryWorld) {
  for (const double tilt : {0.0, 0.3, 0.7, 1.2}) {
    const Eigen::Vector3d up(0, -std::cos(tilt), -std::sin(tilt));
    const Eigen::Vector3d center(1, 2, 3);
    Eigen::Vector3d half;  // of the box around a person of 1.8 m and 0.25 m
    for (int i = 0; i < 3; ++i)
      half[i] = 0.9 * std::abs(up[i]) + 0.25 * std::sqrt(1 - up[i] * up[i]);
    const Eigen::AlignedBox3d box(center - half, center + half);
    const UprightCylinder space = cylinder_in(box, center, up);
    EXPECT_NEAR(space.height, 1.8, 1e-9);
    EXPECT_NEAR(space.radius, 0.25, 1e-9);
    EXPECT_NEAR((space.center - center).norm(), 0, 1e-9);
    const Eigen::Vector3d aside(1, 0, 0);
    EXPECT_NEAR(distance_of(space, center + 2 * aside + up, up, true), 1.75, 1e-9);
    EXPECT_NEAR(distance_of(space, center + 3 * up, up, false), 2.1, 1e-9);
    EXPECT_EQ(distance_of(space, center + 0.2 * aside, up, false), 0);
  }
}

TEST(UprightCylinder, OfAFlatBoxHasNoNegativeSize) {
  const Eigen::AlignedBox3d flat(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(2, 0.01, 0.01));
  const UprightCylinder space =
      cylinder_in(flat, flat.center(), {0, -0.7071067811865475, -0.7071067811865475});
  EXPECT_GE(space.radius, 0);
  EXPECT_GE(space.height, 0);
}

TEST(Zone, ATiltedWorldChangesNothing) {
  const Pose turn(Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 0).normalized())),
                  {1, 2, 3});
  Zone zone = square();
  const Eigen::Vector3d inside(0.9, 0, 0.9), outside(1.6, 0, 0);
  const double distance = level_distance(zone, outside);
  for (Eigen::Vector3d& corner : zone.polygon) corner = turn * corner;
  zone.up = turn.rotation() * zone.up;
  EXPECT_EQ(level_distance(zone, turn * inside), 0);
  EXPECT_NEAR(level_distance(zone, turn * outside), distance, 1e-9);
}

TEST(WarningMonitor, WarnsInTheFirstFrameInAZoneAndEndsAfterTheHold) {
  Watch watch({.zones = {square()}, .distances = {}});
  watch.frame({person(3, 0)});
  watch.frame({person(0.5, 0)});
  for (int i = 0; i < 7; ++i) watch.frame({person(3, 0)});
  EXPECT_THAT(watch.texts(), ElementsAre("1 person 3 is in zone 'gate'",
                                         "6 clear: person 3 has left zone 'gate'"));
}

TEST(WarningMonitor, DoesNotFlickerAtTheBorder) {
  Watch watch({.zones = {square()}, .distances = {}});
  for (int i = 0; i < 30; ++i) watch.frame({person(i % 3 == 0 ? 1.1 : 1.4, 0)});
  EXPECT_THAT(watch.texts(), ElementsAre("0 person 3 is in zone 'gate'"));
}

TEST(WarningMonitor, AMoverThatVanishesIsOutOfSightNotClear) {
  Watch watch({.zones = {square()}, .distances = {}});
  watch.frame({person(0, 0)});
  for (int i = 0; i < 6; ++i) watch.frame({});
  EXPECT_THAT(watch.texts(), ElementsAre("0 person 3 is in zone 'gate'",
                                         "5 out of sight: person 3, last in zone 'gate'"));
}

TEST(WarningMonitor, OtherClassesAreIgnored) {
  Zone zone = square();
  zone.classes = {"car"};
  Watch watch({.zones = {zone}, .distances = {}});
  watch.frame({person(0, 0)});
  EXPECT_THAT(watch.texts(), IsEmpty());
}

DistanceRule camera_rule(double nearer, double within = 0) {
  return {.name = "camera", .nearer = nearer, .within = within, .classes = {}};
}

TEST(WarningMonitor, TheDistanceIsThatOfTheNearestSurfaceWithAMargin) {
  Watch watch({.zones = {}, .distances = {camera_rule(2)}});
  watch.frame({person(0, 2.3)});  // the box begins at 2.1 m
  watch.frame({person(0, 2.1)});
  for (int i = 0; i < 9; ++i) watch.frame({person(0, 2.3)});  // within the margin of 10 %
  for (int i = 0; i < 9; ++i) watch.frame({person(0, 2.5)});
  EXPECT_THAT(watch.texts(), ElementsAre("1 person 3 is 1.9 m from the camera",
                                         "15 clear: person 3 is no longer near the camera"));
}

TEST(WarningMonitor, ACourseIsWarnedOfBeforeItComesNear) {
  Watch watch({.zones = {}, .distances = {camera_rule(1, 2)}});
  for (int i = 0; i < 20; ++i) watch.frame({person(0, 5 - 0.1 * i, {0, 0, -1})});
  // Box ahead of 4.8 - 0.1 i [m]; below 1 m + 2 s x 1 m/s from frame 19 on.
  EXPECT_THAT(watch.texts(), ElementsAre("19 person 3 will be 0.9 m from the camera in 2.0 s"));
}

TEST(WarningMonitor, APersonWhoPassesOrGoesAwayIsNoCourse) {
  Watch watch({.zones = {}, .distances = {camera_rule(1, 2)}});
  for (int i = 0; i < 20; ++i) watch.frame({person(-1 + 0.1 * i, 3, {1, 0, 0})});
  for (int i = 0; i < 20; ++i) watch.frame({person(0, 2 + 0.1 * i, {0, 0, 1})});
  EXPECT_THAT(watch.texts(), IsEmpty());
}

TEST(WarningMonitor, ACameraThatDrivesTowardsAPersonIsACourse) {
  Watch watch({.zones = {}, .distances = {camera_rule(1, 2)}});
  for (int i = 0; i < 6; ++i)
    watch.frame({person(0, 3)}, Pose(Eigen::Quaterniond::Identity(), {0, 0, 0.1 * i}));
  EXPECT_EQ(watch.texts().size(), 1U);
}

TEST(WarningMonitor, TheLevelDistanceOfARaisedHookIgnoresItsHeight) {
  DistanceRule rule{.name = "hook",
                    .point = "hook",
                    .offset = {0, -4, 6},
                    .nearer = 1,
                    .level = true,
                    .classes = {}};
  Watch level({.zones = {}, .distances = {rule}});
  level.frame({person(0, 6)});
  EXPECT_THAT(level.texts(), ElementsAre("0 person 3 is 0.0 m from the hook"));
  rule.level = false;
  Watch in_space({.zones = {}, .distances = {rule}});
  in_space.frame({person(0, 6)});
  EXPECT_THAT(in_space.texts(), IsEmpty());
}

TEST(WarningMonitor, WhatIsNotKnownIsAWarning) {
  Watch watch({.zones = {square()}, .distances = {}});
  watch.frame({}, std::nullopt);
  WatchedFrame dark;
  dark.T_world_camera = Pose();
  dark.depth_share = 0.1;
  watch.add(dark);
  WatchedFrame late;
  late.T_world_camera = Pose();
  late.mask_age = 1;
  watch.add(late);
  WatchedFrame old;
  old.T_world_camera = Pose();
  old.movers_age = 1;
  watch.add(old);
  EXPECT_THAT(
      watch.texts(),
      ElementsAre("0 not known: the camera is lost", "1 not known: there is hardly any depth",
                  "2 not known: the network is late", "3 not known: the moving objects are late"));
}

TEST(WarningMonitor, AZoneOutOfViewIsNotSeenToBeClear) {
  Watch watch({.zones = {square()}, .distances = {}});
  const auto seen = [&](double share, int frames) {
    for (int i = 0; i < frames; ++i) {
      WatchedFrame frame;
      frame.T_world_camera = Pose();
      frame.zones_seen = {share};
      watch.add(frame);
    }
  };
  seen(0.9, 2);
  seen(0.4, 2);
  seen(0.52, 10);  // within the margin
  seen(0.9, 9);
  EXPECT_THAT(watch.texts(),
              ElementsAre("2 zone 'gate' is not in view", "18 zone 'gate' is in view"));
}

TEST(WarningMonitor, WhatNoFrameTellsIsAnnouncedOnceAndEndsWithTheFramesAfterIt) {
  WarningMonitor monitor({.zones = {square()}, .distances = {}});
  WatchedFrame frame;
  frame.T_world_camera = Pose();
  monitor.update(frame);
  ASSERT_EQ(monitor.announce("no image comes").size(), 1U);
  EXPECT_TRUE(monitor.announce("no image comes").empty());
  EXPECT_EQ(monitor.active().size(), 1U);
  frame.timestamp = 3;
  const auto ended = monitor.update(frame);
  ASSERT_EQ(ended.size(), 1U);
  EXPECT_FALSE(ended[0].begins);
}

TEST(WarningMonitor, WarningsStayWhileTheCameraIsLost) {
  Watch watch({.zones = {square()}, .distances = {}});
  watch.frame({person(0, 0)});
  for (int i = 0; i < 20; ++i) watch.frame({}, std::nullopt);
  EXPECT_THAT(watch.texts(),
              ElementsAre("0 person 3 is in zone 'gate'", "1 not known: the camera is lost"));
}

TEST(WarningMonitor, TwoDistancesOfOnePointWarnBoth) {
  DistanceRule alarm = camera_rule(1.7);
  alarm.name = "alarm";
  Watch watch({.zones = {}, .distances = {camera_rule(3), alarm}});
  watch.frame({person(0, 2.7)});
  watch.frame({person(0, 1.7)});
  for (int i = 0; i < 6; ++i) watch.frame({person(0, 2.7)});
  EXPECT_THAT(watch.texts(), ElementsAre("0 person 3 is 2.5 m from the camera",
                                         "1 alarm: person 3 is 1.5 m from the camera",
                                         "6 clear: person 3 is no longer near the camera (alarm)"));
}

TEST(WarningMonitor, AClassBelowTheConfidenceOfTheRuleCountsAsUnknown) {
  Zone zone = square();
  zone.classes = {"person"};
  zone.confidence = 0.81;  // the person has 0.8
  Watch strict({.zones = {zone}, .distances = {}});
  strict.frame({person(0, 0)});
  EXPECT_THAT(strict.texts(), IsEmpty());
  zone.classes = {"person", "unknown"};
  Watch wide({.zones = {zone}, .distances = {}});
  wide.frame({person(0, 0)});
  EXPECT_THAT(wide.texts(), ElementsAre("0 person 3 is in zone 'gate'"));
}

TEST(WarningMonitor, NothingWarnsOfTheOwnLoadButOfPeopleAtIt) {
  WatchedMover load = person(0, 6);
  load.class_name = "unknown";
  const OwnLoad hook{"hook", {0, 0.1, 5.6}, 0.5};
  Watch watch({.zones = {}, .distances = {camera_rule(9)}, .loads = {hook}});
  watch.frame({load});
  EXPECT_THAT(watch.texts(), IsEmpty());
  watch.frame({person(0, 6)});
  EXPECT_THAT(watch.texts(), ElementsAre("1 person 3 is 5.8 m from the camera"));
  load.id = 4;
  load.centroid.x() += 0.5;  // too far from the hook
  watch.frame({load});
  EXPECT_EQ(watch.texts().size(), 2U);
}

TEST(WarningMonitor, EventsAreNumbered) {
  WarningMonitor monitor({.zones = {square()}, .distances = {camera_rule(3)}});
  WatchedFrame frame;
  frame.T_world_camera = Pose();
  frame.movers = {person(0, 0)};
  const auto begun = monitor.update(frame);
  ASSERT_EQ(begun.size(), 2U);
  EXPECT_EQ(begun[0].id, 1U);
  EXPECT_EQ(begun[1].id, 2U);
  EXPECT_EQ(warning_json(monitor.announce("the run has ended").at(0)).at("id"), 3);
  frame.timestamp = 3;
  frame.movers = {};
  EXPECT_EQ(monitor.update(frame).back().id, 6U);
}

TEST(EventsMessage, PairsBeginsWithTheirEnds) {
  WarningEvent begin;
  begin.rule = "gate";
  begin.mover = 3;
  begin.class_name = "person";
  begin.timestamp = 1.5;
  WarningEvent end = begin, other = begin;
  end.begins = false;
  end.timestamp = 2.5;
  other.mover = 4;
  const nlohmann::json events = events_message(warnings_of({begin, other, end})).at("events");
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].at("timestamp"), 1.5);
  EXPECT_EQ(events[0].at("end"), 2.5);
  EXPECT_TRUE(events[1].at("end").is_null());
  EXPECT_EQ(events[1].at("mover"), 4);
}

TEST(WarningsMessage, HasTheFieldsOfTheEventAndTheIdOfItsBegin) {
  WarningMonitor monitor({.zones = {}, .distances = {camera_rule(3)}});
  WatchedFrame frame;
  frame.T_world_camera = Pose();
  frame.movers = {person(0, 2)};
  const auto begun = monitor.update(frame);
  EXPECT_EQ(warnings_message(monitor.active(), 1).at("active").at(0), warning_json(begun.at(0)));
  frame.timestamp = 0.1;
  frame.movers = {person(0, 1.5)};
  EXPECT_TRUE(monitor.update(frame).empty());
  const nlohmann::json later = warnings_message(monitor.active(), 1).at("active").at(0);
  EXPECT_EQ(later.at("id"), begun.at(0).id);
  EXPECT_LT(later.at("distance"), begun.at(0).distance);
}

TEST(WarningText, OfAMoverWithoutANumberNamesItsClass) {
  WarningEvent event;
  event.rule = "gate";
  event.mover = -3;
  event.class_name = "person";
  EXPECT_EQ(warning_text(event), "person is in zone 'gate'");
}

TEST(WarningOf, IsTheInverseOfWarningJson) {
  WarningMonitor monitor({.zones = {square()}, .distances = {camera_rule(3)}});
  WatchedFrame frame;
  frame.T_world_camera = Pose();
  frame.zones_seen = {0.1};
  frame.movers = {person(0, 2)};
  std::vector<WarningEvent> events = monitor.update(frame);
  frame.timestamp = 3;
  frame.T_world_camera.reset();
  for (const WarningEvent& event : monitor.update(frame)) events.push_back(event);
  EXPECT_GE(events.size(), 3U);
  for (const WarningEvent& event : events) {
    const nlohmann::json json = warning_json(event);
    EXPECT_EQ(warning_json(warning_of(json)), json);
  }
}

TEST(WarningJson, HasPoseMoverDistanceAndConfidence) {
  WarningMonitor monitor({.zones = {}, .distances = {camera_rule(3)}});
  WatchedFrame frame;
  frame.T_world_camera = Pose();
  frame.movers = {person(0, 2)};
  const nlohmann::json json = warning_json(monitor.update(frame).at(0));
  EXPECT_EQ(json.at("event"), "begin");
  EXPECT_EQ(json.at("kind"), "near");
  EXPECT_EQ(json.at("camera").size(), 7U);
  EXPECT_EQ(json.at("mover"), 3);
  EXPECT_EQ(json.at("point"), "camera");
  EXPECT_EQ(json.at("nearer"), 3);
  EXPECT_NEAR(json.at("distance").get<double>(), 1.8, 1e-3);
  EXPECT_NEAR(json.at("confidence").get<double>(), 0.8, 1e-9);
}

}  // namespace
}  // namespace stillmap
