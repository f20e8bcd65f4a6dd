// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/semantic_map.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/geometry/trimmed_box.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <utility>

namespace stillmap {
namespace {

/// Two detections of one class are one object if they share this part of the smaller one, since
/// each may show a part of it from another side [0..1].
constexpr double kSameClassOverlap = 0.35;
/// Two detections of different classes are one object if they share this part of their union: the
/// network is unsure about the class. An object on or in another one shares much of the smaller one
/// only [0..1].
constexpr double kOtherClassOverlap = 0.5;
/// Minimum share of the keyframes that saw an object's surface in which it was detected [0..1].
constexpr double kMinDetectionRate = 0.25;
/// A point of lower confidence gets no label [0..1].
constexpr double kMinConfidence = 0.15;
/// Minimum number of points of an object.
constexpr std::size_t kMinPoints = 60;

// A voxel with fewer pixels of an instance is chance: the outline's, or noise.
constexpr int kLeastPixels = 3;

/// One instance of one view, where it lies in the world.
struct Fragment {
  std::size_t view = 0, instance = 0;
  std::vector<Voxel> voxels;  // sorted
  std::size_t pixels = 0;
};

/// Fragments that are one thing.
struct Thing {
  std::set<Voxel> voxels;
  std::map<std::string, double> scores;  // sum of confidences per class
  std::vector<std::size_t> fragments;    // by number
  std::size_t visible = 0;               // views that saw its surface

