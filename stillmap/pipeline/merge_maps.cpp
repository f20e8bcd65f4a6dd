// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/merge_maps.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/pipeline/map_maker.hpp"
#include "stillmap/pipeline/relative_place.hpp"
#include "stillmap/pipeline/saved_views.hpp"
#include "stillmap/pipeline/site_frame.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

/// A map, and what decides its place among others.
struct Sorted {
  NamedMap map;
  bool elsewhere;     // its world is not the frame of a site
  double begin;       // timestamp of its oldest keyframe [s]
  std::string bytes;  // its sections, equal for equal maps
};

Sorted sortable(NamedMap map) {
  Sorted sorted{std::move(map), true, std::numeric_limits<double>::infinity(), {}};
  sorted.elsewhere = !is_at_site(sorted.map.saved.map, main_component(sorted.map.saved));
  for (const Keyframe& k : sorted.map.saved.map.keyframes)
    sorted.begin = std::min(sorted.begin, k.timestamp);
  for (const Section& section : map_sections(sorted.map.saved.map)) sorted.bytes += section.bytes;
  return sorted;
}

/// Returns the maps in an order that depends on their content only. Throws Error for equal ones.
std::vector<NamedMap> in_order(std::vector<NamedMap> maps) {
  std::vector<Sorted> sorted;
  for (NamedMap& map : maps) sorted.push_back(sortable(std::move(map)));
  std::sort(sorted.begin(), sorted.end(), [](const Sorted& a, const Sorted& b) {
    return std::tie(a.elsewhere, a.begin, a.bytes) < std::tie(b.elsewhere, b.begin, b.bytes);
  });
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    if (sorted[i].bytes != sorted[i - 1].bytes) continue;
    throw Error("is the same map as " + sorted[i - 1].map.name, sorted[i].map.name,
                "name each map once");
  }
  maps.clear();
  for (Sorted& map : sorted) maps.push_back(std::move(map.map));
  return maps;
}

/// Maps side by side in one, as unconnected components.
class Collection {
 public:
  Collection(const Camera& camera, const PyramidShape& pyramid) : map_(camera, pyramid) {}

  /// @param name of the map, for messages
  void add(SavedMap saved, const std::string& name) {
    const std::vector<KeyframeId> keyframes = map_.add(
        map_for(std::move(saved.map), map_.camera(), map_.pyramid(), name), MapAge::kYounger);
    const std::uint16_t earlier_visits = end_of_visits(views_);
    for (AnchoredView& view : saved.views) {
      view.view.visit = static_cast<std::uint16_t>(view.view.visit + earlier_visits);
      view.anchor = keyframes[view.anchor.slot];
      views_.push_back(std::move(view));
    }
    end_of_map_.push_back(map_.keyframe_count());
  }

  Map take_map() { return std::move(map_); }
  std::vector<AnchoredView> take_views() { return std::move(views_); }

  /// Returns the number of the map that a keyframe comes from.
  std::size_t map_of(KeyframeId keyframe) const {
    return std::upper_bound(end_of_map_.begin(), end_of_map_.end(), keyframe.slot) -
           end_of_map_.begin();
  }

 private:
  Map map_;
  std::vector<AnchoredView> views_;
  std::vector<std::size_t> end_of_map_;  // number of keyframes of the maps up to each
};

std::vector<MapPair> all_pairs(std::size_t maps) {
  std::vector<MapPair> pairs;
  for (std::size_t b = 1; b < maps; ++b) {
    for (std::size_t a = 0; a < b; ++a)
      pairs.push_back({a, b, 0, 0, false, "no keyframes look alike"});
  }
  return pairs;
}

/// Sets the places, inliers and reasons of all pairs from the comparisons of their keyframes.
void describe(const std::vector<PlaceComparison>& comparisons, const Collection& maps,
              std::vector<MapPair>& pairs) {
  std::map<std::pair<std::size_t, std::size_t>, MapPair*> by_maps;
  for (MapPair& pair : pairs) by_maps[{pair.a, pair.b}] = &pair;
  std::map<const MapPair*, int> passed;
  for (const PlaceComparison& c : comparisons) {
    const auto [a, b] = std::minmax({maps.map_of(c.query), maps.map_of(c.candidate)});
    if (a == b) continue;
    MapPair& pair = *by_maps.at({a, b});
    if (c.confirmed) {
      ++pair.places;
      pair.inliers = std::max(pair.inliers, c.verification.match->inliers);
    }
    if (const auto before = passed.find(&pair);
        before != passed.end() && before->second >= c.verification.passed)
      continue;
    passed[&pair] = c.verification.passed;
    pair.reason =
        c.verification.match ? "no second place confirms the only one" : c.verification.reason;
  }
  for (MapPair& pair : pairs) {
    if (pair.places > 0) pair.reason.clear();
  }
}

