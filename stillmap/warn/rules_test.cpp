// SPDX-License-Identifier: Apache-2.0
#include "stillmap/warn/rules.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"

#include <gmock/gmock.h>

namespace stillmap {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

WarningRules rules_in(const std::string& text) {
  const auto file = test::own_path("rules.yaml");
  write_file(file, text);
  return read_warning_rules(file);
}

constexpr const char* kZone = "{name: gate, polygon: [[0, 1, 0], [1, 1, 0], [1, 1, 1]]}";

TEST(WarningRules, AFileIsRead) {
  const WarningRules rules = rules_in(
      "up: [0, -2, 0]\n"
      "zones:\n"
      "  - name: gate\n"
      "    polygon: [[0, 1, 0], [1, 1, 0], [1, 1, 1]]\n"
      "    height: [0.5, 2]\n"
      "    classes: [person]\n"
      "    confidence: 0.4\n"
      "points:\n"
      "  - {name: hook, offset: [0, 0.5, 6], load_radius: 0.7}\n"
      "distances:\n"
      "  - {to: hook, nearer: 3, within: 2, level: true}\n"
      "  - {to: camera, nearer: 1.5}\n"
      "send: [http://127.0.0.1:9000/warn]\n");
  ASSERT_EQ(rules.zones.size(), 1U);
  EXPECT_EQ(rules.zones[0].name, "gate");
  EXPECT_EQ(rules.zones[0].polygon[2], Eigen::Vector3d(1, 1, 1));
  EXPECT_EQ(rules.zones[0].low, 0.5);
  EXPECT_EQ(rules.zones[0].up, Eigen::Vector3d(0, -1, 0));
  EXPECT_THAT(rules.zones[0].classes, ElementsAre("person"));
  EXPECT_EQ(rules.zones[0].confidence, 0.4);
  ASSERT_EQ(rules.distances.size(), 2U);
  EXPECT_EQ(rules.distances[0].offset, Eigen::Vector3d(0, 0.5, 6));
  EXPECT_EQ(rules.distances[0].within, 2);
  EXPECT_TRUE(rules.distances[0].level);
  EXPECT_EQ(rules.distances[1].offset, Eigen::Vector3d::Zero());
  ASSERT_EQ(rules.loads.size(), 1U);
  EXPECT_EQ(rules.loads[0].offset, Eigen::Vector3d(0, 0.5, 6));
  EXPECT_EQ(rules.loads[0].radius, 0.7);
  ASSERT_EQ(rules.receivers.size(), 1U);
  EXPECT_EQ(rules.receivers[0].port, 9000);
}

TEST(WarningRules, AGivenPointIsInPlaceOfThatOfTheFile) {
  const auto file = test::own_path("rules.yaml");
  write_file(file,
             "points: [{name: hook, offset: [0, 0, 1], load_radius: 0.5}]\n"
             "distances: [{to: hook, nearer: 3}, {to: jib, nearer: 3}]\n");
  const WarningRules rules = read_warning_rules(file, {{"hook", {0, 4, 6}}, {"jib", {1, 0, 0}}});
  EXPECT_EQ(rules.distances[0].offset, Eigen::Vector3d(0, 4, 6));
  EXPECT_EQ(rules.distances[1].offset, Eigen::Vector3d(1, 0, 0));
  ASSERT_EQ(rules.loads.size(), 1U);
  EXPECT_EQ(rules.loads[0].offset, Eigen::Vector3d(0, 4, 6));
}

TEST(WarningRules, SeveralDistancesOfOnePointHaveNamesThatTellThemApart) {
  const WarningRules rules = rules_in(
      "distances: [{to: camera, nearer: 3}, {to: camera, nearer: 1.7},\n"
      "            {to: camera, name: stop, nearer: 0.8}]\n");
  ASSERT_EQ(rules.distances.size(), 3U);
  EXPECT_EQ(rules.distances[0].name, "camera 3 m");
  EXPECT_EQ(rules.distances[1].name, "camera 1.7 m");
  EXPECT_EQ(rules.distances[2].name, "stop");
  EXPECT_EQ(rules.distances[2].point, "camera");
}

TEST(WarningRules, TheRulesInForceAreWrittenWithoutTheirReceivers) {
  const WarningRules rules = rules_in(
      "up: [0, -0.8, 0.6]\n"
      "zones: [{name: \"below the 'hook': 1\", polygon: [[0, 1, 0], [1, 1, 0], [1, 1, 1e0]],\n"
      "         classes: [person, unknown], confidence: 0.2}]\n"
      "points: [{name: hook, offset: [0.1, -4, 6], load_radius: 0.5}]\n"
      "distances: [{to: hook, nearer: 3, within: 2, level: true}, {to: camera, nearer: 2}]\n"
      "send: ['mqtt://me:secret@broker/topic']\n");
  const std::string text = rules_yaml(rules);
  EXPECT_THAT(text, Not(HasSubstr("secret")));
  const WarningRules again = rules_in(text);
  EXPECT_EQ(rules_yaml(again), text);
  EXPECT_TRUE(again.receivers.empty());
  ASSERT_EQ(again.zones.size(), 1U);
  EXPECT_EQ(again.zones[0].name, "below the 'hook': 1");
  EXPECT_EQ(again.zones[0].polygon, rules.zones[0].polygon);
  EXPECT_EQ(again.zones[0].confidence, 0.2);
  EXPECT_THAT(again.zones[0].classes, ElementsAre("person", "unknown"));
  EXPECT_TRUE(again.up.isApprox(rules.up, 1e-15));
  ASSERT_EQ(again.distances.size(), 2U);
  EXPECT_EQ(again.distances[0].offset, Eigen::Vector3d(0.1, -4, 6));
  EXPECT_EQ(again.distances[0].within, 2);
  EXPECT_TRUE(again.distances[0].level);
  EXPECT_EQ(again.distances[1].name, "camera");
  ASSERT_EQ(again.loads.size(), 1U);
  EXPECT_EQ(again.loads[0].radius, 0.5);
}

/// Returns the message of the error that a file causes; empty if it causes none.
std::string problem_of(const std::string& text) {
  try {
    rules_in(text);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(WarningRules, MistakesAreNamed) {
  const std::string zones = std::string("zones: [") + kZone;
  EXPECT_THAT(problem_of("zones: []"), HasSubstr("no zones and no distances"));
  EXPECT_THAT(problem_of("zone: []"), HasSubstr("there is no key 'zone'"));
  EXPECT_THAT(problem_of("zones: 3"), HasSubstr("no list"));
  EXPECT_THAT(problem_of(zones + ", " + kZone + "]"), HasSubstr("two zones named 'gate'"));
  EXPECT_THAT(problem_of("zones: [{name: a, polygon: [[0, 1, 0], [1, 1, 0]]}]"),
              HasSubstr("fewer than three"));
  EXPECT_THAT(problem_of("zones: [{name: a, polygon: [[0, 1], [1, 1], [2, 2]]}]"),
              HasSubstr("three numbers"));
  EXPECT_THAT(problem_of("distances: [{to: hook, nearer: 1}]"), HasSubstr("names no point"));
  EXPECT_THAT(problem_of("distances: [{to: camera}]"), HasSubstr("'nearer' is missing"));
  EXPECT_THAT(problem_of("distances: [{to: camera, nearer: -1}]"), HasSubstr("out of range"));
  EXPECT_THAT(problem_of("distances: [{to: camera, nearer: far}]"), HasSubstr("no valid value"));
  for (const char* nearer : {"0", "1e300", ".nan", ".inf"})
    EXPECT_THAT(problem_of(std::string("distances: [{to: camera, nearer: ") + nearer + "}]"),
                HasSubstr("out of range"));
  EXPECT_THAT(problem_of("distances: [{to: camera, nearer: 2, within: 1e9}]"),
              HasSubstr("out of range"));
  EXPECT_THAT(problem_of("distances: [{to: camera, nearer: 2}, {to: camera, nearer: 2}]"),
              HasSubstr("two rules named 'camera 2 m'"));
  EXPECT_THAT(problem_of("distances: [{to: camera, nearer: 2, classes: []}]"),
              HasSubstr("'classes' is empty"));
  EXPECT_THAT(problem_of("distances: [{to: camera, nearer: 2}]\n" + zones + "]\ndistances: []"),
              HasSubstr("rules.yaml:3: has the key 'distances' twice"));
  EXPECT_THAT(problem_of("up: [0, 0, 0]\n" + zones + "]"), HasSubstr("is zero"));
  EXPECT_THAT(problem_of("zones: ["), HasSubstr("is not valid"));
  EXPECT_THAT(problem_of("[a, b]: 1"), HasSubstr("there is no key ''"));
  EXPECT_THAT(problem_of("zones: [{name: a, polygon: [[0, x, 0]]}]"), HasSubstr("rules.yaml"));
  EXPECT_THAT(problem_of("zones: [{name: a, polygon: [[0, 1, 0], [1, 1, 0], [1, 1, 1]], "
                         "classes: [[a]]}]"),
              HasSubstr("rules.yaml"));
  EXPECT_THAT(problem_of(zones + "]\nsend: [nowhere]"), HasSubstr("nowhere"));
  EXPECT_THAT(problem_of(zones + "]\nsend: {http: a}"), HasSubstr("no list"));
  EXPECT_EQ(problem_of(zones + "]"), "");
}

TEST(WarningRules, AMistakeNamesLineRuleAndValue) {
  EXPECT_THAT(problem_of("up: [0, -1, 0]\ndistances:\n  - to: camera\n    nearer: -1\n"),
              HasSubstr("rules.yaml:4, distance to 'camera': 'nearer' is out of range, 0.01 to "
                        "1000: '-1'"));
  EXPECT_THAT(problem_of("zones:\n  - name: gate\n    polygon: [[0, 1, 0], [1, 1], [1, 1, 1]]\n"),
              HasSubstr("rules.yaml:3, zone 'gate': 'polygon' needs three numbers [x, y, z]: "
                        "[1, 1]"));
  EXPECT_THAT(problem_of("zones: [{name: a, polygon: [[0, .nan, 0], [1, 1, 0], [1, 1, 1]]}]"),
              HasSubstr("'polygon' has a number that is not finite: [0, .nan, 0]"));
}

/// Returns the message of the error that a zone of these corners causes; empty if it causes none.
std::string polygon_problem_of(const std::string& corners) {
  return problem_of("zones: [{name: gate, polygon: [" + corners + "]}]");
}

TEST(WarningRules, APolygonMustBeOneOnAFloor) {
  EXPECT_THAT(polygon_problem_of("[0, 1, 0], [1, 1, 0], [2, 1, 0]"), HasSubstr("on a line"));
  EXPECT_THAT(polygon_problem_of("[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]"),
              HasSubstr("it is vertical"));
  EXPECT_THAT(polygon_problem_of("[0, 1, 0], [2, 1, 0], [2, 4, 2], [0, 1, 2]"),
              HasSubstr("is not level: the heights of its corners along 'up' [0, -1, 0] differ by "
                        "3.00 m"));
  EXPECT_THAT(polygon_problem_of("[0, 1, 0], [2, 1, 2], [2, 1, 0], [0, 1, 2]"),
              HasSubstr("edges that cross"));
  EXPECT_THAT(polygon_problem_of("[0, 1, 0], [1e30, 1, 0], [1, 1, 1e30]"), HasSubstr("beyond"));
  // A notch, a sloping yard and noise are no mistakes.
  EXPECT_EQ(polygon_problem_of("[0, 1, 0], [4, 1, 0], [4, 1, 4], [2, 1, 1], [0, 1, 4]"), "");
  EXPECT_EQ(polygon_problem_of("[0, 1, 0], [20, 2, 0], [20, 2.1, 20], [0, 1, 20]"), "");
}

/// Returns the message of the error that classes cause; empty if they cause none.
std::string class_problem_of(const std::string& classes,
                             const std::optional<std::vector<std::string>>& known) {
  const WarningRules rules =
      rules_in("distances: [{to: camera, nearer: 2, classes: [" + classes + "]}]");
  try {
    check_rule_classes(rules, known, "rules.yaml");
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(WarningRules, AClassThatNoMoverCanHaveIsAMistake) {
  const std::vector<std::string> names{"person", "car"};
  EXPECT_EQ(class_problem_of("person, car, unknown", names), "");
  EXPECT_THAT(class_problem_of("car, persn", names),
              AllOf(HasSubstr("no class 'persn'"), HasSubstr("did you mean 'person'"),
                    HasSubstr("distance 'camera'")));
}

TEST(WarningRules, WithoutNetworkAndMasksOnlyMoversWithoutAClassCanBeWarnedOf) {
  EXPECT_THAT(class_problem_of("person", std::nullopt), HasSubstr("neither a network nor masks"));
  EXPECT_EQ(class_problem_of("person, unknown", std::nullopt), "");
  check_rule_classes(rules_in("distances: [{to: camera, nearer: 2}]"), std::nullopt, "");
}

}  // namespace
}  // namespace stillmap
