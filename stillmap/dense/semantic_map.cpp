// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/semantic_map.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/geometry/trimmed_box.hpp"

#include <algorithm>
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

/// Side of the voxels that detections are compared in [m].
constexpr double kCell = 0.05;
/// Minimum number of keyframes that detected an object.
constexpr std::size_t kMinViews = 2;
/// Minimum number of pixels of an instance in a voxel; fewer are noise or at the outline.
constexpr int kMinPixels = 3;

/// One instance of one view in the world.
struct Fragment {
  std::size_t view = 0, instance = 0;
  std::vector<Voxel> voxels;  // sorted
  std::size_t pixels = 0;
};

/// Fragments of one object.
struct MergedObject {
  std::set<Voxel> voxels;
  std::map<std::string, double> scores;  // sum of confidences per class
  std::vector<std::size_t> fragments;    // by their index
  std::size_t visible = 0;               // number of views that saw its surface

  std::string class_name() const {
    const auto higher = [](const auto& a, const auto& b) { return a.second < b.second; };
    return std::max_element(scores.begin(), scores.end(), higher)->first;
  }
};

template <typename Visit>
void for_each_static_pixel(const PosedView& placed, Visit&& visit) {
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
  view.drop_pages();
}

std::size_t shared(const std::vector<Voxel>& some, const std::set<Voxel>& others) {
  return static_cast<std::size_t>(
      std::count_if(some.begin(), some.end(), [&](Voxel voxel) { return others.contains(voxel); }));
}

double share(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

/// Returns the connected parts of some voxels with at least a third as many pixels as the largest,
/// as background in a mask is not connected with the object.
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

/// Merges fragments into objects.
class Association {
 public:
  Association(std::span<const PosedView> views, const StaticGrid& grid)
      : views_(views), grid_(grid) {}

  std::vector<MergedObject> objects() {
    for (std::size_t v = 0; v < views_.size(); ++v) collect(v);
    for (std::size_t f = 0; f < fragments_.size(); ++f) assign(f);
    while (merge_two()) {
    }
    count_views();
    std::erase_if(objects_, [&](const MergedObject& object) { return !is_confirmed(object); });
    return std::move(objects_);
  }
  const std::vector<Fragment>& fragments() const { return fragments_; }

 private:
  const ViewInstance& instance_of(const Fragment& fragment) const {
    return views_[fragment.view].view->instances[fragment.instance];
  }

  /// Adds the fragments of a view, from static voxels only.
  void collect(std::size_t v) {
    std::vector<std::map<Voxel, int>> pixels(views_[v].view->instances.size());
    for_each_static_pixel(views_[v], [&](const Eigen::Vector3d& p, int instance) {
      if (instance < 0) return;
      const auto fine = voxel_at(p, grid_.edge());
      const std::uint32_t cell = fine ? grid_.index().find(*fine) : VoxelIndex::kNone;
      if (cell == VoxelIndex::kNone || !grid_.is_static(cell)) return;
      ++pixels[static_cast<std::size_t>(instance)][voxel_at(p, kCell).value()];
    });
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      std::erase_if(pixels[i], [](const auto& entry) { return entry.second < kMinPixels; });
      Fragment fragment{.view = v, .instance = i, .voxels = {}};
      for (const auto& [voxel, count] : main_parts(pixels[i])) {
        fragment.voxels.push_back(voxel);
        fragment.pixels += static_cast<std::size_t>(count);
      }
      if (!fragment.voxels.empty()) fragments_.push_back(std::move(fragment));
    }
  }

  /// Returns the overlap of two sets of voxels with `common` voxels in both, relative to the
  /// minimum for one object.
  static double likeness(std::size_t common, std::size_t a, std::size_t b, bool same_class) {
    if (same_class) return share(common, std::min(a, b)) / kSameClassOverlap;
    return share(common, a + b - common) / kOtherClassOverlap;
  }

  void assign(std::size_t number) {
    const Fragment& fragment = fragments_[number];
    const ViewInstance& instance = instance_of(fragment);
    MergedObject* best = nullptr;
    double best_likeness = 1;  // Below 1 it is a new object.
    for (MergedObject& object : objects_) {
      if (fragments_[object.fragments.back()].view == fragment.view)
        continue;  // Instances of one view differ.
      const double like =
          likeness(shared(fragment.voxels, object.voxels), fragment.voxels.size(),
                   object.voxels.size(), object.class_name() == instance.class_name);
      if (like >= best_likeness) best = &object, best_likeness = like;
    }
    if (best == nullptr) best = &objects_.emplace_back();
    best->voxels.insert(fragment.voxels.begin(), fragment.voxels.end());
    best->scores[instance.class_name] += instance.confidence;
    best->fragments.push_back(number);
  }

  /// Merges the first two objects that have become one, such as parts of a table that were detected
  /// separately; returns whether there were any.
  bool merge_two() {
    for (std::size_t a = 0; a < objects_.size(); ++a) {
      for (std::size_t b = a + 1; b < objects_.size(); ++b) {
        const std::vector<Voxel> voxels(objects_[b].voxels.begin(), objects_[b].voxels.end());
        const double like =
            likeness(shared(voxels, objects_[a].voxels), voxels.size(), objects_[a].voxels.size(),
                     objects_[a].class_name() == objects_[b].class_name());
        if (like < 1) continue;
        join(objects_[a], objects_[b]);
        objects_.erase(objects_.begin() + static_cast<std::ptrdiff_t>(b));
        return true;
      }
    }
    return false;
  }

  static void join(MergedObject& object, const MergedObject& other) {
    object.voxels.insert(other.voxels.begin(), other.voxels.end());
    for (const auto& [name, score] : other.scores) object.scores[name] += score;
    std::vector<std::size_t> all;
    std::merge(object.fragments.begin(), object.fragments.end(), other.fragments.begin(),
               other.fragments.end(), std::back_inserter(all));
    object.fragments = std::move(all);
  }

  /// Counts the views that saw each object: those with at least half as many pixels on its surface
  /// as the minimum of the views that detected it.
  void count_views() {
    std::map<Voxel, std::vector<std::size_t>> objects_at;
    for (std::size_t t = 0; t < objects_.size(); ++t) {
      for (const Voxel voxel : objects_[t].voxels) objects_at[voxel].push_back(t);
    }
    for (const PosedView& placed : views_) {
      std::vector<std::size_t> pixels(objects_.size(), 0);
      for_each_static_pixel(placed, [&](const Eigen::Vector3d& p, int /*instance*/) {
        const auto voxel = voxel_at(p, kCell);
        const auto found = voxel ? objects_at.find(*voxel) : objects_at.end();
        if (found == objects_at.end()) return;
        for (const std::size_t t : found->second) ++pixels[t];
      });
      for (std::size_t t = 0; t < objects_.size(); ++t) {
        objects_[t].visible += 2 * pixels[t] >= min_pixels(objects_[t]);
      }
    }
  }

  std::size_t min_pixels(const MergedObject& object) const {
    std::size_t least = std::numeric_limits<std::size_t>::max();
    for (const std::size_t f : object.fragments) least = std::min(least, fragments_[f].pixels);
    return least;
  }

  bool is_confirmed(const MergedObject& object) const {
    return object.fragments.size() >= kMinViews &&
           share(object.fragments.size(), object.visible) >= kMinDetectionRate;
  }

  std::span<const PosedView> views_;
  const StaticGrid& grid_;
  std::vector<Fragment> fragments_;
  std::vector<MergedObject> objects_;
};

