// SPDX-License-Identifier: Apache-2.0
#include "stillmap/warn/rules.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"

#include <gmock/gmock.h>

namespace stillmap {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

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
      "points:\n"
      "  - {name: hook, offset: [0, 0.5, 6]}\n"
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
  ASSERT_EQ(rules.distances.size(), 2U);
  EXPECT_EQ(rules.distances[0].offset, Eigen::Vector3d(0, 0.5, 6));
  EXPECT_EQ(rules.distances[0].within, 2);
  EXPECT_TRUE(rules.distances[0].level);
  EXPECT_EQ(rules.distances[1].offset, Eigen::Vector3d::Zero());
  ASSERT_EQ(rules.receivers.size(), 1U);
  EXPECT_EQ(rules.receivers[0].port, 9000);
}

TEST(WarningRules, AGivenPointIsInPlaceOfThatOfTheFile) {
  const auto file = test::own_path("rules.yaml");
  write_file(file,
             "points: [{name: hook, offset: [0, 0, 1]}]\n"
             "distances: [{to: hook, nearer: 3}, {to: jib, nearer: 3}]\n");
  const WarningRules rules = read_warning_rules(file, {{"hook", {0, 4, 6}}, {"jib", {1, 0, 0}}});
  EXPECT_EQ(rules.distances[0].offset, Eigen::Vector3d(0, 4, 6));
  EXPECT_EQ(rules.distances[1].offset, Eigen::Vector3d(1, 0, 0));
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
  EXPECT_THAT(problem_of(zones + ", " + kZone + "]"), HasSubstr("two zones named gate"));
  EXPECT_THAT(problem_of("zones: [{name: a, polygon: [[0, 1, 0], [1, 1, 0]]}]"),
              HasSubstr("fewer than three"));
  EXPECT_THAT(problem_of("zones: [{name: a, polygon: [[0, 1], [1, 1], [2, 2]]}]"),
              HasSubstr("three numbers"));
  EXPECT_THAT(problem_of("distances: [{to: hook, nearer: 1}]"), HasSubstr("names no point"));
  EXPECT_THAT(problem_of("distances: [{to: camera}]"), HasSubstr("'nearer' is missing"));
  EXPECT_THAT(problem_of("distances: [{to: camera, nearer: -1}]"), HasSubstr("out of range"));
  EXPECT_THAT(problem_of("distances: [{to: camera, nearer: far}]"), HasSubstr("no valid value"));
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

}  // namespace
}  // namespace stillmap
