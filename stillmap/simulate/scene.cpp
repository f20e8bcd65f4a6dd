// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/scene.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/simulate/figure.hpp"
#include "stillmap/simulate/palette.hpp"
#include "stillmap/simulate/rooms.hpp"
#include "stillmap/simulate/tag_board.hpp"

#include <algorithm>
#include <span>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace stillmap {
namespace {

using namespace simulate;
constexpr int kMostPeople = 6, kMostThings = 3;

void check_name(const std::string& name, const std::vector<std::string>& known, const char* where) {
  if (std::find(known.begin(), known.end(), name) != known.end()) return;
  throw Error(fmt::format("'{}' is not known", name), where,
              fmt::format("take one of: {}", fmt::join(known, ", ")));
}

void check_range(int value, int most, const char* where) {
  if (value >= 0 && value <= most) return;
  throw Error(fmt::format("{} is out of range", value), where, fmt::format("take 0 to {}", most));
}

enum class Deed { kWalk, kSit, kWave, kRise, kAccompany, kCrowd };

Deed deed_of(const std::string& activity, int number) {
  if (activity == "walk") return Deed::kWalk;
  if (activity == "sit") return number < 2 ? Deed::kSit : Deed::kWave;
  if (activity == "wave") return Deed::kWave;
  if (activity == "rise") return number == 0 ? Deed::kRise : deed_of("sit", number);
  if (activity == "companion") return number == 0 ? Deed::kAccompany : Deed::kWave;
  if (activity == "crowd") return Deed::kCrowd;
  return static_cast<Deed>(number % 3);
}

/// Adds people, each at the position of its activity.
class Casting {
 public:
  Casting(const SceneOptions& options, const RoomPlan& plan, Palette& palette)
      : options_(options), plan_(plan), palette_(palette), way_(plan.walk) {
    for (int i = 0; i < options.people; ++i)
      walkers_ += deed_of(options.activity, i) == Deed::kWalk;
  }

  Mover person(int id, int number) {
    switch (deed_of(options_.activity, number)) {
      case Deed::kWalk:
        return make_walker(id, number, walk(), palette_);
      case Deed::kRise:
        return make_riser(id, number, {{plan_.seats.back(), kCalm}, Path(plan_.rise)}, palette_);
      case Deed::kAccompany:
        return make_walker(id, number, accompany(), palette_);
      case Deed::kCrowd:
        return make_walker(id, number, crowd(number), palette_);
      case Deed::kSit:
        if (sitting_ < plan_.seats.size()) {
          const float liveliness = options_.activity == "rise" ? kCalm : 1;
          return make_sitter(id, number, {plan_.seats[sitting_++], liveliness}, palette_);
        }
        break;
      case Deed::kWave:
        break;
    }
    return make_waver(id, number, {plan_.spots[waving_++ % plan_.spots.size()]}, palette_);
  }

 private:
  // Liveliness of a calm sitting person: slower than 2 cm/s nearly everywhere.
  static constexpr float kCalm = 0.1F;

  /// Walkers distributed evenly over their path, so that none collide.
  Walking walk() {
    const float start =
        way_.length() * (static_cast<float>(walking_++) / static_cast<float>(walkers_));
    return {way_, 0.8F, start + plan_.walk_start};
  }
  Walking accompany() const {
    return {way_, static_cast<float>(kCarriedSpeed * options_.pace),
            static_cast<float>(kCompanionDistance)};
  }
  /// In single file, as close together as possible.
  Walking crowd(int number) const {
    constexpr float kSpeed = 0.7F, kFirst = -2.0F, kApart = 0.3F;  // m/s, meters
    return {Path(plan_.crowd), kSpeed, kFirst - kApart * static_cast<float>(number)};
  }

