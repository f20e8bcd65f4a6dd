// SPDX-License-Identifier: Apache-2.0
#include "stillmap/map/map_file.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/map/local_map.hpp"

#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using ::testing::HasSubstr;

constexpr std::uint32_t kKeypoints = 12;

Camera small_camera() {
  Camera camera;
  camera.name = "small";
  camera.width = 64, camera.height = 48;
  camera.fx = camera.fy = 50, camera.cx = 31.5, camera.cy = 23.5;
  camera.distortion[1] = -0.25;
  return camera;
}

/// A map with everything that can occur: two components and a merged one, gaps of erased keyframes
/// and landmarks, numbers with all digits.
class MapFile : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const std::uint32_t component : {0U, 0U, 0U, 2U, 2U}) add_keyframe(component);
    for (std::uint32_t i = 0; i < 6; ++i) {
      const auto l = add_landmark(keyframes_[0], i);
      map_.observe(l, {keyframes_[2], i});
      map_.observe(l, {keyframes_[1], kKeypoints - 1 - i});
      map_.refresh(l);
      add_landmark(keyframes_[3], i);
    }
    map_.count_visibility(map_.at(keyframes_[0]).landmarks[4], 7, 5);
    map_.set_static_log_odds(map_.at(keyframes_[0]).landmarks[4], -0.3F);
    map_.erase(map_.at(keyframes_[0]).landmarks[1]);
    map_.erase(keyframes_[1], keyframes_[0]);
  }

  double random(double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(random_);
  }
  Eigen::Vector3d random_vector() { return {random(-1, 1), random(-1, 1), random(-1, 1)}; }

  void add_keyframe(std::uint32_t component) {
    auto features = std::make_shared<Features>();
    Keyframe made;
    for (std::uint32_t i = 0; i < kKeypoints; ++i) {
      const auto number = [&](double most) { return static_cast<float>(random(0, most)); };
      features->keypoints.push_back({.u = number(63),
                                     .v = number(47),
                                     .angle = number(3),
                                     .response = number(100),
                                     .depth = i % 4 == 0 ? 0 : number(4),
                                     .level = static_cast<std::uint8_t>(i % 8)});
      features->descriptors.push_back({random_(), random_(), random_(), random_()});
      made.static_weight.push_back(number(1));
    }
    features->grid = KeypointGrid(features->keypoints, 64, 48);
    made.features = features;
    made.component = component;
    made.frame_index = 10 * keyframes_.size();
    made.timestamp = 1.3e9 + random(0, 1);
    made.T_world_camera = Pose(so3_exp(random_vector()), random_vector());
    keyframes_.push_back(map_.add_keyframe(std::move(made)).id);
  }
  LandmarkId add_landmark(KeyframeId keyframe, std::uint32_t keypoint) {
    return map_.add_landmark(random_vector(), {keyframe, keypoint}).id;
  }

  std::mt19937_64 random_{42};
  Map map_{small_camera(), PyramidShape{8, 1.2}};
  std::vector<KeyframeId> keyframes_;
};

void expect_same(const Pose& a, const Pose& b) {
  EXPECT_EQ(a.quaternion().coeffs(), b.quaternion().coeffs());
  EXPECT_EQ(a.translation(), b.translation());
}

void expect_same(const Keyframe& a, const Keyframe& b) {
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.sequence, b.sequence);
  EXPECT_EQ(a.component, b.component);
  EXPECT_EQ(a.session, b.session);
  EXPECT_EQ(a.frame_index, b.frame_index);
  EXPECT_EQ(a.timestamp, b.timestamp);
  expect_same(a.T_world_camera, b.T_world_camera);
  EXPECT_EQ(a.features->descriptors, b.features->descriptors);
  EXPECT_EQ(a.static_weight, b.static_weight);
  EXPECT_EQ(a.landmarks, b.landmarks);
  ASSERT_EQ(a.features->size(), b.features->size());
  for (std::size_t i = 0; i < a.features->size(); ++i) {
    const Keypoint &p = a.features->keypoints[i], &q = b.features->keypoints[i];
    EXPECT_EQ(std::tie(p.u, p.v, p.angle, p.response, p.depth, p.level),
              std::tie(q.u, q.v, q.angle, q.response, q.depth, q.level));
  }
}

