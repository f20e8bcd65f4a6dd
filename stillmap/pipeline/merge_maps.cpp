// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/merge_maps.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/disjoint_sets.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/fnv1a.hpp"
#include "stillmap/pipeline/map_maker.hpp"
#include "stillmap/pipeline/relative_place.hpp"
#include "stillmap/pipeline/saved_views.hpp"
#include "stillmap/pipeline/site_frame.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

/// Number of maps that are merged at once. Landmarks of two maps are welded where their projections
/// agree within pixels, so small maps are adjusted before large ones are joined: see
/// lab/records/merging.md.
constexpr std::size_t kGroup = 10;

/// A map, and what decides its place among others.
struct Sorted {
  NamedMap map;
  bool elsewhere;      // its world is not the frame of a site
  double begin;        // timestamp of its oldest keyframe [s]
  std::uint64_t hash;  // of its sections
};

Sorted sortable(NamedMap map) {
  const bool elsewhere = !is_at_site(map.saved.map, main_component(map.saved));
  double begin = std::numeric_limits<double>::infinity();
  for (const Keyframe& k : map.saved.map.keyframes) begin = std::min(begin, k.timestamp);
  std::uint64_t hash = fnv1a("");
  for (const Section& section : map_sections(map.saved.map)) hash = fnv1a(section.bytes, hash);
  return {std::move(map), elsewhere, begin, hash};
}

/// Returns the maps in an order that depends on their content only. Throws Error for equal ones.
std::vector<NamedMap> in_order(std::vector<NamedMap> maps) {
  std::vector<Sorted> sorted;
  for (NamedMap& map : maps) sorted.push_back(sortable(std::move(map)));
  std::sort(sorted.begin(), sorted.end(), [](const Sorted& a, const Sorted& b) {
    return std::tie(a.elsewhere, a.begin, a.hash) < std::tie(b.elsewhere, b.begin, b.hash);
  });
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    if (sorted[i].hash != sorted[i - 1].hash) continue;
    throw Error("is the same map as " + sorted[i - 1].map.name, sorted[i].map.name,
                "name each map once");
  }
  maps.clear();
  for (Sorted& map : sorted) maps.push_back(std::move(map.map));
  return maps;
}

/// The pairs of all given maps. The given map of a keyframe is known by its session.
class MapPairs {
 public:
  /// @param begin_of_sessions  the first session of each map, ascending
  explicit MapPairs(std::vector<std::uint32_t> begin_of_sessions)
      : begin_(std::move(begin_of_sessions)) {}

  /// Adds a comparison of keyframes of two sessions.
  void add(const PlaceComparison& comparison, std::uint32_t session, std::uint32_t other_session) {
    const auto [a, b] = std::minmax({map_of(session), map_of(other_session)});
    if (a == b) return;
    MapPair& pair = compared_[{a, b}];
    const LoopVerification& verification = comparison.verification;
    if (comparison.confirmed) {
      ++pair.places;
      pair.inliers = std::max(pair.inliers, verification.match->inliers);
    }
    if (pair.passed >= verification.passed) return;
    pair.passed = verification.passed;
    pair.reason =
        verification.match ? "no second place confirms the only one" : verification.reason;
  }

  /// Returns all pairs, connected if both maps have keyframes in one component.
  /// @param components  of each map
  std::vector<MapPair> described(const std::vector<std::set<std::uint32_t>>& components) const {
    std::vector<MapPair> described;
    for (std::size_t b = 1; b < begin_.size(); ++b) {
      for (std::size_t a = 0; a < b; ++a) {
        const auto compared = compared_.find({a, b});
        described.push_back(compared == compared_.end() ? MapPair() : compared->second);
        MapPair& pair = described.back();
        pair.a = a, pair.b = b;
        if (pair.passed < 0) pair.reason = "no keyframes look alike";
        pair.connected = std::ranges::any_of(
            components[a], [&](std::uint32_t c) { return components[b].contains(c); });
        if (pair.connected) pair.reason = "connected by other maps";
        if (pair.places > 0) pair.reason.clear();
      }
    }
    return described;
  }

 private:
  std::size_t map_of(std::uint32_t session) const {
    return static_cast<std::size_t>(std::ranges::upper_bound(begin_, session) - begin_.begin()) - 1;
  }