  const SceneOptions& options_;
  const RoomPlan& plan_;
  Palette& palette_;
  const Path way_;
  int walkers_ = 0, walking_ = 0;
  std::size_t sitting_ = 0, waving_ = 0;
};

void add_people(const SceneOptions& options, const RoomPlan& plan, Palette& palette, Scene& scene) {
  Casting casting(options, plan, palette);
  for (int i = 0; i < options.people; ++i) {
    const int id = static_cast<int>(scene.movers.size()) + 1;
    scene.movers.push_back(casting.person(id, i));
  }
}

void add_things(const SceneOptions& options, const RoomPlan& room, Palette& palette, Scene& scene) {
  const ObjectPlan& plan = options.near_things ? room.near_things : room.things;
  const auto id = [&] { return static_cast<int>(scene.movers.size()) + 1; };
  if (scene.trolley) {
    const auto lanes = static_cast<std::size_t>(std::max(0, options.things - 1));
    if (options.things > 0)
      scene.movers.push_back(
          make_hook(id(), *scene.trolley, options.pace, options.near_things, palette));
    for (std::size_t i = 0; i < std::min(lanes, room.vehicles.size()); ++i)
      scene.movers.push_back(
          make_vehicle(id(), room.vehicles[i].from, room.vehicles[i].to, palette));
    return;
  }
  if (options.things > 0) scene.movers.push_back(make_crate(id(), plan.hook, palette));
  if (options.things > 1) {
    scene.movers.push_back(make_pushed_chair(id(), plan.chair_from, plan.chair_to, palette));
  }
  if (options.things > 2)
    scene.movers.push_back(make_ball(id(), plan.ball_from, plan.ball_to, palette));
}

RoomPlan build(const SceneOptions& options, Palette& palette, Scene& scene) {
  if (options.scene == "flat") return build_flat(palette, scene);
  return options.scene == "yard" ? build_yard(palette, scene)
                                 : build_office(options.visit, palette, scene);
}

/// Turns day into evening. A room's window is its last lamp, behind an even number of others.
void dim(simulate::Lighting& lighting) {
  constexpr float kAmbient = 0.4F;
  lighting.ambient *= kAmbient;
  std::vector<simulate::Lamp> on;
  for (std::size_t i = 1; i < lighting.lamps.size(); i += 2) on.push_back(lighting.lamps[i]);
  lighting.lamps = std::move(on);
}

}  // namespace

const std::vector<std::string>& scene_names() {
  static const std::vector<std::string> kNames{"office", "flat", "yard"};
  return kNames;
}

const std::vector<std::string>& activity_names() {
  static const std::vector<std::string> kNames{"walk", "sit",       "wave", "mixed",
                                               "rise", "companion", "crowd"};
  return kNames;
}

const std::vector<std::string>& light_names() {
  static const std::vector<std::string> kNames{"day", "evening"};
  return kNames;
}

Scene make_scene(const SceneOptions& options) {
  check_name(options.scene, scene_names(), "scene");
  check_name(options.activity, activity_names(), "activity");
  check_name(options.light, light_names(), "light");
  check_range(options.people, kMostPeople, "people");
  check_range(options.things, kMostThings, "things");
  if (options.visit < 1 || options.visit > 2 || (options.visit == 2 && options.scene != "office"))
    throw Error(fmt::format("there is no visit {} of scene {}", options.visit, options.scene),
                "visit", "use 1, or 2 of the office");
  Scene scene;
  Random random(static_cast<std::uint64_t>(options.seed), 1);
  Palette palette(scene.textures, random);
  const RoomPlan plan = build(options, palette, scene);
  check_range(options.tags, static_cast<int>(plan.tag_places.size()), "tags");
  hang_tags(std::span(plan.tag_places).first(static_cast<std::size_t>(options.tags)), palette,
            scene);
  if (options.light == "evening") dim(scene.lighting);
  bake_light(scene.lighting, scene.statics, options.threads);
  scene.round = plan.walk;
  if (options.activity == "crowd") scene.viewpoint.position.z() = plan.crowd_height;
  add_people(options, plan, palette, scene);
  add_things(options, plan, palette, scene);
  return scene;
}

}  // namespace stillmap