  std::string class_name() const {
    const auto higher = [](const auto& a, const auto& b) { return a.second < b.second; };
    return std::max_element(scores.begin(), scores.end(), higher)->first;
  }
};

template <typename Visit>
void for_each_static_pixel(const ViewAtPlace& placed, Visit&& visit) {
  const DenseView& view = *placed.view;
  const Eigen::Matrix3d R = placed.T_world_camera.rotation();
  for (int row = 0; row < view.depth.rows; ++row) {
    for (int col = 0; col < view.depth.cols; ++col) {
      if (!view.is_static(row, col)) continue;
      const double z = view.depth(row, col) * double{DenseView::kDepthUnit};
      visit(Eigen::Vector3d(R * view.camera.unproject(col, row, z) +
                            placed.T_world_camera.translation()),
            view.instance_at(row, col));
    }
  }
}

std::size_t shared(const std::vector<Voxel>& some, const std::set<Voxel>& others) {
  return static_cast<std::size_t>(
      std::count_if(some.begin(), some.end(), [&](Voxel voxel) { return others.contains(voxel); }));
}

double share(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

/// The connected parts of some voxels that hold at least a third as many pixels as the largest:
/// what a mask covers of the background beside a thing is not connected to it.
std::map<Voxel, int> main_parts(const std::map<Voxel, int>& pixels) {
  std::map<Voxel, int> left = pixels;
  std::vector<std::pair<int, std::map<Voxel, int>>> parts;
  int largest = 0;
  while (!left.empty()) {
    std::vector<Voxel> open{left.begin()->first};
    std::map<Voxel, int> part{*left.begin()};
    left.erase(left.begin());
    int sum = part.begin()->second;
    while (!open.empty()) {
      const Lattice center = lattice_of(open.back());
      open.pop_back();
      for (int i = 0; i < 27; ++i) {
        const Voxel voxel = voxel_of(center + Lattice(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
        const auto found = left.find(voxel);
        if (found == left.end()) continue;
        sum += found->second;
        part.insert(*found);
        left.erase(found);
        open.push_back(voxel);
      }
    }
    largest = std::max(largest, sum);
    parts.emplace_back(sum, std::move(part));
  }
  std::map<Voxel, int> kept;
  for (auto& [sum, part] : parts) {
    if (3 * sum >= largest) kept.merge(part);
  }
  return kept;
}

/// Makes things of fragments.
class Association {
 public:
  Association(std::span<const ViewAtPlace> views, const StaticGrid& grid,
              const SemanticOptions& options)
      : views_(views), grid_(grid), options_(options) {}

  std::vector<Thing> things() {
    for (std::size_t v = 0; v < views_.size(); ++v) collect(v);
    for (std::size_t f = 0; f < fragments_.size(); ++f) take_in(f);
    while (merge_two()) {
    }
    count_views();
    std::erase_if(things_, [&](const Thing& thing) { return !is_believed(thing); });
    return std::move(things_);
  }
  const std::vector<Fragment>& fragments() const { return fragments_; }

 private:
  const ViewInstance& instance_of(const Fragment& fragment) const {
    return views_[fragment.view].view->instances[fragment.instance];
  }

  /// The fragments of a view: only what turned out to be static counts.
  void collect(std::size_t v) {
    std::vector<std::map<Voxel, int>> pixels(views_[v].view->instances.size());
    for_each_static_pixel(views_[v], [&](const Eigen::Vector3d& p, int instance) {
      if (instance < 0) return;
      const auto fine = voxel_at(p, grid_.edge());
      const std::uint32_t cell = fine ? grid_.index().find(*fine) : VoxelIndex::kNone;
      if (cell == VoxelIndex::kNone || !grid_.is_static(cell)) return;
      ++pixels[static_cast<std::size_t>(instance)][voxel_at(p, options_.cell).value()];
    });
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      std::erase_if(pixels[i], [](const auto& entry) { return entry.second < kLeastPixels; });
      Fragment fragment{.view = v, .instance = i, .voxels = {}};
      for (const auto& [voxel, count] : main_parts(pixels[i])) {
        fragment.voxels.push_back(voxel);
        fragment.pixels += static_cast<std::size_t>(count);
      }
      if (!fragment.voxels.empty()) fragments_.push_back(std::move(fragment));
    }
  }

  /// Whether two sets of voxels, `common` of which are shared, are one thing.
  double likeness(std::size_t common, std::size_t a, std::size_t b, bool same_class) const {
    if (same_class) return share(common, std::min(a, b)) / kSameClassOverlap;
    return share(common, a + b - common) / kOtherClassOverlap;
  }

  void take_in(std::size_t number) {
    const Fragment& fragment = fragments_[number];
    const ViewInstance& instance = instance_of(fragment);
    Thing* best = nullptr;
    double best_likeness = 1;  // below, it is none of them
    for (Thing& thing : things_) {
      if (fragments_[thing.fragments.back()].view == fragment.view) continue;  // told apart there
      const double like = likeness(shared(fragment.voxels, thing.voxels), fragment.voxels.size(),
                                   thing.voxels.size(), thing.class_name() == instance.class_name);
      if (like >= best_likeness) best = &thing, best_likeness = like;
    }
    if (best == nullptr) best = &things_.emplace_back();
    best->voxels.insert(fragment.voxels.begin(), fragment.voxels.end());
    best->scores[instance.class_name] += instance.confidence;
    best->fragments.push_back(number);
  }

  /// Things that grew together: two parts of a table, say, that were first seen apart.
  bool merge_two() {
    for (std::size_t a = 0; a < things_.size(); ++a) {
      for (std::size_t b = a + 1; b < things_.size(); ++b) {
        const std::vector<Voxel> voxels(things_[b].voxels.begin(), things_[b].voxels.end());
        const double like =
            likeness(shared(voxels, things_[a].voxels), voxels.size(), things_[a].voxels.size(),
                     things_[a].class_name() == things_[b].class_name());
        if (like < 1) continue;
        join(things_[a], things_[b]);
        things_.erase(things_.begin() + static_cast<std::ptrdiff_t>(b));
        return true;
      }
    }
    return false;
  }

  static void join(Thing& thing, const Thing& other) {
    thing.voxels.insert(other.voxels.begin(), other.voxels.end());
    for (const auto& [name, score] : other.scores) thing.scores[name] += score;
    std::vector<std::size_t> all;
    std::merge(thing.fragments.begin(), thing.fragments.end(), other.fragments.begin(),
               other.fragments.end(), std::back_inserter(all));
    thing.fragments = std::move(all);
  }

  /// A view has seen a thing if at least half as many of its pixels fall on the thing's surface as
  /// in the least of the views that found it.
  void count_views() {
    std::map<Voxel, std::vector<std::size_t>> things_at;
    for (std::size_t t = 0; t < things_.size(); ++t) {
      for (const Voxel voxel : things_[t].voxels) things_at[voxel].push_back(t);
    }
    for (const ViewAtPlace& placed : views_) {
      std::vector<std::size_t> pixels(things_.size(), 0);
      for_each_static_pixel(placed, [&](const Eigen::Vector3d& p, int /*instance*/) {
        const auto voxel = voxel_at(p, options_.cell);
        const auto found = voxel ? things_at.find(*voxel) : things_at.end();
        if (found == things_at.end()) return;
        for (const std::size_t t : found->second) ++pixels[t];
      });
      for (std::size_t t = 0; t < things_.size(); ++t) {
        things_[t].visible += 2 * pixels[t] >= least_pixels(things_[t]);
      }
    }
  }

  std::size_t least_pixels(const Thing& thing) const {
    std::size_t least = std::numeric_limits<std::size_t>::max();
    for (const std::size_t f : thing.fragments) least = std::min(least, fragments_[f].pixels);
    return least;
  }

  bool is_believed(const Thing& thing) const {
    return thing.fragments.size() >= static_cast<std::size_t>(options_.min_views) &&
           share(thing.fragments.size(), thing.visible) >= kMinDetectionRate;
  }

  std::span<const ViewAtPlace> views_;
  const StaticGrid& grid_;
  const SemanticOptions& options_;
  std::vector<Fragment> fragments_;
  std::vector<Thing> things_;
};

/// What the views say on one voxel of the cloud.
struct Vote {
  std::uint32_t cell;
  std::uint16_t thing;  // from 1 on
  float confidence;
};

std::vector<Vote> collect_votes(std::span<const ViewAtPlace> views, const StaticGrid& grid,
                                const std::vector<Fragment>& fragments,
                                const std::vector<Thing>& things, const SemanticOptions& options) {
  std::map<std::pair<std::size_t, std::size_t>, std::pair<std::uint16_t, const Fragment*>> thing_of;
  for (std::size_t t = 0; t < things.size(); ++t) {
    for (const std::size_t f : things[t].fragments) {
      thing_of[{fragments[f].view, fragments[f].instance}] = {static_cast<std::uint16_t>(t + 1),
                                                              &fragments[f]};
    }
  }
  std::vector<Vote> votes;
  std::vector<std::uint32_t> voted(grid.index().size(), 0);  // the last view that did, from 1 on
  for (std::size_t v = 0; v < views.size(); ++v) {
    for_each_static_pixel(views[v], [&](const Eigen::Vector3d& p, int instance) {
      if (instance < 0) return;
      const auto thing = thing_of.find({v, static_cast<std::size_t>(instance)});
      const auto voxel = voxel_at(p, grid.edge());
      if (thing == thing_of.end() || !voxel) return;
      const auto& [number, fragment] = thing->second;
      const Voxel coarse = voxel_at(p, options.cell).value();
      if (!std::binary_search(fragment->voxels.begin(), fragment->voxels.end(), coarse)) return;
      const std::uint32_t cell = grid.index().find(*voxel);
      if (cell == VoxelIndex::kNone || voted[cell] == v + 1) return;
      voted[cell] = static_cast<std::uint32_t>(v + 1);
      const auto& found = views[v].view->instances[static_cast<std::size_t>(instance)];
      votes.push_back({cell, number, found.confidence});
    });
  }
  std::stable_sort(votes.begin(), votes.end(), [](const Vote& a, const Vote& b) {
    return std::pair(a.cell, a.thing) < std::pair(b.cell, b.thing);
  });
  return votes;
}

/// Per voxel, the thing with the most votes (of equals the first), and its share.
std::vector<Vote> winners(const std::vector<Vote>& votes, const StaticGrid& grid,
                          double min_confidence) {
  std::vector<Vote> best(grid.index().size(), {0, 0, 0});
  for (auto vote = votes.begin(); vote != votes.end();) {
    Vote sum{vote->cell, vote->thing, 0};
    for (; vote != votes.end() && vote->cell == sum.cell && vote->thing == sum.thing; ++vote) {
      sum.confidence += vote->confidence;
    }
    sum.confidence /= static_cast<float>(std::max<int>(1, grid.cell(sum.cell).views));
    if (sum.confidence < min_confidence || sum.confidence <= best[sum.cell].confidence) continue;
    best[sum.cell] = sum;
  }
  return best;
}

/// The thing that the voxels around one speak for, if at least a third of those that are there do.
Vote around(const StaticGrid& grid, const std::vector<Vote>& best, std::uint32_t cell) {
  std::map<std::uint16_t, std::pair<int, float>> sums;  // voxels and confidence, by thing
  int there = 0;
  const Lattice center = lattice_of(grid.index().voxel(cell));
  for (int i = 0; i < 27; ++i) {
    const std::uint32_t other =
        grid.index().find(voxel_of(center + Lattice(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)));
    if (other == VoxelIndex::kNone || other == cell || !grid.is_static(other)) continue;
    ++there;
    if (best[other].thing == 0) continue;
    auto& [voxels, confidence] = sums[best[other].thing];
    ++voxels;
    confidence += best[other].confidence;
  }
  Vote most{cell, 0, 0};
  int voxels = 0;
  for (const auto& [thing, sum] : sums) {
    if (sum.first <= voxels || 3 * sum.first < there) continue;
    voxels = sum.first;
    most = {cell, thing, sum.second / static_cast<float>(sum.first)};
  }
  return most;
}

/// Voxels of the cloud without a label get that of those around: far from the camera a view's
/// pixels are farther apart than voxels, so that many were seen by views without a say only.
std::vector<Vote> filled(const StaticGrid& grid, std::span<const std::uint32_t> cells,
                         const std::vector<Vote>& best) {
  std::vector<Vote> all = best;
  for (const std::uint32_t cell : cells) {
    if (best[cell].thing == 0) all[cell] = around(grid, best, cell);
  }
  return all;
}

StaticObject object_of(const Thing& thing, const std::vector<Eigen::Vector3d>& points) {
  StaticObject object;
  object.class_name = thing.class_name();
  object.views = static_cast<int>(thing.fragments.size());
  object.visible = static_cast<int>(std::max(thing.visible, thing.fragments.size()));
  object.confidence =
      static_cast<float>(thing.scores.at(object.class_name) / std::max(1, object.visible));
  object.points = points.size();
  object.box = trimmed_box(points, points.size() / 100);
  object.center = object.box.center();
  return object;
}

}  // namespace

SemanticMap make_semantic_map(const StaticGrid& grid, std::span<const ViewAtPlace> views,
                              std::span<const std::uint32_t> cells,
                              const SemanticOptions& options) {
  const TraceScope scope("semantics");
  Association association(views, grid, options);
  const std::vector<Thing> things = association.things();
  SemanticMap map;
  if (things.empty()) return map;
  const std::vector<Vote> votes =
      collect_votes(views, grid, association.fragments(), things, options);
  const std::vector<Vote> best = filled(grid, cells, winners(votes, grid, kMinConfidence));

  std::vector<std::vector<Eigen::Vector3d>> points(things.size() + 1);
  for (const std::uint32_t cell : cells) {
    if (best[cell].thing > 0) points[best[cell].thing].push_back(grid.mean(cell).cast<double>());
  }
  std::vector<std::uint16_t> id_of(things.size() + 1, 0);
  for (std::size_t t = 1; t < points.size(); ++t) {
    if (points[t].size() < kMinPoints) continue;
    map.objects.push_back(object_of(things[t - 1], points[t]));
    map.objects.back().id = static_cast<int>(map.objects.size());
    id_of[t] = static_cast<std::uint16_t>(map.objects.size());
  }
  for (const std::uint32_t cell : cells) {
    map.object.push_back(id_of[best[cell].thing]);
    map.confidence.push_back(map.object.back() > 0 ? std::min(1.0F, best[cell].confidence) : 0);
  }
  if (map.objects.empty()) return {};
  return map;
}

}  // namespace stillmap