  std::vector<std::uint32_t> begin_;
  std::map<std::pair<std::size_t, std::size_t>, MapPair> compared_;
};

/// A map of one or several given ones, that follow each other in their order.
struct Part {
  NamedMap map;  // with the name of the first
  /// Of each given map: a keyframe of every component in which it lies.
  std::vector<std::vector<KeyframeId>> keyframes_of;
};

/// Parts side by side in one map, as unconnected components.
class Collection {
 public:
  Collection(const Camera& camera, const PyramidShape& pyramid) : map_(camera, pyramid) {}

  void add(Part part) {
    SavedMap& saved = part.map.saved;
    for (const Keyframe& k : saved.map.keyframes) sessions_.push_back(k.session);
    const std::vector<KeyframeId> keyframes =
        map_.add(map_for(std::move(saved.map), map_.camera(), map_.pyramid(), part.map.name),
                 MapAge::kYounger);
    const std::uint16_t earlier_visits = end_of_visits(views_);
    for (AnchoredView& view : saved.views) {
      view.view.visit = static_cast<std::uint16_t>(view.view.visit + earlier_visits);
      view.anchor = keyframes[view.anchor.slot];
      views_.push_back(std::move(view));
    }
    for (std::vector<KeyframeId>& of_map : part.keyframes_of) {
      for (KeyframeId& id : of_map) id = keyframes[id.slot];
      keyframes_of_.push_back(std::move(of_map));
    }
  }

  Map take_map() { return std::move(map_); }
  std::vector<AnchoredView> take_views() { return std::move(views_); }
  std::vector<std::vector<KeyframeId>> take_keyframes_of() { return std::move(keyframes_of_); }
  /// Returns the session that a keyframe had in its part.
  std::uint32_t session_of(KeyframeId keyframe) const { return sessions_[keyframe.slot]; }

 private:
  Map map_;
  std::vector<AnchoredView> views_;
  std::vector<std::vector<KeyframeId>> keyframes_of_;  // see Part
  std::vector<std::uint32_t> sessions_;                // by slot
};

std::size_t surfaces_of(const DenseView& view) {
  return view.kind.total() - static_cast<std::size_t>(std::ranges::count(view.kind, kNoSurface));
}

/// Keeps one view of each image: that with fewest surfaces, as a later visit removed the others.
std::vector<AnchoredView> without_repeated(std::vector<AnchoredView> views) {
  std::map<std::uint64_t, std::size_t> of_image;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto [best, added] = of_image.emplace(image_hash(views[i].view), i);
    if (!added && surfaces_of(views[i].view) < surfaces_of(views[best->second].view))
      best->second = i;
  }
  std::set<std::size_t> kept;
  for (const auto& [image, i] : of_image) kept.insert(i);
  std::vector<AnchoredView> left;
  for (const std::size_t i : kept) left.push_back(std::move(views[i]));
  return left;
}

/// Positions of keyframes in Map::content().
using Positions = std::map<KeyframeId, std::uint32_t>;

/// Returns the views, attached to keyframes numbered as in Map::content().
std::vector<AnchoredView> attached(std::vector<AnchoredView> views, const Map& map,
                                   const Positions& position) {
  std::vector<AnchoredView> left;
  for (AnchoredView& view : views) {
    const RelativePlace place = current_place(map, {view.anchor, view.T_anchor_camera}).value();
    view.anchor = {position.at(place.keyframe), 0};
    view.T_anchor_camera = place.T_keyframe_camera;
    left.push_back(std::move(view));
  }
  return left;
}

/// Numbers the sessions of all maps in turn. Returns the first one of each map.
std::vector<std::uint32_t> number_sessions(std::vector<NamedMap>& maps) {
  std::vector<std::uint32_t> begin;
  std::uint32_t end = 0;
  for (NamedMap& map : maps) {
    begin.push_back(end);
    for (Keyframe& k : map.saved.map.keyframes) {
      k.session += begin.back();
      end = std::max(end, k.session + 1);
    }
  }
  return begin;
}

std::vector<Part> parts_of(std::vector<NamedMap> maps) {
  std::vector<Part> parts;
  for (NamedMap& map : maps) {
    std::vector<KeyframeId> keyframes;
    for (const auto& [component, first] : map.saved.map.first) keyframes.push_back(first);
    parts.push_back({std::move(map), {std::move(keyframes)}});
  }
  return parts;
}

