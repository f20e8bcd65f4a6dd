// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/scene.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/simulate/figure.hpp"
#include "stillmap/simulate/palette.hpp"
#include "stillmap/simulate/rooms.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace stillmap {
namespace {

using namespace simulate;
constexpr int kMostPeople = 6, kMostThings = 3;
const std::vector<std::string> kActivities{"walk", "sit", "wave", "mixed"};

void check_name(const std::string& name, const std::vector<std::string>& known, const char* where) {
  if (std::find(known.begin(), known.end(), name) != known.end()) return;
  throw Error(fmt::format("'{}' is not known", name), where,
              fmt::format("take one of: {}", fmt::join(known, ", ")));
}

void check_range(int value, int most, const char* where) {
  if (value >= 0 && value <= most) return;
  throw Error(fmt::format("{} is out of range", value), where, fmt::format("take 0 to {}", most));
}

enum class Deed { kWalk, kSit, kWave };

Deed deed_of(const std::string& activity, int number) {
  if (activity == "walk") return Deed::kWalk;
  if (activity == "sit") return number < 2 ? Deed::kSit : Deed::kWave;
  if (activity == "wave") return Deed::kWave;
  return static_cast<Deed>(number % 3);
}

/// Lets the people in: walkers spread evenly over their way, so that none walks into another.
void add_people(const SceneOptions& options, const RoomPlan& plan, Palette& palette, Scene& scene) {
  const Path path(plan.walk);
  int walkers = 0;
  for (int i = 0; i < options.people; ++i) walkers += deed_of(options.activity, i) == Deed::kWalk;
  std::size_t walking = 0, sitting = 0, waving = 0;
  for (int i = 0; i < options.people; ++i) {
    const int id = static_cast<int>(scene.movers.size()) + 1;
    const Deed deed = deed_of(options.activity, i);
    if (deed == Deed::kWalk) {
      const float start =
          path.length() * (static_cast<float>(walking++) / static_cast<float>(walkers));
      scene.movers.push_back(make_walker(id, i, {path, 0.8F, start + plan.walk_start}, palette));
    } else if (deed == Deed::kSit && sitting < plan.seats.size()) {
      scene.movers.push_back(make_sitter(id, i, {plan.seats[sitting++]}, palette));
    } else {
      const Transform& spot = plan.spots[waving++ % plan.spots.size()];
      scene.movers.push_back(make_waver(id, i, {spot}, palette));
    }
  }
}

void add_things(const SceneOptions& options, const RoomPlan& plan, Palette& palette, Scene& scene) {
  const auto id = [&] { return static_cast<int>(scene.movers.size()) + 1; };
  if (options.things > 0) scene.movers.push_back(make_crate(id(), plan.hook, palette));
  if (options.things > 1) {
    scene.movers.push_back(make_pushed_chair(id(), plan.chair_from, plan.chair_to, palette));
  }
  if (options.things > 2)
    scene.movers.push_back(make_ball(id(), plan.ball_from, plan.ball_to, palette));
}

}  // namespace

const std::vector<std::string>& scene_names() {
  static const std::vector<std::string> kNames{"office"};
  return kNames;
}

Scene make_scene(const SceneOptions& options) {
  check_name(options.scene, scene_names(), "scene");
  check_name(options.activity, kActivities, "activity");
  check_range(options.people, kMostPeople, "people");
  check_range(options.things, kMostThings, "things");
  Scene scene;
  Random random(static_cast<std::uint64_t>(options.seed), 1);
  Palette palette(scene.textures, random);
  const RoomPlan plan = build_office(palette, scene);
  bake_light(scene.lighting, scene.statics);
  scene.round = plan.walk;
  add_people(options, plan, palette, scene);
  add_things(options, plan, palette, scene);
  return scene;
}

}  // namespace stillmap