/// ObjectVote of the views for the object of a voxel.
struct ObjectVote {
  std::uint32_t cell;
  std::uint16_t object;  // from 1 on
  float confidence;
};

std::vector<ObjectVote> collect_votes(std::span<const PosedView> views, const StaticGrid& grid,
                                      const std::vector<Fragment>& fragments,
                                      const std::vector<MergedObject>& objects) {
  std::map<std::pair<std::size_t, std::size_t>, std::pair<std::uint16_t, const Fragment*>>
      object_of_instance;
  for (std::size_t t = 0; t < objects.size(); ++t) {
    for (const std::size_t f : objects[t].fragments) {
      object_of_instance[{fragments[f].view, fragments[f].instance}] = {
          static_cast<std::uint16_t>(t + 1), &fragments[f]};
    }
  }
  std::vector<ObjectVote> votes;
  std::vector<std::uint32_t> voted(grid.index().size(), 0);  // last view with a vote, from 1 on
  for (std::size_t v = 0; v < views.size(); ++v) {
    for_each_static_pixel(views[v], [&](const Eigen::Vector3d& p, int instance) {
      if (instance < 0) return;
      const auto object = object_of_instance.find({v, static_cast<std::size_t>(instance)});
      const auto voxel = voxel_at(p, grid.edge());
      if (object == object_of_instance.end() || !voxel) return;
      const auto& [number, fragment] = object->second;
      const Voxel coarse = voxel_at(p, kCell).value();
      if (!std::binary_search(fragment->voxels.begin(), fragment->voxels.end(), coarse)) return;
      const std::uint32_t cell = grid.index().find(*voxel);
      if (cell == VoxelIndex::kNone || voted[cell] == v + 1) return;
      voted[cell] = static_cast<std::uint32_t>(v + 1);
      const auto& found = views[v].view->instances[static_cast<std::size_t>(instance)];
      votes.push_back({cell, number, found.confidence});
    });
  }
  std::stable_sort(votes.begin(), votes.end(), [](const ObjectVote& a, const ObjectVote& b) {
    return std::pair(a.cell, a.object) < std::pair(b.cell, b.object);
  });
  return votes;
}