/// Returns the components in which each given map lies.
std::vector<std::set<std::uint32_t>> components_of(const Part& part) {
  std::vector<std::set<std::uint32_t>> components;
  for (const std::vector<KeyframeId>& keyframes : part.keyframes_of) {
    components.emplace_back();
    for (const KeyframeId id : keyframes)
      components.back().insert(part.map.saved.map.keyframes[id.slot].component);
  }
  return components;
}

/// Returns the parts in groups of about one size, none larger than kGroup.
std::vector<std::span<Part>> groups_of(std::span<Part> parts) {
  const std::size_t count = (parts.size() + kGroup - 1) / kGroup;
  std::vector<std::span<Part>> groups;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t begin = i * parts.size() / count, end = (i + 1) * parts.size() / count;
    groups.push_back(parts.subspan(begin, end - begin));
  }
  return groups;
}

/// Merges the parts of a collection. Adds to the pairs of maps and to the counts of `merged`.
Part joined(Collection collection, const std::string& name, const SlamParameters& options,
            MapPairs& pairs, MergedMap& merged) {
  MapMaker maker(collection.take_map(), options);
  for (const PlaceComparison& c : maker.merge_all())
    pairs.add(c, collection.session_of(c.query), collection.session_of(c.candidate));
  const std::size_t repeated = maker.erase_repeated_keyframes().size();
  merged.repeated += repeated;
  merged.redundant += maker.erase_redundant_keyframes();
  maker.adjust_all();
  Part part{{name, {}}, collection.take_keyframes_of()};
  const Positions position = positions_in_content(maker.map());
  for (std::vector<KeyframeId>& keyframes : part.keyframes_of)
    for (KeyframeId& id : keyframes) id = {position.at(maker.map().current_keyframe(id)), 0};
  SavedMap& saved = part.map.saved;
  saved.views = attached(collection.take_views(), maker.map(), position);
  if (repeated > 0) saved.views = without_repeated(std::move(saved.views));
  saved.map = maker.map().content();
  for (const auto& [id, at] : position) saved.map.keyframes[at].session = collection.session_of(id);
  return part;
}

std::string pair_text(const MapPair& pair) {
  if (pair.places > 0) {
    return fmt::format("{}, at most {}", counted(pair.places, "common place"),
                       counted(static_cast<std::size_t>(pair.inliers), "landmark"));
  }
  return pair.connected ? pair.reason : "not connected: " + pair.reason;
}

std::string pairs_text(const MergedMap& merged) {
  std::string text;
  for (const MapPair& pair : merged.pairs) {
    text +=
        fmt::format("{} - {}: {}\n", merged.names[pair.a], merged.names[pair.b], pair_text(pair));
  }
  return text;
}

/// Returns the maps that lie in one world, for each of the worlds, and how close it came to
/// another.
std::string worlds_text(const MergedMap& merged) {
  DisjointSets worlds(merged.names.size());
  for (const MapPair& pair : merged.pairs) {
    if (pair.connected) worlds.unite(pair.a, pair.b);
  }
  std::map<std::size_t, std::vector<std::string>> names;  // by the world
  for (std::size_t i = 0; i < merged.names.size(); ++i)
    names[worlds.root(i)].push_back(merged.names[i]);
  std::map<std::size_t, const MapPair*> closest;
  for (const MapPair& pair : merged.pairs) {
    const std::size_t a = worlds.root(pair.a), b = worlds.root(pair.b);
    if (a == b) continue;
    for (const std::size_t world : {a, b}) {
      const MapPair*& best = closest[world];
      if (best == nullptr || pair.passed > best->passed) best = &pair;
    }
  }
  std::string text;
  for (const auto& [world, maps] : names) {
    text += fmt::format("one world: {} ({})\n", fmt::join(maps, ", "), counted(maps.size(), "map"));
    if (const MapPair* pair = closest[world]) {
      text += fmt::format("  closest to another: {} - {}: {}\n", merged.names[pair->a],
                          merged.names[pair->b], pair->reason);
    }
  }
  return text;
}