void expect_same(const Landmark& a, const Landmark& b) {
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.p_world, b.p_world);
  EXPECT_EQ(a.normal, b.normal);
  EXPECT_EQ(std::tie(a.descriptor, a.min_distance, a.max_distance, a.first_sequence, a.predicted,
                     a.found, a.static_log_odds),
            std::tie(b.descriptor, b.min_distance, b.max_distance, b.first_sequence, b.predicted,
                     b.found, b.static_log_odds));
  ASSERT_EQ(a.observations.size(), b.observations.size());
  for (std::size_t i = 0; i < a.observations.size(); ++i) {
    EXPECT_EQ(a.observations[i].keyframe, b.observations[i].keyframe);
    EXPECT_EQ(a.observations[i].keypoint, b.observations[i].keypoint);
  }
}

void expect_same(const MapContent& a, const MapContent& b) {
  ASSERT_EQ(a.keyframes.size(), b.keyframes.size());
  for (std::size_t i = 0; i < a.keyframes.size(); ++i) expect_same(a.keyframes[i], b.keyframes[i]);
  ASSERT_EQ(a.landmarks.size(), b.landmarks.size());
  for (std::size_t i = 0; i < a.landmarks.size(); ++i) expect_same(a.landmarks[i], b.landmarks[i]);
  EXPECT_EQ(a.first, b.first);
  EXPECT_EQ(a.camera.name, b.camera.name);
  EXPECT_EQ(a.camera.fx, b.camera.fx);
  EXPECT_EQ(a.camera.distortion, b.camera.distortion);
  EXPECT_EQ(a.camera.baseline, b.camera.baseline);
  EXPECT_EQ(a.camera.depth_sensor.name, b.camera.depth_sensor.name);
  EXPECT_EQ(a.pyramid.levels, b.pyramid.levels);
  EXPECT_EQ(a.pyramid.scale_factor, b.pyramid.scale_factor);
}

/// Checks the invariant of Map and exercises every function that reads a map.
void expect_usable(Map& map) {
  std::vector<LandmarkId> landmarks;
  map.for_each_landmark([&](const Landmark& l) {
    for (const Observation& o : l.observations) {
      ASSERT_EQ(map.at(o.keyframe).landmarks.at(o.keypoint), l.id);
    }
    landmarks.push_back(l.id);
  });
  map.for_each_keyframe([&](const Keyframe& k) {
    for (const LandmarkId id : k.landmarks) {
      ASSERT_TRUE(!id.valid() || map.find(id) != nullptr);
    }
    map.is_first(k.id);
    make_local_map(map, k.id);
  });
  for (const LandmarkId id : landmarks) map.refresh(id);
}

std::string error_of(const std::vector<Section>& sections) {
  try {
    Map map(map_from_sections(sections, "a.map"));
    expect_usable(map);
  } catch (const Error& e) {
    EXPECT_THAT(e.where(), HasSubstr("a.map"));
    EXPECT_THAT(e.fix(), HasSubstr("--save-map"));
    return e.what();
  }
  return "";
}

TEST_F(MapFile, RoundTripIsBitExact) {
  const auto sections = map_sections(map_.content());
  Map read(map_from_sections(sections, ""));
  expect_same(map_.content(), read.content());
  EXPECT_EQ(map_sections(read.content()), sections)
      << "writing the loaded map gives the same bytes";
  expect_usable(read);
}