/// Returns per voxel the object with the most votes, the first of equals, and its confidence.
std::vector<ObjectVote> winners(const std::vector<ObjectVote>& votes, const StaticGrid& grid,
                                double min_confidence) {
  std::vector<ObjectVote> best(grid.index().size(), {0, 0, 0});
  for (auto vote = votes.begin(); vote != votes.end();) {
    ObjectVote sum{vote->cell, vote->object, 0};
    for (; vote != votes.end() && vote->cell == sum.cell && vote->object == sum.object; ++vote) {
      sum.confidence += vote->confidence;
    }
    sum.confidence /= static_cast<float>(std::max<int>(1, grid.cell(sum.cell).views));
    if (sum.confidence < min_confidence || sum.confidence <= best[sum.cell].confidence) continue;
    best[sum.cell] = sum;
  }
  return best;
}

/// Returns the object of most voxels around a voxel, if these are at least a third of the static
/// ones.
ObjectVote vote_around(const StaticGrid& grid, const std::vector<ObjectVote>& best,
                       std::uint32_t cell) {
  std::map<std::uint16_t, std::pair<int, float>> sums;  // voxels and confidence by object
  int neighbors = 0;
  const Lattice center = lattice_of(grid.index().voxel(cell));
  for (int i = 0; i < 27; ++i) {
    const std::uint32_t other =
        grid.index().find(voxel_of(center + Lattice(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)));
    if (other == VoxelIndex::kNone || other == cell || !grid.is_static(other)) continue;
    ++neighbors;
    if (best[other].object == 0) continue;
    auto& [voxels, confidence] = sums[best[other].object];
    ++voxels;
    confidence += best[other].confidence;
  }
  ObjectVote most{cell, 0, 0};
  int voxels = 0;
  for (const auto& [object, sum] : sums) {
    if (sum.first <= voxels || 3 * sum.first < neighbors) continue;
    voxels = sum.first;
    most = {cell, object, sum.second / static_cast<float>(sum.first)};
  }
  return most;
}

/// Returns the labels with those of neighbors for voxels of the cloud without one: far from the
/// camera pixels are farther apart than voxels, so that many voxels have no votes.
std::vector<ObjectVote> filled(const StaticGrid& grid, std::span<const std::uint32_t> cells,
                               const std::vector<ObjectVote>& best) {
  std::vector<ObjectVote> all = best;
  for (const std::uint32_t cell : cells) {
    if (best[cell].object == 0) all[cell] = vote_around(grid, best, cell);
  }
  return all;
}

StaticObject object_of(const MergedObject& merged, const std::vector<Eigen::Vector3d>& points) {
  StaticObject object;
  object.class_name = merged.class_name();
  object.views = static_cast<int>(merged.fragments.size());
  object.visible = static_cast<int>(std::max(merged.visible, merged.fragments.size()));
  object.confidence =
      static_cast<float>(merged.scores.at(object.class_name) / std::max(1, object.visible));
  object.points = points.size();
  object.box = trimmed_box(points, points.size() / 100);
  object.center = object.box.center();
  return object;
}

}  // namespace

SemanticMap make_semantic_map(const StaticGrid& grid, std::span<const PosedView> views,
                              std::span<const std::uint32_t> cells) {
  const TraceScope scope("semantics");
  Association association(views, grid);
  const std::vector<MergedObject> objects = association.objects();
  SemanticMap map;
  if (objects.empty()) return map;
  const std::vector<ObjectVote> votes =
      collect_votes(views, grid, association.fragments(), objects);
  const std::vector<ObjectVote> best = filled(grid, cells, winners(votes, grid, kMinConfidence));

  std::vector<std::vector<Eigen::Vector3d>> points(objects.size() + 1);
  for (const std::uint32_t cell : cells) {
    if (best[cell].object > 0) points[best[cell].object].push_back(grid.mean(cell).cast<double>());
  }
  std::vector<std::uint16_t> id_of(objects.size() + 1, 0);
  for (std::size_t t = 1; t < points.size(); ++t) {
    if (points[t].size() < kMinPoints) continue;
    map.objects.push_back(object_of(objects[t - 1], points[t]));
    map.objects.back().id = static_cast<int>(map.objects.size());
    id_of[t] = static_cast<std::uint16_t>(map.objects.size());
  }
  for (const std::uint32_t cell : cells) {
    map.object.push_back(id_of[best[cell].object]);
    map.confidence.push_back(map.object.back() > 0 ? std::min(1.0F, best[cell].confidence) : 0);
  }
  if (map.objects.empty()) return {};
  return map;
}

}  // namespace stillmap