/// Returns the names of the maps whose keyframes are in each component.
std::map<std::uint32_t, std::vector<std::string>> maps_by_component(const MergedMap& merged) {
  std::map<std::uint32_t, std::set<std::ptrdiff_t>> maps;  // positions in `names`
  const auto& firsts = merged.first_sessions;
  for (const Keyframe& k : merged.saved.map.keyframes)
    maps[k.component].insert(std::ranges::upper_bound(firsts, k.session) - firsts.begin() - 1);
  std::map<std::uint32_t, std::vector<std::string>> names;
  for (const auto& [component, positions] : maps) {
    for (const std::ptrdiff_t position : positions)
      names[component].push_back(merged.names[static_cast<std::size_t>(position)]);
  }
  return names;
}

/// Returns a line for each component.
std::string components_text(const MergedMap& merged) {
  std::string text;
  for (const auto& [component, maps] : maps_by_component(merged))
    text += fmt::format("component {}: keyframes of {}\n", component, fmt::join(maps, ", "));
  return text;
}

}  // namespace

std::vector<NamedMap> read_named_maps(const std::vector<std::filesystem::path>& files,
                                      const MemoryLimit& memory) {
  MemoryLimit share = memory;
  share.limit /= std::max<std::size_t>(1, files.size());
  std::vector<NamedMap> maps;
  for (const auto& file : files) maps.push_back({file.string(), read_saved_map(file, share)});
  return maps;
}

void require_no_input(const std::filesystem::path& out,
                      const std::vector<std::filesystem::path>& maps) {
  if (!std::filesystem::exists(out)) return;
  for (const auto& map : maps) {
    if (std::filesystem::equivalent(map_file_of(map), out))
      throw Error("is one of the maps to read", out.string(), "name another file to write");
  }
}

MergedMap merge_maps(std::vector<NamedMap> maps, const SlamParameters& options,
                     const std::string& writer) {
  if (maps.size() < 2) throw Error("needs at least two maps", "merge", "name more maps");
  maps = in_order(std::move(maps));
  MergedMap merged;
  for (const NamedMap& map : maps) merged.names.push_back(map.name);
  merged.first_sessions = number_sessions(maps);
  MapPairs pairs(merged.first_sessions);
  std::vector<Part> parts = parts_of(std::move(maps));
  Camera camera = parts.front().map.saved.map.camera;
  camera.disparity_sigma = options.disparity_sigma;
  const PyramidShape pyramid = parts.front().map.saved.map.pyramid;
  while (parts.size() > 1) {
    std::vector<Part> larger;
    for (const std::span<Part> group : groups_of(parts)) {
      Collection collection(camera, pyramid);
      const std::string name = group.front().map.name;
      for (Part& part : group) {
        if (merged.saved.damage.empty()) merged.saved.damage = std::move(part.map.saved.damage);
        collection.add(std::move(part));
      }
      larger.push_back(joined(std::move(collection), name, options, pairs, merged));
    }
    parts = std::move(larger);
  }
  merged.pairs = pairs.described(components_of(parts.front()));
  merged.saved.writer = writer;
  merged.saved.map = std::move(parts.front().map.saved.map);
  merged.saved.views = std::move(parts.front().map.saved.views);
  return merged;
}

std::string merge_text(const MergedMap& merged) {
  const std::string text = merged.names.size() > kGroup
                               ? worlds_text(merged)
                               : pairs_text(merged) + components_text(merged);
  return text + fmt::format(
                    "erased: {} of several maps, {} redundant ones\n"
                    "component 0 is in the world of {}\n",
                    counted(merged.repeated, "keyframe"), merged.redundant, merged.names.front());
}

nlohmann::json merge_json(const MergedMap& merged) {
  nlohmann::json json = {{"maps", merged.names},
                         {"first_sessions", merged.first_sessions},
                         {"world", merged.names.front()},
                         {"repeated_keyframes", merged.repeated},
                         {"redundant_keyframes", merged.redundant},
                         {"components", nlohmann::json::object()},
                         {"pairs", nlohmann::json::array()}};
  for (const auto& [component, maps] : maps_by_component(merged))
    json["components"][std::to_string(component)] = maps;
  for (const MapPair& pair : merged.pairs) {
    json["pairs"].push_back({{"a", merged.names[pair.a]},
                             {"b", merged.names[pair.b]},
                             {"places", pair.places},
                             {"inliers", pair.inliers},
                             {"connected", pair.connected},
                             {"reason", pair.reason}});
  }
  return json;
}

}  // namespace stillmap