TEST_F(MapFile, KeepsTheErrorOfTheDepths) {
  EXPECT_EQ(map_from_sections(map_sections(map_.content()), "").depth_error, nullptr);
  SmoothDepthError::Nodes nodes = SmoothDepthError::Nodes::LinSpaced(-0.01, 0.02);
  map_.set_depth_error(std::make_shared<SmoothDepthError>(nodes));
  auto sections = map_sections(map_.content());
  const Map read(map_from_sections(sections, ""));
  ASSERT_TRUE(read.depth_error());
  EXPECT_EQ(read.depth_error()->nodes(), nodes);
  EXPECT_EQ(map_sections(read.content()), sections);
  nodes[3] = 1.5;
  sections.back().bytes = depth_error_bytes(SmoothDepthError(nodes));
  EXPECT_THAT(error_of(sections), HasSubstr("error of the depth sensor is invalid"));
}

TEST_F(MapFile, LoadedMapContinuesInANewSession) {
  const auto before = map_.content();
  Map read(map_from_sections(map_sections(map_.content()), ""));
  const Keyframe& added = read.add_keyframe(before.keyframes.front());
  EXPECT_EQ(added.sequence, before.keyframes.back().sequence + 1);
  EXPECT_EQ(added.session, 1U) << "the loaded keyframes belong to session 0";
  EXPECT_EQ(make_local_map(read, added.id)->made_for_frame, added.frame_index);
  EXPECT_EQ(make_local_map(read, before.keyframes.back().id)->made_for_frame, 0U)
      << "frames of another run are not comparable";
}

TEST_F(MapFile, ContentIsNumberedWithoutGaps) {
  const auto content = map_.content();
  ASSERT_EQ(content.keyframes.size(), 4U);
  EXPECT_EQ(content.keyframes[1].sequence, 2U) << "sequence numbers are kept";
  EXPECT_EQ(content.keyframes[2].component, 1U) << "components 0 and 2 are renumbered 0 and 1";
  EXPECT_EQ(content.first.at(1), content.keyframes[2].id);
}

TEST_F(MapFile, AnEmptyMapIsValid) {
  const Map empty(small_camera(), PyramidShape{});
  EXPECT_EQ(map_from_sections(map_sections(empty.content()), "").keyframes.size(), 0U);
}

TEST_F(MapFile, AMissingSectionIsAnError) {
  auto sections = map_sections(map_.content());
  sections.pop_back();
  EXPECT_THAT(error_of(sections), HasSubstr("no section LAND"));
}

// Checksums do not protect against a faulty writer: every altered byte must give an Error or a map
// that satisfies the invariant.
TEST_F(MapFile, AnAlteredByteNeverGivesAnInvalidMap) {
  const auto sections = map_sections(map_.content());
  std::size_t refused = 0;
  for (std::size_t s = 0; s < sections.size(); ++s) {
    for (std::size_t i = 0; i < sections[s].bytes.size(); ++i) {
      for (const int bits : {0x01, 0x10, 0x80, 0xff}) {
        auto altered = sections;
        altered[s].bytes[i] = static_cast<char>(altered[s].bytes[i] ^ bits);
        refused += !error_of(altered).empty();
      }
    }
  }
  EXPECT_GT(refused, 300U);
}

TEST_F(MapFile, AWrongLengthIsAnError) {
  const auto sections = map_sections(map_.content());
  for (std::size_t s = 0; s < sections.size(); ++s) {
    for (std::size_t size = 0; size < sections[s].bytes.size(); ++size) {
      auto altered = sections;
      altered[s].bytes.resize(size);
      EXPECT_NE(error_of(altered), "") << s << " cut to " << size;
    }
    auto altered = sections;
    altered[s].bytes += '\0';
    EXPECT_THAT(error_of(altered), HasSubstr("1 bytes too many"));
  }
}

TEST_F(MapFile, RandomBytesNeverGiveAnInvalidMap) {
  const auto sections = map_sections(map_.content());
  for (int round = 0; round < 3000; ++round) {
    auto altered = sections;
    std::string& bytes = altered[random_() % altered.size()].bytes;
    for (std::uint64_t n = random_() % 20; n > 0; --n) {
      bytes[random_() % bytes.size()] = static_cast<char>(random_());
    }
    error_of(altered);
  }
}

}  // namespace
}  // namespace stillmap
