// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/pipeline/recording_test.hpp"
#include "stillmap/pipeline/saved_map.hpp"
#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

/// Several visits of one rendered room, for the tests of saved maps.
namespace stillmap::visits {

/// Frames of a path through the office, rendered once for all tests.
struct Visit {
  std::shared_ptr<const SimulatedSequence> sequence;
  std::vector<RgbdFramePtr> frames;
  const Camera& camera() const { return sequence->camera(); }
};

inline std::shared_ptr<const SimulatedSequence> sequence_of(const std::string& name) {
  SimulationOptions options;
  options.people = 0;
  options.frames = 90;
  options.width = 320;
  options.height = 240;
  if (name == "rpy") options.camera = "rpy";
  if (name == "slower") options.speed = 0.8, options.shake = 3;  // with another hand shake
  if (name == "rearranged") options.speed = 0.8, options.shake = 3, options.visit = 2;
  if (name == "loop") options.camera = "loop", options.frames = 250, options.fps = 15;
  if (name == "halfsphere") options.camera = "halfsphere", options.frames = 200, options.fps = 15;
  if (name == "longer") {
    options.speed = 0.8, options.shake = 4, options.focal = 375;
    options.width = 400, options.height = 300;
  }
  if (name == "round" || name == "rearranged round") {
    options.camera = "loop", options.frames = 300, options.fps = 15, options.speed = 2.4;
    if (name == "rearranged round") options.visit = 2;
  }
  if (name == "yard" || name == "twin yard") {
    options.scene = "yard", options.camera = "trolley", options.frames = 60, options.fps = 10;
    if (name == "twin yard") options.seed = 2;
  }
  const auto sequence = std::make_shared<SimulatedSequence>(options);
  if (name != "corner") return sequence;
  auto scene = std::make_shared<Scene>(sequence->scene());
  scene->viewpoint = {{5.2, 1.0, 1.45}, {3.0, 0.1, 0.9}};  // a view that the others do not show
  return std::make_shared<SimulatedSequence>(options, sequence->camera(), scene);
}

/// @param name  xyz, slower (nearly the same path), longer (nearly the same path, by a camera of
/// larger images and focal length), rearranged (as slower, when some furniture has been moved), rpy
/// (the same place), corner (another place), loop (around the room), halfsphere (much of the room
/// from farther away), round, rearranged round (all around it), yard, twin yard (with equal walls
/// and containers of other texture)
inline const Visit& visit(const std::string& name) {
  static std::map<std::string, Visit> made;
  Visit& v = made[name];
  if (!v.sequence) {
    v.sequence = sequence_of(name);
    for (std::size_t i = 0; i < v.sequence->frames(); ++i) v.frames.push_back(v.sequence->frame(i));
  }
  return v;
}

struct Outcome {
  SlamResult result;
  SavedMap map;
};

inline Outcome run(const Visit& visit, std::optional<StartingMap> start = std::nullopt,
                   const SlamParameters& options = recorded::small_options("static")) {
  SlamSystem slam(visit.camera(), options, nullptr, std::move(start));
  for (const auto& frame : visit.frames) slam.push(frame);
  Outcome outcome;
  outcome.result = slam.finish();
  outcome.map = slam.saved_map("test");
  return outcome;
}

}  // namespace stillmap::visits