/// Sets which pairs lie in one world: any of their keyframes in one component.
void set_connected(const Map& map, const Collection& maps, std::vector<MapPair>& pairs) {
  std::map<std::size_t, std::vector<std::uint32_t>> components;
  map.for_each_keyframe(
      [&](const Keyframe& k) { components[maps.map_of(k.id)].push_back(k.component); });
  for (auto& [number, of_map] : components) {
    std::sort(of_map.begin(), of_map.end());
    of_map.erase(std::unique(of_map.begin(), of_map.end()), of_map.end());
  }
  for (MapPair& pair : pairs) {
    std::vector<std::uint32_t> common;
    std::set_intersection(components[pair.a].begin(), components[pair.a].end(),
                          components[pair.b].begin(), components[pair.b].end(),
                          std::back_inserter(common));
    pair.connected = !common.empty();
  }
}

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

/// Returns the views, attached to keyframes numbered as in Map::content().
std::vector<AnchoredView> attached(std::vector<AnchoredView> views, const Map& map) {
  const auto position = positions_in_content(map);
  std::vector<AnchoredView> left;
  for (AnchoredView& view : views) {
    const RelativePlace place = current_place(map, {view.anchor, view.T_anchor_camera}).value();
    view.anchor = {position.at(place.keyframe), 0};
    view.T_anchor_camera = place.T_keyframe_camera;
    left.push_back(std::move(view));
  }
  return left;
}

std::string pair_text(const MapPair& pair) {
  if (pair.places > 0) {
    return fmt::format("{}, at most {}", counted(pair.places, "common place"),
                       counted(static_cast<std::size_t>(pair.inliers), "landmark"));
  }
  return fmt::format("{}: {}", pair.connected ? "connected by other maps" : "not connected",
                     pair.reason);
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
  Camera camera = maps.front().saved.map.camera;
  camera.disparity_sigma = options.disparity_sigma;
  Collection collection(camera, maps.front().saved.map.pyramid);
  for (NamedMap& map : maps) {
    if (merged.saved.damage.empty()) merged.saved.damage = std::move(map.saved.damage);
    collection.add(std::move(map.saved), map.name);
    merged.names.push_back(std::move(map.name));
  }
  MapMaker maker(collection.take_map(), options);
  merged.pairs = all_pairs(merged.names.size());
  describe(maker.merge_all(), collection, merged.pairs);
  set_connected(maker.map(), collection, merged.pairs);
  merged.repeated = maker.erase_repeated_keyframes().size();
  merged.redundant = maker.erase_redundant_keyframes();
  maker.adjust_all();
  merged.saved.writer = writer;
  merged.saved.views = attached(collection.take_views(), maker.map());
  if (merged.repeated > 0) merged.saved.views = without_repeated(std::move(merged.saved.views));
  merged.saved.map = maker.map().content();
  return merged;
}

std::string merge_text(const MergedMap& merged) {
  std::string text;
  for (const MapPair& pair : merged.pairs) {
    text +=
        fmt::format("{} - {}: {}\n", merged.names[pair.a], merged.names[pair.b], pair_text(pair));
  }
  return text + fmt::format(
                    "erased: {} of several maps, {} redundant ones\n"
                    "the world is that of {}\n",
                    counted(merged.repeated, "keyframe"), merged.redundant, merged.names.front());
}

nlohmann::json merge_json(const MergedMap& merged) {
  nlohmann::json json = {{"maps", merged.names},
                         {"world", merged.names.front()},
                         {"repeated_keyframes", merged.repeated},
                         {"redundant_keyframes", merged.redundant},
                         {"pairs", nlohmann::json::array()}};
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
